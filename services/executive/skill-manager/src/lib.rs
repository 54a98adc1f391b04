//! Turns goals into autopilot commands, with one finite state machine per skill, and owns the
//! resource that all skills share: the vehicle's motion.
//!
//! Nothing above it knows how an autopilot is commanded; nothing below it knows what a skill is. It
//! does not plan, does not choose between skills, and knows nothing of areas or contingencies.
//!
//! A skill ends when its own postcondition is seen in the vehicle's data. An acknowledgement means
//! that a command was received, nothing more.

use std::time::Duration;

use domain::time::{Now, Pace, Time};
use domain::wire::InvalidMessage;
use kittiwake_proto::topics::{Message, Request, Response, Service, Topic};
use kittiwake_proto::v1;
use node::{Effect, Event, Node};

pub mod config;

mod catalog;
mod commands;
mod control;
mod executor;
mod farewell;
mod fsm;
mod history;
mod idle;
mod ids;
mod messages;
mod mode_watch;
mod resource;
mod skill_run;
mod slots;
mod stream;
mod tracks;
mod vehicle;
mod wire;

use config::Config;
use executor::Executor;
use fsm::SkillId;

/// The period of [`v1::SkillControl`], in wall time.
const TELL_PERIOD: Duration = Duration::from_millis(500);

/// The service: converts messages and hands them to the executor.
pub struct SkillManager {
    executor: Executor,
    /// Who else flies, as it was told last, and when.
    told: Option<(Time, String)>,
    tell_period: Duration,
}

impl SkillManager {
    /// A skill manager that runs no skill and has not heard from the vehicle.
    pub fn new(config: &Config, pace: Pace) -> SkillManager {
        SkillManager { executor: Executor::new(config, pace), told: None, tell_period: pace.wall(TELL_PERIOD) }
    }

    /// An invalid message changes nothing: the data that it should have brought grow old.
    fn receive(&mut self, message: Message, now: Now) -> Result<(), InvalidMessage> {
        if let Some(input) = wire::input(message)? {
            self.executor.receive(input, now);
        }
        Ok(())
    }

    /// The response to a request; `None` for a service that is not served here.
    fn respond(&mut self, request: Request, now: Now, effects: &mut Vec<Effect>) -> Option<Response> {
        Some(match request {
            Request::Skill(message) => {
                let request = wire::request(message);
                if let Err(invalid) = &request.goal {
                    effects.push(Effect::refused(Service::Skill, invalid));
                }
                Response::Skill(wire::skill_reply(self.executor.request(request, now)))
            }
            Request::SkillCancel(message) => {
                Response::SkillCancel(wire::cancel_reply(self.executor.cancel(SkillId(message.skill_id), now)))
            }
            Request::SkillTable(_) => {
                let skills = self.executor.table(now).map(wire::skill_event).collect();
                Response::SkillTable(v1::SkillTable { skills })
            }
            _ => return None,
        })
    }

    fn publish(&mut self, now: Now, effects: &mut Vec<Effect>) {
        // Before the skills that end by it.
        let other = self.executor.flown_by_other().unwrap_or_default();
        if self.told.as_ref().is_none_or(|(at, told)| *at + self.tell_period <= now.time || told != other) {
            self.told = Some((now.time, other.to_owned()));
            effects.push(Effect::publish(v1::SkillControl { flown_by_other: other.to_owned() }));
        }
        let outputs = self.executor.take_outputs(now);
        effects.extend(outputs.into_iter().flat_map(wire::messages).map(Effect::publish));
    }
}

impl Node for SkillManager {
    fn name(&self) -> &'static str {
        "skill-manager"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[
            Topic::VehicleCommandAck,
            Topic::VehicleStatus,
            Topic::VehicleLocalPosition,
            Topic::VehicleLandDetected,
            Topic::TaskReport,
        ]
    }

    fn serves(&self) -> &'static [Service] {
        &[Service::Skill, Service::SkillCancel, Service::SkillTable]
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        match event {
            Event::Message { message, .. } => {
                let topic = message.topic();
                if let Err(invalid) = self.receive(message, now) {
                    effects.push(Effect::refused(topic, invalid));
                }
            }
            Event::Request { token, request, .. } => {
                // Before anything that follows from it: the caller knows the skill's id when its first event comes.
                let response = self.respond(request, now, effects);
                effects.extend(response.map(|response| Effect::Reply { token, response }));
            }
            Event::Reply { .. } | Event::Peer { .. } => {}
        }
        self.publish(now, effects);
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.executor.time_passed(now);
        self.publish(now, effects);
    }

    fn deadline(&self) -> Option<Time> {
        let tell = self.told.as_ref().map_or(Time::ZERO, |(at, _)| *at + self.tell_period);
        self.executor.deadline().into_iter().chain([tell]).min()
    }
}

// The stories use this crate as others do, in the program of its unit tests: one program links faster than two.
#[cfg(test)]
extern crate self as skill_manager;
#[cfg(test)]
#[path = "../tests/stories/main.rs"]
mod stories;
