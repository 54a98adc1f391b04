//! A flag, and the two that may raise it: its rule, and the injector.
//!
//! It is up while either of them says so. The two are independent: what the injector clears stays
//! up while the rule says so, and the other way round.

use std::time::Duration;

use domain::contingency::{Row, Rule};
use domain::time::{Pace, Time};

use crate::config::Config;
use crate::evidence::Evidence;
use crate::fact::Fact;
use crate::rule_watch::{Change, Occasion, RuleWatch};
use crate::sources::Sources;

/// One flag of the contingency table.
#[derive(Debug, Clone)]
pub(crate) struct Flag {
    name: String,
    watch: Option<RuleWatch>,
    injected: Option<Injected>,
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
}

impl Flag {
    /// The flag of a row; it is down.
    pub(crate) fn new(row: &Row, config: &Config, pace: Pace) -> Flag {
        let watch = |rule: Rule| RuleWatch::new(Fact::new(rule, config, pace));
        Flag { name: row.flag.clone(), watch: row.raise.map(watch), injected: None }
    }

    /// Its name in the table.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Evaluates its rule; returns the change, if that raised or cleared the flag.
    pub(crate) fn evaluate(&mut self, now: Time, occasion: Occasion, sources: &Sources) -> Option<FlagChange> {
        let change = self.watch.as_mut()?.evaluate(now, occasion, sources)?;
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
        let injected = self.injected.as_ref().map(|it| (it.since, it.reason.as_str()));
        let watched = self.watch.as_ref().and_then(RuleWatch::raised);
        let (since, reason) = watched.into_iter().chain(injected).min_by_key(|(since, _)| *since)?;
        Some(RaisedFlag { name: &self.name, up_for: now - since, reason })
    }

    /// When to evaluate it again even if nothing arrives.
    pub(crate) fn deadline(&self, sources: &Sources) -> Option<Time> {
        self.watch.as_ref()?.deadline(sources)
    }
}
