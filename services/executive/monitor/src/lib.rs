//! Watches the vehicle: publishes all that is known about it, and raises flags.
//!
//! The introspection, 100 times a second of wall time, holds the newest sample of each source with
//! its age, what follows from them, and the flags that are up. Which fact raises which flag is the
//! contingency table's business; a flag that rises or falls goes out as an event of its own while
//! the sample that did it is handled, so that it does not vanish between two introspections.
//!
//! Three ways of being quiet are told apart:
//! - *silent*: nothing arrives, or nothing that makes sense. The source ages, its last value stays.
//! - *frozen*: the very same arrives again and again while the vehicle is armed. It ages as if silent.
//! - *absent*: never heard, so it has no value and no age. Nobody is late before anybody has spoken:
//!   it counts as stale only once others have been heard for a while.
//!
//! An event speaks for its own source: `monitor` for the rules, `injector` for flags raised by hand.
//! A flag is up while the last event of either says so, and in the introspection just as long. Only
//! flags that have a row in the table are listed; there is no response to any other.
//!
//! The monitor does not respond to anything and does not know who does: that is the mission manager.

use domain::contingency::Contingencies;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Message, Topic};
use node::{Effect, Event, Node};

use crate::aggregate::introspection;
use crate::config::Config;
use crate::flag::Flag;
use crate::schedule::Schedule;
use crate::sources::Sources;
use crate::watch::Occasion;

mod aggregate;
pub mod config;
mod derived;
mod fact;
mod flag;
mod patience;
mod schedule;
mod sources;
mod telemetry;
mod watch;
mod words;

/// The monitor of one vehicle.
pub struct Monitor {
    sources: Sources,
    /// In the order of the table, most urgent first.
    flags: Vec<Flag>,
    schedule: Schedule,
}

impl Monitor {
    /// A monitor that has heard nothing yet.
    pub fn new(config: &Config, contingencies: &Contingencies, pace: Pace) -> Monitor {
        Monitor {
            sources: Sources::new(config, pace),
            flags: contingencies.rows().iter().map(|row| Flag::new(row, config, pace)).collect(),
            schedule: Schedule::every(pace.wall(config.introspection_rate_hz.period())),
        }
    }

    fn look(&mut self, now: Time, occasion: Occasion, effects: &mut Vec<Effect>) {
        let events = self.flags.iter_mut().filter_map(|it| it.look(now, occasion, &self.sources));
        effects.extend(events.map(Effect::publish));
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
            Topic::GroundContact,
            Topic::FlagEvent,
        ]
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        let Event::Message { message, .. } = event else { return };
        match message {
            Message::FlagEvent(it) => self.flags.iter_mut().for_each(|flag| flag.inject(now.time, &it)),
            sample => {
                self.sources.take(now.time, sample);
                self.look(now.time, Occasion::Sample, effects);
            }
        }
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.look(now.time, Occasion::Clock, effects);
        if self.schedule.is_due(now.time) {
            effects.push(Effect::publish(introspection(now.time, &self.sources, &self.flags)));
        }
    }

    fn deadline(&self) -> Option<Time> {
        let rules = self.flags.iter().filter_map(|it| it.deadline(&self.sources));
        rules.chain([self.schedule.next()]).min()
    }
}
