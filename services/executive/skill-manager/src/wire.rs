//! The messages of this service, from and to its own types.

use domain::fmu::Status;
use domain::skill::Goal;
use domain::wire::InvalidMessage;
use domain::wire::task::{along_from_wire, inputs_to_wire, values_from_wire, values_to_wire};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1::{self, SkillOutcome};

use crate::executor::{Answer, Request};
use crate::fsm::{SkillId, SkillState};
use crate::messages::{Feedback, Input, Output, SkillReport, TaskOrder, TaskReport, TaskState};

/// The input in a message; `None` where the message is of no interest.
pub(crate) fn input(message: Message) -> Result<Option<Input>, InvalidMessage> {
    Ok(Some(match message {
        Message::VehicleLocalPosition(it) => Input::Position(it.try_into()?),
        Message::VehicleStatus(it) => Input::Status(Status::from(it)),
        Message::VehicleLandDetected(it) => Input::Landed(it.into()),
        Message::VehicleCommandAck(it) => Input::Acknowledged(it.try_into()?),
        Message::TaskReport(it) => Input::Task(task_report(it)?),
        _ => return Ok(None),
    }))
}

/// A request for a skill, with what is wrong with it in place of a goal that cannot be flown.
pub(crate) fn request(message: v1::SkillRequest) -> Request {
    let when_busy = message.when_busy();
    let goal = match when_busy {
        v1::WhenBusy::Unspecified => Err(InvalidMessage::Missing("when_busy")),
        v1::WhenBusy::Replace | v1::WhenBusy::Refuse => {
            message.goal.ok_or(InvalidMessage::Missing("goal")).and_then(Goal::try_from)
        }
    };
    let has_id = !message.request_id.is_empty();
    Request {
        id: message.request_id,
        goal: goal
            .and_then(|it| has_id.then_some(it).ok_or(InvalidMessage::Missing("request_id")))
            .and_then(|it| Ok((it, along_from_wire(message.along)?))),
        replaces: when_busy == v1::WhenBusy::Replace,
        takes_control: message.takes_control,
        gave_up: (message.gave_up_skill_id != 0).then_some(SkillId(message.gave_up_skill_id)),
    }
}

/// The answer to a request.
pub(crate) fn skill_reply(answer: Answer) -> v1::SkillReply {
    match answer {
        Ok(id) => v1::SkillReply { skill_id: id.0, refusal: String::new() },
        Err(refusal) => v1::SkillReply { skill_id: 0, refusal },
    }
}

/// The answer to a cancellation.
pub(crate) fn cancel_reply(result: Result<(), String>) -> v1::SkillCancelReply {
    v1::SkillCancelReply { accepted: result.is_ok(), refusal: result.err().unwrap_or_default() }
}

/// The messages of an output. A setpoint comes after the proof of life that says which kind it is.
pub(crate) fn messages(output: Output) -> Vec<Message> {
    match output {
        Output::Command(command) => vec![v1::VehicleCommand::from(command).into()],
        Output::Setpoint(setpoint) => {
            let control = v1::OffboardControlMode::from(setpoint.control());
            vec![control.into(), v1::TrajectorySetpoint::from(setpoint).into()]
        }
        Output::Report(report) => vec![skill_event(&report).into()],
        Output::Feedback(feedback) => vec![skill_feedback(feedback).into()],
        Output::Task(order) => vec![task_order(order).into()],
    }
}

fn task_order(order: TaskOrder) -> v1::TaskOrder {
    let TaskOrder { request_id, task, cancel } = order;
    v1::TaskOrder { request_id, inputs: inputs_to_wire(&task.inputs), skill: task.skill, cancel }
}

/// Only as many results, and only as much of a reason, as people read.
const MOST_RESULTS: usize = 20;
const LONGEST_REASON: usize = 200;

fn task_report(report: v1::TaskReport) -> Result<TaskReport, InvalidMessage> {
    let state = match report.state() {
        v1::TaskState::Unspecified => return Err(InvalidMessage::Missing("state")),
        v1::TaskState::Ready => TaskState::Ready,
        v1::TaskState::Running => TaskState::Running,
        v1::TaskState::Ended => TaskState::Ended,
    };
    let shown = |it: String| it.chars().filter(|it| !it.is_control()).take(LONGEST_REASON).collect::<String>();
    let v1::TaskReport { skill, request_id, outcome, reason, mut results, .. } = report;
    results.truncate(MOST_RESULTS);
    let results = values_from_wire(results)?.into_iter().map(|(name, value)| (shown(name), value)).collect();
    Ok(TaskReport { skill, request_id, state, outcome: shown(outcome), reason: shown(reason), results })
}

/// The event of a skill that changed its state; its outcome with where and how the vehicle is.
pub(crate) fn skill_event(report: &SkillReport) -> v1::SkillEvent {
    let mut event = v1::SkillEvent {
        skill_id: report.id.0,
        request_id: report.request_id.clone(),
        kind: report.kind as i32,
        state: skill_state(&report.state) as i32,
        along: report.along.clone(),
        ..v1::SkillEvent::default()
    };
    match &report.state {
        SkillState::Execute { trouble: Some(trouble) } => event.reason = trouble.clone(),
        SkillState::Abort { by } => event.reason = format!("overwritten by skill {by}"),
        SkillState::Ended(ending) => {
            event.outcome = ending.outcome as i32;
            event.reason = ending.reason.clone();
            event.results = values_to_wire(&ending.results);
            event.position = report.motion.map(|it| it.position.into());
            event.velocity = report.motion.map(|it| it.velocity.into());
            event.position_timestamp_us = report.motion.map_or(0, |it| it.timestamp_us);
            event.landed_timestamp_us = report.landed_timestamp_us;
            event.flown_by_other = report.flown_by_other && ending.outcome == SkillOutcome::Preempted;
        }
        _ => {}
    }
    event
}

fn skill_feedback(feedback: Feedback) -> v1::SkillFeedback {
    v1::SkillFeedback {
        skill_id: feedback.id.0,
        kind: feedback.kind as i32,
        position: Some(feedback.motion.position.into()),
        velocity: Some(feedback.motion.velocity.into()),
        distance_left_m: feedback.distance_left_m,
    }
}

fn skill_state(state: &SkillState) -> v1::SkillState {
    match state {
        SkillState::ProcessRequest(_) => v1::SkillState::ProcessRequest,
        SkillState::Execute { .. } => v1::SkillState::Execute,
        SkillState::Report(_) => v1::SkillState::Report,
        SkillState::Cancel => v1::SkillState::Cancel,
        SkillState::Abort { .. } => v1::SkillState::Abort,
        SkillState::Ended(_) => v1::SkillState::Ended,
    }
}
