//! The simulated autopilot with its vehicle: takes commands and setpoints, flies, and sends
//! telemetry, with the behaviour that was measured on PX4 and with faults on request.
//!
//! Nothing above the executive layer can tell it from a bridge to a real autopilot. It knows no
//! skills, missions or permissions.

use domain::fmu::{CommandAck, CommandId, CommandResult, VehicleCommand};
use domain::time::{Now, Pace, Time};
use domain::wire::InvalidMessage;
use kittiwake_proto::topics::{Message, Request, Response, Service, Topic};
use kittiwake_proto::v1;
use node::{Effect, Event, Node};

mod arming;
mod battery;
mod boot;
mod commander;
pub mod config;
mod controller;
mod estimator;
mod failsafe;
pub mod faults;
mod frame;
mod globe;
mod gripper;
pub mod ground;
mod guidance;
mod inject;
mod land_detector;
mod liftoff;
mod multirotor;
mod noise;
mod offboard;
mod others;
mod pilot;
mod publisher;
mod schedule;
mod telemetry;
mod traffic;
pub mod truth;
mod vehicle;
mod wind;

use commander::Refusal;
use config::Config;
use faults::Fault;
use faults::catalogue::{CatalogueEntry, catalogue};
use ground::Ground;
use publisher::Publisher;
use telemetry::Telemetry;
use traffic::Traffic;
use vehicle::Vehicle;

/// The simulated vehicle as a service.
#[derive(Debug)]
pub struct VehicleSim {
    vehicle: Vehicle,
    traffic: Traffic,
    telemetry: Telemetry,
    publisher: Publisher,
    /// How many of the next commands are rejected without being looked at: a fault.
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

    /// The same over this ground.
    pub fn over(mut self, ground: Ground) -> VehicleSim {
        self.vehicle.body.ground = ground;
        self
    }

    /// An invalid message changes nothing, except that an invalid command is acknowledged.
    fn receive(&mut self, message: Message, now: Time, effects: &mut Vec<Effect>) -> Result<(), InvalidMessage> {
        if self.vehicle.boot.is_silent(now) {
            return Ok(());
        }
        match message {
            Message::VehicleCommand(it) => return self.receive_command(it, now, effects),
            Message::OffboardControlMode(it) => self.vehicle.offboard.proof_of_life(it.try_into()?, now),
            Message::TrajectorySetpoint(it) => {
                let setpoint = self.vehicle.boot.setpoint(it.try_into()?);
                self.vehicle.offboard.setpoint(setpoint, now);
            }
            _ => {}
        }
        Ok(())
    }

    fn receive_command(
        &mut self,
        message: v1::VehicleCommand,
        now: Time,
        effects: &mut Vec<Effect>,
    ) -> Result<(), InvalidMessage> {
        let id = CommandId(message.id);
        let command = VehicleCommand::try_from(message);
        let answer = match &command {
            _ if self.commands_to_reject > 0 => {
                self.commands_to_reject -= 1;
                Err(Refusal::Injected)
            }
            Ok(it) => self.vehicle.command(it.command, now),
            Err(invalid) => Err(Refusal::Invalid(invalid.clone())),
        };
        let result = match answer {
            Ok(()) => CommandResult::Accepted,
            Err(refusal) => CommandResult::Rejected { reason: refusal.to_string() },
        };
        self.publisher.acknowledge(CommandAck { id, result }, effects);
        command.map(|_| ())
    }

    /// Injects a fault. A request without a name asks for the catalogue.
    fn receive_fault(&mut self, request: &v1::FaultRequest, now: Time, effects: &mut Vec<Effect>) -> v1::FaultReply {
        match Fault::parse(&request.name, &request.args) {
            Ok(fault) => v1::FaultReply { accepted: true, detail: inject::inject(self, fault, now), known: Vec::new() },
            Err(invalid) if request.name.is_empty() => {
                v1::FaultReply { accepted: false, detail: invalid.to_string(), known: known_faults() }
            }
            Err(invalid) => {
                effects.push(Effect::refused(Service::Fault, &invalid));
                v1::FaultReply { accepted: false, detail: invalid.to_string(), known: Vec::new() }
            }
        }
    }
}

fn known_faults() -> Vec<v1::FaultKind> {
    let kind = |it: &CatalogueEntry| v1::FaultKind {
        name: it.name.to_owned(),
        arguments: it.arguments.to_owned(),
        effect: it.effect.to_owned(),
    };
    catalogue().iter().map(kind).collect()
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
            Event::Message { message, .. } => {
                let topic = message.topic();
                if let Err(invalid) = self.receive(message, now.time, effects) {
                    effects.push(Effect::refused(topic, invalid));
                }
            }
            Event::Request { token, request: Request::Fault(request), .. } => {
                let response = Response::Fault(self.receive_fault(&request, now.time, effects));
                effects.push(Effect::Reply { token, response });
            }
            Event::Request { .. } | Event::Reply { .. } | Event::Peer { .. } => {}
        }
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.vehicle.advance(now.time);
        self.vehicle.review(now.time);
        let VehicleSim { vehicle, traffic, telemetry, publisher, .. } = self;
        publisher.silence(vehicle.boot.is_silent(now.time));
        publisher.publish(now, |topic| telemetry.messages(topic, vehicle, traffic, now.time), effects);
    }

    fn deadline(&self) -> Option<Time> {
        Some(self.publisher.deadline())
    }
}

// The stories use this crate as others do, in the program of its unit tests: one program links faster than two.
#[cfg(test)]
extern crate self as vehicle_sim;
#[cfg(test)]
#[path = "../tests/stories/main.rs"]
mod stories;
