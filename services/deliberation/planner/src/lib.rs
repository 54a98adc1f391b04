//! Turns objectives into plans: what to fly, and which permissions to get on the way.
//!
//! The planner answers requests that carry the vehicle's state; it receives no telemetry, and it
//! never waits: where there is nothing to fly it says how long to hold. It does not fly, and it does
//! not ask the control tower: the mission manager does both, step by step.

use domain::geometry::Ned;
use domain::mission::Mission;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Request, Response, Service, Topic};
use kittiwake_proto::v1;
use node::{Effect, Event, Node};

pub mod actions;
pub mod airspace;
pub mod answer;
pub mod back_chaining;
pub mod communication;
pub mod config;
pub mod drafting;
pub mod forecast;
pub mod hold;
pub mod memory;
pub mod mission_planner;
pub mod objectives;
pub mod operator;
pub mod permissions;
pub mod plan;
pub mod repair;
pub mod routing;
pub mod state;
pub mod stuck;
pub mod way_out;

#[cfg(test)]
mod tests;

use answer::Answers;
use config::Config;
use mission_planner::{MissionPlanner, Replan};
use state::State;

/// The planner as a process: its memory, its answers so far, and when to tell of itself.
#[derive(Debug)]
pub struct Planner {
    core: MissionPlanner,
    /// The mission it was started with, in words.
    configured: String,
    answers: Answers<v1::ReplanReply>,
    changes: Answers<v1::MissionReply>,
    /// The vehicle's state as it was told last.
    state: State,
    status_period: std::time::Duration,
    /// When the status is due; at once after a change.
    status_at: Time,
}

impl Planner {
    /// A planner for `mission`, nothing of which has been attempted.
    pub fn new(config: &Config, mission: Mission, pace: Pace) -> Planner {
        Planner {
            configured: mission.in_words(),
            core: MissionPlanner::new(config, mission, pace),
            answers: Answers::default(),
            changes: Answers::default(),
            state: State::new(Ned::default(), false),
            status_period: pace.wall(config.status_rate_hz.period()),
            status_at: Time::ZERO,
        }
    }

    /// What another planner needs to go on from here, should this process end.
    pub fn memory(&self) -> v1::PlannerMemory {
        memory::memory(&self.core, &self.configured)
    }

    /// Goes on where the planner of `memory` was; to be called before anything else.
    ///
    /// # Errors
    /// Why the memory is of no use; the planner then begins with the mission it was made for.
    pub fn resume(&mut self, memory: v1::PlannerMemory) -> Result<(), memory::Useless> {
        memory::resume(&mut self.core, &self.configured, memory)
    }

    /// `None` for a request that makes no sense.
    fn replan(&mut self, now: Now, request: v1::ReplanRequest) -> Option<v1::ReplanReply> {
        let request_id = request.request_id.clone();
        if let Some(reply) = self.answers.get(&request_id) {
            return Some(reply.clone());
        }
        let request = Replan::try_from(request).ok()?;
        self.state = request.state.clone();
        let answer = self.core.replan(request, now);
        let reply = answer::reply(&answer, &self.core);
        self.answers.remember(request_id, reply.clone());
        self.status_at = now.time;
        Some(reply)
    }

    fn next_step(&self, request: v1::NextStepRequest) -> v1::NextStepReply {
        let step = self.core.next_after(request.after_step_id);
        v1::NextStepReply { step: step.map(|it| answer::plan_step(&it, &self.core)) }
    }

    fn step_done(&mut self, now: Now, request: v1::StepDone) -> v1::StepDoneReply {
        let refused = |refusal: String| v1::StepDoneReply { accepted: false, refusal };
        let Some(state) = request.state else { return refused("`state` is missing".into()) };
        let state = match State::try_from(state) {
            Ok(state) => state,
            Err(senseless) => return refused(senseless.to_string()),
        };
        match self.core.step_done(request.step_id, &state) {
            Ok(()) => {
                self.state = state;
                self.status_at = now.time;
                v1::StepDoneReply { accepted: true, refusal: String::new() }
            }
            Err(unknown) => refused(unknown.to_string()),
        }
    }
}

impl Planner {
    fn mission(&mut self, now: Now, request: v1::MissionRequest) -> v1::MissionReply {
        if let Some(reply) = self.changes.get(&request.request_id) {
            return reply.clone();
        }
        let request_id = request.request_id.clone();
        let mut reply = operator::answer(&mut self.core, &self.state, request, now);
        reply.status = Some(answer::status(&self.core));
        self.status_at = now.time;
        self.changes.remember(request_id, reply.clone());
        reply
    }
}

impl Node for Planner {
    fn name(&self) -> &'static str {
        "planner"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[]
    }

    fn serves(&self) -> &'static [Service] {
        &[Service::Replan, Service::NextStep, Service::StepDone, Service::Mission]
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        let Event::Request { token, request, .. } = event else { return };
        let response = match request {
            Request::Replan(it) => self.replan(now, it).map(Response::Replan),
            Request::NextStep(it) => Some(Response::NextStep(self.next_step(it))),
            Request::StepDone(it) => Some(Response::StepDone(self.step_done(now, it))),
            Request::Mission(it) => Some(Response::Mission(self.mission(now, it))),
            _ => None,
        };
        effects.extend(response.map(|response| Effect::Reply { token, response }));
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        if self.status_at <= now.time {
            effects.push(Effect::publish(answer::status(&self.core)));
            self.status_at = now.time + self.status_period;
        }
    }

    fn deadline(&self) -> Option<Time> {
        Some(self.status_at)
    }
}
