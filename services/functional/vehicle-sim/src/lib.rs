//! The stand-in for an autopilot and its vehicle: takes commands and setpoints, flies, and says
//! how it is, with the behaviour measured on PX4 and with faults on request.
//!
//! Nothing above the executive layer can tell it from a bridge to a real autopilot. It knows no
//! skills, missions or permissions.

use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Message, Request, Response, Service, Topic};
use kittiwake_proto::v1;
use node::{Effect, Event, Node};

use crate::commander::{Command, Refusal};
use crate::config::Config;
use crate::faults::Fault;
use crate::publisher::Publisher;
use crate::telemetry::Telemetry;
use crate::traffic::Traffic;
use crate::vehicle::Vehicle;

mod arming;
mod battery;
mod commander;
pub mod config;
mod controller;
mod estimator;
mod failsafe;
pub mod faults;
mod frame;
mod globe;
mod guidance;
mod inject;
mod land_detector;
mod liftoff;
mod multirotor;
mod noise;
mod offboard;
mod pilot;
mod publisher;
mod schedule;
mod telemetry;
mod traffic;
mod vehicle;
mod wind;

/// The simulated vehicle as a service.
#[derive(Debug)]
pub struct VehicleSim {
    vehicle: Vehicle,
    traffic: Traffic,
    telemetry: Telemetry,
    publisher: Publisher,
    /// So many of the next commands are rejected without being looked at: a fault.
    commands_to_reject: u32,
}

impl VehicleSim {
    /// A vehicle on the ground at the origin. With the same seed the same inputs at the same times
    /// give the same outputs.
    pub fn new(config: &Config, pace: Pace, seed: u64) -> VehicleSim {
        VehicleSim {
            vehicle: Vehicle::new(config.clone(), pace, seed),
            traffic: Traffic::default(),
            telemetry: Telemetry::new(config, seed),
            publisher: Publisher::new(&config.rates, pace),
            commands_to_reject: 0,
        }
    }

    fn command(&mut self, it: v1::VehicleCommand, now: Time, effects: &mut Vec<Effect>) {
        let id = it.id;
        let answer = if self.commands_to_reject > 0 {
            self.commands_to_reject -= 1;
            Err(Refusal::Injected)
        } else {
            Command::try_from(it).and_then(|command| self.vehicle.command(command, now))
        };
        let (result, reason) = match answer {
            Ok(()) => (v1::CommandResult::Accepted, String::new()),
            Err(refusal) => (v1::CommandResult::Rejected, refusal.to_string()),
        };
        self.publisher.acknowledge(v1::VehicleCommandAck { id, result: result as i32, reason }, effects);
    }

    fn fault(&mut self, it: v1::FaultRequest, now: Time) -> v1::FaultReply {
        let known = if it.name.is_empty() { faults::catalogue::to_wire() } else { Vec::new() };
        match Fault::parse(&it.name, &it.args) {
            Ok(fault) => v1::FaultReply { accepted: true, detail: inject::inject(self, fault, now), known },
            Err(bad) => v1::FaultReply { accepted: false, detail: bad.to_string(), known },
        }
    }
}

impl Node for VehicleSim {
    fn name(&self) -> &'static str {
        "vehicle-sim"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[Topic::VehicleCommand, Topic::OffboardControlMode, Topic::TrajectorySetpoint]
    }

    fn serves(&self) -> &'static [Service] {
        &[Service::Fault]
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        self.vehicle.advance(now.time);
        match event {
            Event::Message { message: Message::VehicleCommand(it), .. } => self.command(it, now.time, effects),
            Event::Message { message: Message::OffboardControlMode(it), .. } => {
                self.vehicle.offboard.proof_of_life(it, now.time);
            }
            Event::Message { message: Message::TrajectorySetpoint(it), .. } => {
                self.vehicle.offboard.setpoint(it, now.time);
            }
            Event::Request { token, request: Request::Fault(it), .. } => {
                let response = Response::Fault(self.fault(it, now.time));
                effects.push(Effect::Reply { token, response });
            }
            Event::Message { .. } | Event::Request { .. } | Event::Reply { .. } | Event::Peer { .. } => {}
        }
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.vehicle.advance(now.time);
        self.vehicle.review(now.time);
        let VehicleSim { vehicle, traffic, telemetry, publisher, .. } = self;
        publisher.publish(now, |topic| telemetry.messages(topic, vehicle, traffic, now.time), effects);
    }

    fn deadline(&self) -> Option<Time> {
        Some(self.publisher.deadline())
    }
}
