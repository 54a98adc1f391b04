//! Turns goals into autopilot commands, one finite state machine per skill, and owns the resource
//! they share: the vehicle's motion.
//!
//! Above it nobody knows how an autopilot is spoken to; below it nobody knows what a skill is. It
//! does not plan, does not choose between skills, and knows nothing of areas or contingencies.
//!
//! A skill ends when its own postcondition is seen in the vehicle's data. An acknowledgement means
//! that a command was received, nothing more.

use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{self, Message, Response, Service, Topic};
use kittiwake_proto::v1;
use node::{Effect, Event, Node, Token};

pub mod config;

mod catalog;
mod commands;
mod executor;
mod fsm;
mod idle;
mod instance;
mod ledger;
mod mode_watch;
mod next_command;
mod resource;
mod stream;
mod vehicle;
mod wire;

use config::Config;
use executor::Executor;
use fsm::SkillId;

/// The service: converts messages and hands them to the executor.
pub struct SkillManager {
    executor: Executor,
}

impl SkillManager {
    /// A skill manager that runs no skill and has not heard from the vehicle.
    pub fn new(config: &Config, pace: Pace) -> SkillManager {
        SkillManager { executor: Executor::new(config, pace) }
    }

    /// A message that makes no sense is as good as none: the data it should have brought grow old.
    fn receive(&mut self, message: Message, now: Now) {
        match message {
            Message::VehicleLocalPosition(it) => {
                if let Ok(motion) = wire::motion(it) {
                    self.executor.moved(motion, now);
                }
            }
            Message::VehicleStatus(it) => {
                if let Ok(status) = wire::status(&it) {
                    self.executor.reported(status, now);
                }
            }
            Message::VehicleLandDetected(it) => self.executor.land_detected(wire::landed(&it), now),
            Message::VehicleCommandAck(it) => {
                let id = it.id;
                if let Ok(answer) = wire::answer(it) {
                    self.executor.acknowledged(id, answer, now);
                }
            }
            _ => {}
        }
    }

    fn serve(&mut self, request: topics::Request, now: Now) -> Option<Response> {
        match request {
            topics::Request::Skill(it) => Some(Response::Skill(self.executor.request(wire::request(it), now))),
            topics::Request::SkillCancel(it) => {
                let result = self.executor.cancel(SkillId(it.skill_id), now);
                let accepted = result.is_ok();
                let refusal = result.err().unwrap_or_default();
                Some(Response::SkillCancel(v1::SkillCancelReply { accepted, refusal }))
            }
            topics::Request::SkillTable(_) => {
                Some(Response::SkillTable(v1::SkillTable { skills: self.executor.table(now) }))
            }
            _ => None,
        }
    }

    fn reply(&mut self, token: Token, request: topics::Request, now: Now, effects: &mut Vec<Effect>) {
        // Before anything that follows from it: the caller knows the skill's id when its first event comes.
        effects.extend(self.serve(request, now).map(|response| Effect::Reply { token, response }));
    }
}

impl Node for SkillManager {
    fn name(&self) -> &'static str {
        "skill-manager"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[Topic::VehicleCommandAck, Topic::VehicleStatus, Topic::VehicleLocalPosition, Topic::VehicleLandDetected]
    }

    fn serves(&self) -> &'static [Service] {
        &[Service::Skill, Service::SkillCancel, Service::SkillTable]
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        match event {
            Event::Message { message, .. } => self.receive(message, now),
            Event::Request { token, request, .. } => self.reply(token, request, now, effects),
            Event::Reply { .. } | Event::Peer { .. } => {}
        }
        effects.extend(self.executor.take_messages().map(Effect::publish));
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.executor.time_passed(now);
        effects.extend(self.executor.take_messages().map(Effect::publish));
    }

    fn deadline(&self) -> Option<Time> {
        self.executor.deadline()
    }
}
