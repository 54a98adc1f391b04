//! A goal of the action `fly_mission`: a mission that somebody in ROS asked for, from its upload to its report.

use kittiwake_proto::v1;
use kittiwake_proto::v1::MissionOutcome;

use crate::cdr::Writer;
use crate::messages::lower;
use crate::stamp::Stamp;

/// Chosen by the client.
pub(crate) type GoalId = [u8; 16];

/// A goal that was accepted.
#[derive(Debug)]
pub(crate) struct Goal {
    pub(crate) id: GoalId,
    pub(crate) accepted: Stamp,
    /// The mission's name.
    mission: String,
    state: State,
    /// The vehicle was ordered to return.
    pub(crate) is_canceled: bool,
    /// Requests that wait for its result.
    pub(crate) waiting: Vec<u64>,
}

/// How far a goal is.
#[derive(Debug)]
enum State {
    /// Uploaded; the document may still be that of the mission before, which had this report.
    Loading(Option<v1::MissionReport>),
    /// The vehicle works on it.
    Executing,
    /// It is over.
    Ended(End),
}

/// How a goal ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct End {
    status: i8,
    outcome: String,
    reason: String,
    achieved: u32,
    objectives: u32,
}

/// As `action_msgs/msg/GoalStatus` has them.
const ACCEPTED: i8 = 1;
const EXECUTING: i8 = 2;
const CANCELING: i8 = 3;
const SUCCEEDED: i8 = 4;
const CANCELED: i8 = 5;
const ABORTED: i8 = 6;

impl Goal {
    /// Its mission was uploaded while the document showed the report `before`.
    pub(crate) fn new(id: GoalId, mission: String, accepted: Stamp, before: Option<v1::MissionReport>) -> Goal {
        Goal { id, accepted, mission, state: State::Loading(before), is_canceled: false, waiting: Vec::new() }
    }

    pub(crate) fn has_ended(&self) -> bool {
        matches!(self.state, State::Ended(_))
    }

    /// Whether the vehicle waits for the order to start this mission.
    pub(crate) fn awaits_start(&self, document: &v1::Vehicle) -> bool {
        let waits = document.operator.as_ref().is_some_and(|it| it.start_awaited);
        waits && !self.has_ended() && self.is_shown(document)
    }

    /// Takes in what the vehicle says; true if the goal's state is another one now.
    pub(crate) fn follow(&mut self, document: &v1::Vehicle) -> bool {
        let (shown, report) = (self.is_shown(document), &document.report);
        let next = match &self.state {
            State::Ended(_) => return false,
            State::Loading(before) if !shown || (report.is_some() && report == before) => return false,
            _ => match report {
                Some(report) => State::Ended(self.end(report)),
                None if !shown => State::Ended(aborted("another mission was uploaded".to_owned())),
                None if matches!(self.state, State::Loading(_)) => State::Executing,
                None => return false,
            },
        };
        self.state = next;
        true
    }

    /// Ends it without a report.
    pub(crate) fn abort(&mut self, reason: String) {
        if !self.has_ended() {
            self.state = State::Ended(aborted(reason));
        }
    }

    pub(crate) fn status(&self) -> i8 {
        match &self.state {
            State::Ended(end) => end.status,
            _ if self.is_canceled => CANCELING,
            State::Loading(_) => ACCEPTED,
            State::Executing => EXECUTING,
        }
    }

    /// The response to `get_result`; `None` while it is flown.
    pub(crate) fn result(&self) -> Option<Vec<u8>> {
        let State::Ended(end) = &self.state else { return None };
        Some(end.response())
    }

    /// `FlyMission_FeedbackMessage`; `None` unless it is flown.
    pub(crate) fn feedback(&self, document: &v1::Vehicle) -> Option<Vec<u8>> {
        if !matches!(self.state, State::Executing) {
            return None;
        }
        let mission = document.mission.as_ref()?;
        let (settled, left) = (mission.current_objective(), document.plan.as_ref().and_then(|it| it.current.as_ref()));
        let current = usize::try_from(settled).ok().and_then(|it| mission.objectives.get(it));
        let message = Writer::default()
            .bytes(&self.id)
            .string(&lower(mission.phase().as_str_name(), "MISSION_PHASE_"))
            .string(current.map_or("", |it| &it.name))
            .u32(settled)
            .u32(count(mission.objectives.len()))
            .f64(left.map_or(0.0, |it| it.distance_left_m));
        Some(message.end())
    }

    fn is_shown(&self, document: &v1::Vehicle) -> bool {
        document.mission.as_ref().and_then(|it| it.name.as_deref()) == Some(&self.mission)
    }

    fn end(&self, report: &v1::MissionReport) -> End {
        let status = match report.outcome() {
            MissionOutcome::Success => SUCCEEDED,
            _ if self.is_canceled => CANCELED,
            _ => ABORTED,
        };
        let achieved = report.objectives.iter().filter(|it| it.state() == v1::ObjectiveState::Success).count();
        End {
            status,
            outcome: lower(report.outcome().as_str_name(), "MISSION_OUTCOME_"),
            reason: report.reason.clone(),
            achieved: count(achieved),
            objectives: count(report.objectives.len()),
        }
    }
}

impl End {
    /// For a goal that nobody knows.
    pub(crate) fn unknown() -> End {
        End { status: 0, ..aborted("no such goal was accepted".to_owned()) }
    }

    pub(crate) fn response(&self) -> Vec<u8> {
        let writer = Writer::default().i8(self.status).string(&self.outcome).string(&self.reason);
        writer.u32(self.achieved).u32(self.objectives).end()
    }
}

fn aborted(reason: String) -> End {
    End { status: ABORTED, outcome: String::new(), reason, achieved: 0, objectives: 0 }
}

fn count(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}
