//! Watches the vehicle: publishes everything that is known about it, and raises flags.
//!
//! The introspection, 100 times a second of wall time, holds the newest sample of each source with
//! its age, the values derived from the samples, and the flags that are up. Which fact or expression raises which
//! flag is the contingency table's business; expressions read a snapshot of fields
//! ([`domain::contingency::snapshot`]). Rules read together what arrives at one moment, and no sample is replaced by another before
//! they have read it. A flag that is raised or cleared goes out at once, as an event of its own, so that it does not vanish between
//! two introspections.
//!
//! A source that brings nothing new is one of three:
//! - *silent*: nothing arrives, or nothing valid. The source ages, its last value stays. What is
//!   invalid is refused.
//! - *frozen*: the same value arrives again and again while the vehicle is armed, or the same status with the same time of the
//!   autopilot's clock. It ages as if silent.
//! - *absent*: never heard, so it has no value and no age. It counts as stale once others have been
//!   heard for a while, and not before any was heard.
//!
//! The time in which the monitor itself did not run, as a process that was stopped, is no silence of anybody.
//!
//! It watches the heartbeats of the processes on board in the same way: one that hangs sends none, and is as silent as one
//! that is gone.
//!
//! An event speaks for its own source: `monitor` for the rules, `injector` for flags raised by hand.
//! A flag is up, in the introspection too, while the last event of either says so. Only flags that
//! have a row in the table are listed; there is no response to any other.
//!
//! The monitor does not respond to anything and does not know who does: that is the mission manager.

use domain::contingency::Contingencies;
use domain::contingency::snapshot::Snapshot;
use domain::time::{Now, Pace, Time};
use domain::wire::InvalidMessage;
use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1;
use node::{Effect, Event, Node};

pub mod config;

mod away;
mod clock;
mod derived;
mod evidence;
mod fact;
mod flag;
mod gusts;
mod jumps;
mod manager;
mod recent;
mod rule_watch;
mod schedule;
mod snapshot;
mod sources;
mod staleness;
mod touchdown;
mod traffic;
mod when_watch;
mod wire;

use config::Config;
use flag::Flag;
use rule_watch::Occasion;
use schedule::Schedule;
use sources::Sources;

/// The monitor of one vehicle.
pub struct Monitor {
    sources: Sources,
    /// In the order of the table, most urgent first.
    flags: Vec<Flag>,
    /// Of which samples have arrived that no rule has read yet.
    unread: Vec<Topic>,
    /// What the expressions read last, and when.
    snapshot: Snapshot,
    evaluated_at: Option<Time>,
    schedule: Schedule,
}

impl Monitor {
    /// A monitor that has heard nothing yet.
    pub fn new(config: &Config, contingencies: &Contingencies, pace: Pace) -> Monitor {
        Monitor {
            sources: Sources::new(config, pace),
            flags: contingencies.rows().iter().map(|row| Flag::new(row, config, pace)).collect(),
            unread: Vec::new(),
            snapshot: Snapshot::UNKNOWN,
            evaluated_at: None,
            schedule: Schedule::every(pace.wall(config.introspection_rate_hz.period())),
        }
    }

    fn take(&mut self, now: Time, message: Message, effects: &mut Vec<Effect>) -> Result<(), InvalidMessage> {
        let topic = message.topic();
        let Some(sample) = wire::sample(message)? else { return Ok(()) };
        if self.unread.contains(&topic) {
            self.evaluate(now, Occasion::Sample, effects);
        }
        self.sources.take(now, sample);
        self.unread.push(topic);
        Ok(())
    }

    fn inject(&mut self, now: Time, event: v1::FlagEvent) -> Result<(), InvalidMessage> {
        let Some(injection) = wire::injection(event) else { return Ok(()) };
        let flag = self.flags.iter_mut().find(|it| it.name() == injection.flag);
        flag.ok_or_else(|| wire::unknown_flag(&injection.flag))?.inject(now, injection);
        Ok(())
    }

    fn evaluate(&mut self, now: Time, occasion: Occasion, effects: &mut Vec<Effect>) {
        // What was read a moment ago is read again where nothing has arrived since: then nothing is new but that silence counts.
        let is_known = self.unread.is_empty() && self.evaluated_at == Some(now);
        self.unread.clear();
        let snapshot = if is_known { self.snapshot } else { snapshot::snapshot(&self.sources, now) };
        let changed = snapshot.differs_in(&self.snapshot);
        (self.snapshot, self.evaluated_at) = (snapshot, Some(now));
        let flags = self.flags.iter_mut().filter(|it| !is_known || it.is_about_silence());
        let changes = flags.filter_map(|it| it.evaluate(now, occasion, &self.sources, &snapshot, changed));
        effects.extend(changes.map(wire::flag_event).map(Effect::publish));
    }
}

impl Node for Monitor {
    fn name(&self) -> &'static str {
        "monitor"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[
            Topic::VehicleStatus,
            Topic::VehicleAttitude,
            Topic::VehicleLocalPosition,
            Topic::VehicleGlobalPosition,
            Topic::VehicleLandDetected,
            Topic::BatteryStatus,
            Topic::WindEstimate,
            Topic::TransponderReport,
            Topic::GroundContact,
            Topic::PermissionLedger,
            Topic::McmStatus,
            Topic::Heartbeat,
            Topic::FlagEvent,
        ]
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        let Event::Message { message, .. } = event else { return };
        self.sources.read_clock(now);
        let topic = message.topic();
        let result = match message {
            Message::FlagEvent(event) => self.inject(now.time, event),
            sample => self.take(now.time, sample, effects),
        };
        if let Err(invalid) = result {
            effects.push(Effect::refused(topic, invalid));
        }
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.sources.read_clock(now);
        self.evaluate(now.time, Occasion::Clock, effects);
        if self.schedule.is_due(now.time) {
            effects.push(Effect::publish(wire::introspection(now.time, &self.sources, &self.flags)));
        }
    }

    fn deadline(&self) -> Option<Time> {
        let rules = self.flags.iter().filter_map(|it| it.deadline(&self.sources));
        rules.chain([self.schedule.next()]).min()
    }
}

// The stories use this crate as others do, in the program of its unit tests: one program links faster than two.
#[cfg(test)]
extern crate self as monitor;
#[cfg(test)]
#[path = "../tests/monitor/main.rs"]
mod stories;
