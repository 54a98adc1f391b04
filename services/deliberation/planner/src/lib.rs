//! Turns objectives into plans: what to fly, and which permissions to get on the way.
//!
//! The planner answers requests that carry the vehicle's state. Of the telemetry it hears only the status, for the origin of the
//! vehicle's local frame, and it never waits: where there is nothing to fly it says how long to hold. It does not fly, and it does
//! not ask the control tower: the mission manager does both, step by step.
//!
//! Messages become domain types here and in `wire`; nothing below knows of them.

use std::time::Duration;

use domain::energy::EnergyModel;
use domain::geodesy::Origin;
use domain::geometry::Ned;
use domain::memory::{MemoryHealth, MemoryLoss};
use domain::mission::Mission;
use domain::plan::{PlanReply, PlanRequest, StepDone, StepId};
use domain::state::State;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Message, Request, Response, Service, Topic};
use kittiwake_proto::v1;
use node::{Effect, Event, Node};

mod actions;
mod airspace;
mod alternates;
mod area_map;
mod asking_ahead;
mod back_chaining;
mod communication;
pub mod config;
mod drafting;
mod energy;
mod first_answers;
mod forecast;
mod free_order;
mod grant_lengths;
mod hold;
mod mission_planner;
mod mission_request;
mod new_airspace;
mod objectives;
mod ordering;
mod permissions;
mod persisted;
mod plan;
mod repair;
mod routing;
mod score;
mod stuck;
mod survey;
mod wire;

#[cfg(test)]
mod tests;

use config::Config;
use first_answers::FirstAnswers;
use mission_planner::{Answer, MissionPlanner};
pub use persisted::UnusableState;

/// The planner as a process: what it has planned, what it has answered, and when its status is due.
#[derive(Debug)]
pub struct Planner {
    core: MissionPlanner,
    /// The identity of the mission it was started with.
    configured: String,
    plans: FirstAnswers<v1::ReplanReply>,
    changes: FirstAnswers<v1::MissionReply>,
    /// The vehicle's state as it was heard last.
    state: State,
    status_period: Duration,
    /// When the status is due; at once after a change.
    status_at: Time,
    memory: MemoryHealth,
    /// What the mission manager said last about the end.
    end: mission_request::End,
}

/// Without an operator's decision about a lost memory it is asked again after this, in mission time.
const LOSS_PAUSE: Duration = Duration::from_secs(1);

impl Planner {
    /// A planner for `mission`, nothing of which has been attempted, and a vehicle with these figures.
    pub fn new(config: &Config, energy: &EnergyModel, mission: Mission, pace: Pace) -> Planner {
        Planner {
            configured: mission.identity(),
            core: MissionPlanner::new(config, energy, mission, pace),
            plans: FirstAnswers::default(),
            changes: FirstAnswers::default(),
            state: State::new(Ned::default(), false),
            end: mission_request::End::default(),
            status_period: pace.wall(config.status_rate_hz.period()),
            status_at: Time::ZERO,
            memory: MemoryHealth::default(),
        }
    }

    /// What another planner needs to go on from here, should this process end.
    pub fn memory(&self) -> v1::PlannerMemory {
        let loss = self.memory.loss.clone().map(Into::into);
        v1::PlannerMemory { loss, ..persisted::persist(&self.core, &self.configured).into() }
    }

    /// What a planner before has saved last is lost: nothing is planned until an operator has accepted that.
    pub fn memory_lost(&mut self, loss: MemoryLoss) {
        self.memory.loss = Some(loss);
        self.status_at = Time::ZERO;
    }

    /// The outcome of the newest attempt to save. `loss` names the loss that a failure is, as long as no attempt has
    /// succeeded.
    pub fn memory_written(&mut self, outcome: Result<(), String>, loss: Option<u64>) {
        self.memory.written(outcome, loss);
        self.status_at = Time::ZERO;
    }

    /// Goes on where the planner of `memory` was; to be called before anything else.
    ///
    /// # Errors
    /// Why the state cannot be used; the planner then begins with the mission it was made for.
    pub fn resume(&mut self, memory: v1::PlannerMemory) -> Result<(), UnusableState> {
        if memory.configured != self.configured {
            return Err(UnusableState::OfAnotherMission);
        }
        let loss = memory.loss.clone();
        persisted::resume(&mut self.core, memory.try_into()?)?;
        self.memory.loss = loss.map(Into::into);
        Ok(())
    }

    fn replan(&mut self, now: Now, request: v1::ReplanRequest, effects: &mut Vec<Effect>) -> v1::ReplanReply {
        let request_id = request.request_id.clone();
        if let Some(reply) = self.plans.get(&request_id) {
            return reply.clone();
        }
        let reply: v1::ReplanReply = match PlanRequest::try_from(request) {
            Err(invalid) => {
                effects.push(Effect::refused(Service::Replan, &invalid));
                PlanReply::Refused(invalid.to_string())
            }
            Ok(request) => {
                self.state = request.state.clone();
                self.status_at = now.time;
                if let Some(loss) = self.memory.loss.as_ref().filter(|it| it.id != request.accepted_loss) {
                    let reason = format!("waits for an operator, since the planner's memory is unusable: {}", loss.why);
                    return PlanReply::Hold { wait: LOSS_PAUSE, reason, planned: false }.into();
                }
                self.memory.loss = None;
                match self.core.replan(request, now) {
                    Answer::Plan(_) => PlanReply::Plan(self.core.plan()),
                    Answer::Hold { wait, reason } => PlanReply::Hold { wait, reason, planned: false },
                    Answer::Dwell { wait, reason } => PlanReply::Hold { wait, reason, planned: true },
                    Answer::Finished => PlanReply::Finished,
                }
            }
        }
        .into();
        self.plans.remember(request_id, reply.clone());
        reply
    }

    fn vehicle_status(&mut self, now: Now, status: &v1::VehicleStatus, effects: &mut Vec<Effect>) {
        let origin = match status.origin.map(Origin::try_from).transpose() {
            Ok(origin) => origin,
            Err(invalid) => return effects.push(Effect::refused(Topic::VehicleStatus, &invalid)),
        };
        if self.core.note_vehicle_origin(origin, status.armed) {
            self.status_at = now.time;
        }
    }

    fn next_step(&self, request: v1::NextStepRequest) -> v1::NextStepReply {
        let after = Some(request.after_step_id).filter(|id| *id != 0).map(StepId);
        let step = self.core.next_after(after).and_then(|step| self.core.flyable(&step));
        v1::NextStepReply { step: step.map(Into::into) }
    }

    fn step_done(&mut self, now: Now, request: v1::StepDone, effects: &mut Vec<Effect>) -> v1::StepDoneReply {
        let result = StepDone::try_from(request).map_err(|invalid| {
            effects.push(Effect::refused(Service::StepDone, &invalid));
            invalid.to_string()
        });
        let result = result.and_then(|StepDone { id, state }| {
            self.core.step_done(id, &state, now).map_err(|unknown| unknown.to_string())?;
            (self.state, self.status_at) = (state, now.time);
            Ok(())
        });
        v1::StepDoneReply { accepted: result.is_ok(), refusal: result.err().unwrap_or_default() }
    }

    fn mission(&mut self, now: Now, request: v1::MissionRequest) -> v1::MissionReply {
        if let Some(reply) = self.changes.get(&request.request_id) {
            return v1::MissionReply { status: Some(self.core.status().into()), ..reply.clone() };
        }
        let request_id = request.request_id.clone();
        let result = wire::mission_request(request).and_then(|(state, request)| {
            let state = state.as_ref().unwrap_or(&self.state);
            mission_request::answer(&mut self.core, request, state, &self.end, now)
        });
        let mut reply = wire::mission_reply(result, self.core.status());
        self.status_at = now.time;
        // The mission may be megabytes: with a repeated answer the present one is told.
        let status = reply.status.take();
        self.changes.remember(request_id, reply.clone());
        v1::MissionReply { status, ..reply }
    }
}

impl Node for Planner {
    fn name(&self) -> &'static str {
        "planner"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[Topic::McmStatus, Topic::VehicleStatus]
    }

    fn serves(&self) -> &'static [Service] {
        &[Service::Replan, Service::NextStep, Service::StepDone, Service::Mission]
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        let (token, request) = match event {
            Event::Request { token, request, .. } => (token, request),
            Event::Message { message: Message::McmStatus(status), .. } => {
                let is_flown = status.report.is_none() && !status.start_awaited;
                let next_waits = status.start_awaited;
                self.end = mission_request::End { why: status.ends, is_flown, next_waits };
                return;
            }
            Event::Message { message: Message::VehicleStatus(status), .. } => {
                return self.vehicle_status(now, &status, effects);
            }
            // A mission manager without a memory begins nothing before it has heard the planner.
            Event::Peer { service, alive: true, .. } if service == "mcm" => {
                self.status_at = now.time;
                return;
            }
            _ => return,
        };
        let response = match request {
            Request::Replan(request) => Response::Replan(self.replan(now, request, effects)),
            Request::NextStep(request) => Response::NextStep(self.next_step(request)),
            Request::StepDone(request) => Response::StepDone(self.step_done(now, request, effects)),
            Request::Mission(request) => Response::Mission(self.mission(now, request)),
            _ => return,
        };
        effects.push(Effect::Reply { token, response });
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.core.pass(now);
        if self.status_at <= now.time {
            let memory = Some(self.memory.clone().into());
            effects.push(Effect::publish(v1::PlannerStatus { memory, ..self.core.status().into() }));
            self.status_at = now.time + self.status_period;
        }
    }

    fn deadline(&self) -> Option<Time> {
        Some(self.status_at)
    }
}
