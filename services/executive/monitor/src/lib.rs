//! Watches the vehicle: publishes everything that is known about it, and which flags are up.
//!
//! The introspection, 100 times a second of wall time, holds the newest sample of each source with
//! its age, the values derived from the samples, and the flags that are up. Which expression raises which
//! flag is the contingency table's business; expressions read a snapshot of fields
//! ([`domain::contingency::snapshot`]). Rules read together what arrives at one moment, and no sample is replaced by another before
//! they have read it. A flag that rises or falls has an introspection of its own, at once, and is up for long enough that nobody misses it.
//!
//! A source that brings nothing new is one of three:
//! - *silent*: nothing arrives, or nothing valid. The source ages, its last value stays. What is
//!   invalid is refused.
//! - *frozen*: the same value arrives again and again while the vehicle is armed, or the same status with the same time of the
//!   autopilot's clock. It ages as if silent.
//! - *absent*: never heard, so it has no value and no age. It counts as stale once others have been
//!   heard for a while, and not before any was heard.
//!
//! Time in which the monitor itself did not run, because it was stopped, does not count as silence of others.
//!
//! It watches the heartbeats of the processes on board in the same way: one that hangs sends none, and is as silent as one
//! that is gone.
//!
//! The list of flags is all that is said about them: who reads it needs no other message, and no earlier one. Flags that people and
//! measurements raise by hand come in as `monitor/flag`, and are up in the list like all others. Only flags that
//! have a row in the table are listed; there is no response to any other. A monitor that was just started does not know
//! yet how each flag stands, above all where a condition must last or a source has been silent since before; it lists these as undecided.
//!
//! The monitor does not respond to anything and does not know who does: that is the mission manager.

use domain::contingency::Contingencies;
use domain::contingency::snapshot::{Fields, Snapshot};
use domain::declared_skill::DeclaredSkills;
use domain::time::{Now, Pace, Time};
use domain::wire::InvalidMessage;
use kittiwake_proto::topics::{Message, Topic};
use node::{Effect, Event, Node};

pub mod config;

mod away;
mod clock;
mod derived;
mod flag;
mod gusts;
mod jumps;
mod manager;
mod recent;
mod schedule;
mod silence;
mod skills;
mod snapshot;
mod sources;
mod touchdown;
mod traffic;
mod watch;
mod wire;
mod words;

use config::Config;
use flag::{Flag, Injection};
use schedule::Schedule;
use skills::Skills;
use sources::{Sources, Unheard};

/// The monitor of one vehicle.
pub struct Monitor {
    sources: Sources,
    /// In the order of the table, most urgent first.
    flags: Vec<Flag>,
    /// Of which samples have arrived that no rule has read yet.
    unread: Vec<Topic>,
    /// What the expressions read last, which of those fields had heard too little yet, and when.
    snapshot: Snapshot,
    unheard: Unheard,
    evaluated_at: Option<Time>,
    /// A flag has risen or fallen since the last introspection; how often one has risen.
    flags_changed: bool,
    rises: u64,
    schedule: Schedule,
}

/// On which occasion the expressions are evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Occasion {
    /// A sample has arrived; others that arrived with it may still wait.
    Sample,
    /// Everything that has arrived was taken in.
    Clock,
}

impl Monitor {
    /// A monitor that has heard nothing yet.
    pub fn new(config: &Config, contingencies: &Contingencies, pace: Pace) -> Monitor {
        Monitor {
            sources: Sources::new(config, pace),
            flags: contingencies.rows().iter().map(|row| Flag::new(row, pace)).collect(),
            unread: Vec::new(),
            snapshot: Snapshot::UNKNOWN,
            unheard: Unheard { unknown: Fields::NONE, silences: Fields::NONE },
            evaluated_at: None,
            flags_changed: false,
            rises: 0,
            schedule: Schedule::every(pace.wall(config.introspection_rate_hz.period())),
        }
    }

    /// The same with declared skills: it tells who offers them, and whether their conditions hold.
    #[must_use]
    pub fn with_skills(mut self, skills: DeclaredSkills) -> Monitor {
        self.sources.skills = Skills::new(skills);
        self
    }

    fn take(&mut self, now: Time, message: Message) -> Result<(), InvalidMessage> {
        let topic = message.topic();
        let Some(sample) = wire::sample(message)? else { return Ok(()) };
        if self.unread.contains(&topic) {
            self.evaluate(now, Occasion::Sample);
        }
        self.sources.take(now, sample);
        self.unread.push(topic);
        Ok(())
    }

    fn inject(&mut self, now: Time, injection: Injection) -> Result<(), InvalidMessage> {
        let flag = self.flags.iter_mut().find(|it| it.name() == injection.flag);
        flag.ok_or_else(|| wire::unknown_flag(&injection.flag))?.inject(now, injection, &mut self.rises);
        self.flags_changed = true;
        Ok(())
    }

    fn evaluate(&mut self, now: Time, occasion: Occasion) {
        if self.unread.is_empty() && self.evaluated_at == Some(now) {
            return;
        }
        self.unread.clear();
        let mut snapshot = snapshot::snapshot(&self.sources, now);
        if occasion == Occasion::Sample {
            snapshot = snapshot::without_longer_silences(snapshot, &self.snapshot);
        }
        let unheard = self.sources.unheard(&snapshot, now);
        let of_unheard = |it: Unheard| it.unknown.and(it.silences);
        let changed = snapshot.differs_in(&self.snapshot).and(of_unheard(unheard)).and(of_unheard(self.unheard));
        (self.snapshot, self.unheard, self.evaluated_at) = (snapshot, unheard, Some(now));
        for flag in &mut self.flags {
            self.flags_changed |= flag.evaluate(now, &self.sources, &snapshot, changed, unheard, &mut self.rises);
        }
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
            Topic::TaskReport,
            Topic::FlagEvent,
        ]
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        let Event::Message { message, .. } = event else { return };
        self.sources.read_clock(now);
        let topic = message.topic();
        let result = match message {
            Message::FlagEvent(event) => self.inject(now.time, event.into()),
            sample => self.take(now.time, sample),
        };
        if let Err(invalid) = result {
            effects.push(Effect::refused(topic, invalid));
        }
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.sources.read_clock(now);
        self.evaluate(now.time, Occasion::Clock);
        let (is_due, flags_changed) = (self.schedule.is_due(now.time), std::mem::take(&mut self.flags_changed));
        if is_due || flags_changed {
            let mut introspection = wire::introspection(now.time, &self.sources, &self.flags, flags_changed);
            introspection.skills = self.sources.told_skills(&self.snapshot, now.time);
            effects.push(Effect::publish(introspection));
        }
    }

    fn deadline(&self) -> Option<Time> {
        let now = self.evaluated_at.unwrap_or_default();
        let flags = self.flags.iter().filter_map(|it| it.deadline(now, &self.sources));
        flags.chain([self.schedule.next()]).min()
    }
}

// The stories use this crate as others do, in the program of its unit tests: one program links faster than two.
#[cfg(test)]
extern crate self as monitor;
#[cfg(test)]
#[path = "../tests/monitor/main.rs"]
mod stories;
