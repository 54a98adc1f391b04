//! Between a PX4 and the `fmu/` topics, straight over PX4's own Zenoh module: no ROS, no agent.
//!
//! On one side PX4's keys and their CDR, on the other the vocabulary of [`domain::fmu`]. Nothing above it can tell it from the
//! simulator. It decides nothing about the flight: commands and setpoints go through as they come, telemetry as it arrives, and what
//! PX4 does not say is not made up. It repeats no setpoint, since PX4 resumes offboard by itself when setpoints return.
//!
//! What carries the keys is a [`port::Port`]: this crate knows no Zenoh.

use domain::declared_skill::DeclaredSkills;
use domain::fmu::{OffboardControl, Setpoint, VehicleCommand};
use domain::time::{Now, Time};
use domain::wire::InvalidMessage;
use kittiwake_proto::topics::{Message, Topic};
use node::{Effect, Event, Node};

mod bridge;
mod carrot;
pub mod cdr;
mod commands;
pub mod config;
mod frame;
mod health;
pub mod keys;
pub mod modes;
pub mod params;
pub mod port;
mod telemetry;
mod watch;

use bridge::{Bridge, Out};
use cdr::Definitions;
use config::Config;
use port::Port;

/// The bridge as a service.
#[derive(Debug)]
pub struct Px4Bridge<P> {
    bridge: Bridge,
    port: P,
}

impl<P: Port> Px4Bridge<P> {
    /// A bridge that has heard nothing yet, over `port`.
    pub fn new(config: &Config, port: P) -> Px4Bridge<P> {
        Px4Bridge { bridge: Bridge::new(config, Definitions::known()), port }
    }

    /// The same, with declared skills: PX4 carries out those that have a command.
    #[must_use]
    pub fn with_skills(mut self, skills: &DeclaredSkills) -> Px4Bridge<P> {
        self.bridge.carries_out(skills);
        self
    }

    fn receive(&mut self, message: Message, now: Time, out: &mut Out) -> Result<(), InvalidMessage> {
        match message {
            Message::VehicleCommand(it) => self.bridge.commanded(VehicleCommand::try_from(it)?, now, out),
            Message::OffboardControlMode(it) => self.bridge.control(OffboardControl::try_from(it)?, out),
            Message::TrajectorySetpoint(it) => self.bridge.setpoint(Setpoint::try_from(it)?, now, out),
            Message::TaskOrder(it) => self.bridge.task(it, now, out),
            _ => {}
        }
        Ok(())
    }

    fn perform(&mut self, out: Out, now: Time, effects: &mut Vec<Effect>) {
        for (key, payload) in out.samples {
            self.port.put(now, &key, payload);
        }
        effects.extend(out.effects);
    }
}

impl<P: Port> Node for Px4Bridge<P> {
    fn name(&self) -> &'static str {
        "px4-bridge"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[Topic::VehicleCommand, Topic::OffboardControlMode, Topic::TrajectorySetpoint, Topic::TaskOrder]
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        if let Event::Message { message, .. } = event {
            let mut out = Out::default();
            let topic = message.topic();
            if let Err(invalid) = self.receive(message, now.time, &mut out) {
                effects.push(Effect::refused(topic, invalid));
            }
            self.perform(out, now.time, effects);
        }
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        let mut out = Out::default();
        for arrival in self.port.take(now.time) {
            self.bridge.arrived(&arrival, now, &mut out);
        }
        self.bridge.tend(now.time, &mut out);
        self.perform(out, now.time, effects);
    }

    fn deadline(&self) -> Option<Time> {
        [self.port.deadline(), self.bridge.deadline()].into_iter().flatten().min()
    }
}

// The stories use this crate as others do, in the program of its unit tests: one program links faster than two.
#[cfg(test)]
extern crate self as px4_bridge;
#[cfg(test)]
#[path = "../tests/it/main.rs"]
mod stories;
