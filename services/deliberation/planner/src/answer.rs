//! Requests and answers on the wire, and the memory that gives a repeated request its first answer.

use std::collections::VecDeque;

use domain::wire::Senseless;
use kittiwake_proto::v1;

use crate::actions::{Clauses, Parameters};
use crate::mission_planner::{Answer, MissionPlanner, Replan};
use crate::permissions::Denial;
use crate::plan::Step;

/// The answers to the last requests, by request id.
#[derive(Debug)]
pub struct Answers<R> {
    newest_last: VecDeque<(String, R)>,
}

impl<R> Default for Answers<R> {
    fn default() -> Answers<R> {
        Answers { newest_last: VecDeque::new() }
    }
}

impl<R> Answers<R> {
    /// Answers remembered: a request is repeated within seconds, long before so many new ones.
    const REMEMBERED: usize = 64;

    /// The answer that `request_id` was given.
    pub fn get(&self, request_id: &str) -> Option<&R> {
        self.newest_last.iter().find(|(id, _)| id == request_id).map(|(_, reply)| reply)
    }

    /// Remembers the answer to `request_id`; one without an id cannot be repeated.
    pub fn remember(&mut self, request_id: String, reply: R) {
        if request_id.is_empty() {
            return;
        }
        if self.newest_last.len() == Self::REMEMBERED {
            self.newest_last.pop_front();
        }
        self.newest_last.push_back((request_id, reply));
    }
}

impl TryFrom<v1::ReplanRequest> for Replan {
    type Error = Senseless;
    fn try_from(it: v1::ReplanRequest) -> Result<Replan, Senseless> {
        let denial = |it: v1::Denial| Denial { area: it.area, silent: it.silent, reason: it.reason };
        Ok(Replan {
            state: it.state.ok_or(Senseless::Missing("state"))?.try_into()?,
            failed_step: Some(it.failed_step_id).filter(|id| *id != 0),
            failure: it.failure,
            denials: it.denials.into_iter().map(denial).collect(),
        })
    }
}

/// `answer` as the reply to a request.
pub fn reply(answer: &Answer, planner: &MissionPlanner) -> v1::ReplanReply {
    use v1::replan_reply::Reply;
    let reply = match answer {
        Answer::Plan(_) => Reply::Plan(plan(planner)),
        Answer::Hold { wait, reason } => {
            Reply::Hold(v1::HoldUntil { wait_s: wait.as_secs_f64(), reason: reason.clone() })
        }
        Answer::Finished => Reply::Finished(v1::Finished {}),
    };
    v1::ReplanReply { reply: Some(reply) }
}

/// `step`, which serves the current objective.
pub fn plan_step(step: &Step, planner: &MissionPlanner) -> v1::PlanStep {
    v1::PlanStep {
        id: step.id,
        objective: planner.objectives().current_index() as u32,
        goal_state: Some((&step.action.to).into()),
        nominal: Some((&step.action.nominal).into()),
        ask_permissions: step.communication.ask.clone(),
        auxiliary: step.communication.auxiliary,
    }
}

/// What everybody may know of the planner.
pub fn status(planner: &MissionPlanner) -> v1::PlannerStatus {
    v1::PlannerStatus {
        mission: planner.mission().name.clone(),
        objectives: planner.objectives().all().iter().map(Into::into).collect(),
        areas: planner.mission().areas.iter().map(Into::into).collect(),
        plan: Some(plan(planner)),
        current_objective: planner.objectives().current_index() as u32,
        hold: planner.hold_reason().unwrap_or_default().into(),
        epoch: planner.epoch(),
    }
}

/// What is left of the present plan.
pub fn plan(planner: &MissionPlanner) -> v1::Plan {
    v1::Plan {
        objective: planner.objectives().current_index() as u32,
        steps: planner.steps().iter().map(|it| plan_step(it, planner)).collect(),
        revision: planner.revision(),
        epoch: planner.epoch(),
    }
}

impl From<&Parameters> for v1::ParameterSet {
    fn from(it: &Parameters) -> v1::ParameterSet {
        v1::ParameterSet {
            goal: Some(it.goal.into()),
            precondition: Some((&it.precondition).into()),
            invariant: Some((&it.invariant).into()),
        }
    }
}

impl From<&Clauses> for v1::Condition {
    fn from(it: &Clauses) -> v1::Condition {
        v1::Condition { flying: it.flying, mode: it.mode.map(|mode| mode as i32), permissions: it.permissions.clone() }
    }
}
