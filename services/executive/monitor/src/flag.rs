//! A flag and those who may say that it is up: its rule, and the injector's hand.
//!
//! It is up while either says so. The two do not know of each other: lowering by hand what was
//! raised by hand leaves alone what the rule says, and the other way round.

use domain::contingency::{Row, Rule};
use domain::time::{Pace, Time};
use kittiwake_proto::v1;

use crate::config::Config;
use crate::fact::Fact;
use crate::sources::Sources;
use crate::watch::{Change, Occasion, Watch};

/// What the monitor calls itself in the events it sends.
const MONITOR: &str = "monitor";
/// What the injector calls itself.
const INJECTOR: &str = "injector";

/// One flag of the contingency table.
#[derive(Debug, Clone)]
pub struct Flag {
    name: String,
    watch: Option<Watch>,
    injected: Option<Injected>,
}

/// Raised by hand, and not lowered since.
#[derive(Debug, Clone)]
struct Injected {
    since: Time,
    reason: String,
}

impl Flag {
    /// The flag of a row, down.
    pub fn new(row: &Row, config: &Config, pace: Pace) -> Flag {
        let watch = |rule: Rule| Watch::new(Fact::new(rule, config, pace));
        Flag { name: row.flag.clone(), watch: row.raise.map(watch), injected: None }
    }

    /// Looks at its rule; an event if that made the flag rise or fall.
    pub fn look(&mut self, now: Time, occasion: Occasion, sources: &Sources) -> Option<v1::FlagEvent> {
        let change = self.watch.as_mut()?.look(now, occasion, sources)?;
        let (raised, evidence) = match change {
            Change::Rose(evidence) => (true, evidence),
            Change::Fell(evidence) => (false, evidence),
        };
        Some(v1::FlagEvent {
            name: self.name.clone(),
            raised,
            source: MONITOR.into(),
            reason: evidence.reason,
            value: evidence.value,
            threshold: evidence.threshold,
        })
    }

    /// Takes in an event; one that is not the injector's or about another flag changes nothing.
    pub fn inject(&mut self, now: Time, event: &v1::FlagEvent) {
        if event.source != INJECTOR || event.name != self.name {
            return;
        }
        if !event.raised {
            self.injected = None;
        } else if self.injected.is_none() {
            let reason = if event.reason.is_empty() { "raised by hand" } else { &event.reason };
            self.injected = Some(Injected { since: now, reason: reason.into() });
        }
    }

    /// The flag for the introspection if it is up, with the reason that is older.
    pub fn raised(&self, now: Time) -> Option<v1::RaisedFlag> {
        let injected = self.injected.as_ref().map(|it| (it.since, it.reason.as_str()));
        let seen = self.watch.as_ref().and_then(Watch::up);
        let (since, reason) = seen.into_iter().chain(injected).min_by_key(|(since, _)| *since)?;
        let since_s = (now - since).as_secs_f64();
        Some(v1::RaisedFlag { name: self.name.clone(), since_s, reason: reason.into() })
    }

    /// When to look again even if nothing arrives.
    pub fn deadline(&self, sources: &Sources) -> Option<Time> {
        self.watch.as_ref()?.deadline(sources)
    }
}
