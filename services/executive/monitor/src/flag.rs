//! A flag, and the two that may raise it: its rule, and the injector.
//!
//! It is up while either of them says so. The two are independent: what the injector clears stays
//! up while the rule says so, and the other way round.

use std::time::Duration;

use domain::contingency::Row;
use domain::contingency::snapshot::{Fields, Snapshot};
use domain::measured::Measured;
use domain::time::{Pace, Time};

use crate::config::Config;
use crate::evidence::Evidence;
use crate::fact::Fact;
use crate::rule_watch::{Change, Occasion, RuleWatch};
use crate::sources::Sources;
use crate::when_watch::WhenWatch;

/// One flag of the contingency table.
#[derive(Debug, Clone)]
pub(crate) struct Flag {
    name: String,
    watch: Option<Watch>,
    injected: Option<Injected>,
}

/// By what its row raises it.
#[derive(Debug, Clone)]
enum Watch {
    Rule(RuleWatch),
    When(WhenWatch),
}

/// Raised by the injector, and not cleared since.
#[derive(Debug, Clone)]
struct Injected {
    since: Time,
    reason: String,
}

/// The rule of a flag raised or cleared it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FlagChange {
    pub(crate) name: String,
    pub(crate) raised: bool,
    pub(crate) evidence: Evidence,
}

/// The injector raises or clears a flag.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Injection {
    pub(crate) flag: String,
    pub(crate) raised: bool,
    /// May be empty.
    pub(crate) reason: String,
}

/// A flag that is up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RaisedFlag<'a> {
    pub(crate) name: &'a str,
    pub(crate) up_for: Duration,
    pub(crate) reason: &'a str,
    /// The value that it was raised by, unless that was done by hand.
    pub(crate) measured: Option<Measured>,
}

impl Flag {
    /// The flag of a row; it is down.
    pub(crate) fn new(row: &Row, config: &Config, pace: Pace) -> Flag {
        let absent_after = pace.limit(config.absent_after_s.seconds());
        let watch = match (row.raise, &row.when) {
            (Some(rule), _) => Some(Watch::Rule(RuleWatch::new(Fact::new(rule, config, pace)))),
            (None, Some(when)) => Some(Watch::When(WhenWatch::new(when.clone(), absent_after))),
            (None, None) => None,
        };
        Flag { name: row.flag.clone(), watch, injected: None }
    }

    /// Its name in the table.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Whether its rule is about a source that brings nothing new.
    pub(crate) fn is_about_silence(&self) -> bool {
        matches!(&self.watch, Some(Watch::Rule(watch)) if watch.is_about_silence())
    }

    /// Evaluates its rule; returns the change, if that raised or cleared the flag. `changed` is what differs between this snapshot and
    /// the one of the time before.
    pub(crate) fn evaluate(
        &mut self,
        now: Time,
        occasion: Occasion,
        sources: &Sources,
        snapshot: &Snapshot,
        changed: Fields,
    ) -> Option<FlagChange> {
        let change = match self.watch.as_mut()? {
            Watch::Rule(watch) => watch.evaluate(now, occasion, sources),
            Watch::When(watch) => watch.evaluate(now, sources, snapshot, changed),
        }?;
        let (raised, evidence) = match change {
            Change::Raised(evidence) => (true, evidence),
            Change::Cleared(evidence) => (false, evidence),
        };
        Some(FlagChange { name: self.name.clone(), raised, evidence })
    }

    /// Raises or clears it for the injector.
    pub(crate) fn inject(&mut self, now: Time, injection: Injection) {
        if !injection.raised {
            self.injected = None;
        } else if self.injected.is_none() {
            let reason = if injection.reason.is_empty() { "raised by hand".into() } else { injection.reason };
            self.injected = Some(Injected { since: now, reason });
        }
    }

    /// The flag if it is up. Where both raised it, the older reason counts.
    pub(crate) fn raised(&self, now: Time) -> Option<RaisedFlag<'_>> {
        let injected = self.injected.as_ref().map(|it| (it.since, it.reason.as_str(), None));
        let watched = self.watch.as_ref().and_then(|watch| match watch {
            Watch::Rule(watch) => watch.raised(),
            Watch::When(watch) => watch.raised(),
        });
        let watched = watched.map(|(since, evidence)| (since, evidence.reason.as_str(), evidence.measured()));
        let (since, reason, measured) = watched.into_iter().chain(injected).min_by_key(|(since, ..)| *since)?;
        Some(RaisedFlag { name: &self.name, up_for: now - since, reason, measured })
    }

    /// When to evaluate it again even if nothing arrives.
    pub(crate) fn deadline(&self, sources: &Sources) -> Option<Time> {
        match self.watch.as_ref()? {
            Watch::Rule(watch) => watch.deadline(sources),
            Watch::When(watch) => watch.deadline(),
        }
    }
}
