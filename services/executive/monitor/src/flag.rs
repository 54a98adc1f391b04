//! A flag, and the two that may raise it: its expression, and somebody by hand.
//!
//! It is up while either of them says so. The two are independent: what is cleared by hand stays
//! up while the expression says so, and the other way round.

use std::time::Duration;

use domain::contingency::Row;
use domain::contingency::snapshot::{Fields, Snapshot};
use domain::measured::Measured;
use domain::time::{Pace, Time};

use crate::sources::{Sources, Unheard};
use crate::watch::Watch;

/// One flag of the contingency table.
#[derive(Debug, Clone)]
pub(crate) struct Flag {
    name: String,
    watch: Option<Watch>,
    injected: Option<Injected>,
    /// The number of its last rise.
    rise: u64,
    /// Somebody has raised or cleared it by hand.
    was_injected: bool,
}

/// Raised by hand, and not cleared since.
#[derive(Debug, Clone)]
struct Injected {
    since: Time,
    reason: String,
}

/// Somebody raises or clears a flag by hand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Injection {
    pub(crate) flag: String,
    pub(crate) raised: bool,
    /// May be empty.
    pub(crate) reason: String,
}

/// How a flag stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Level<'a> {
    Up(RaisedFlag<'a>),
    Down,
    /// The monitor was started not long ago, and cannot say yet.
    Undecided(&'a str),
}

/// A flag that is up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RaisedFlag<'a> {
    pub(crate) name: &'a str,
    pub(crate) up_for: Duration,
    pub(crate) reason: &'a str,
    /// The value that it was raised by, unless that was done by hand.
    pub(crate) measured: Option<Measured>,
    /// Another number is another rise.
    pub(crate) rise: u64,
}

impl Flag {
    /// The flag of a row; it is down.
    pub(crate) fn new(row: &Row, pace: Pace) -> Flag {
        let watch = row.when.clone().map(|when| Watch::new(when, pace));
        Flag { name: row.flag.clone(), watch, injected: None, rise: 0, was_injected: false }
    }

    /// Its name in the table.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Evaluates its expression; `changed` is what may differ from the time before, and `rises` counts. Returns whether that has raised or
    /// cleared the flag.
    pub(crate) fn evaluate(
        &mut self,
        now: Time,
        sources: &Sources,
        snapshot: &Snapshot,
        changed: Fields,
        unheard: Unheard,
        rises: &mut u64,
    ) -> bool {
        let Some(watch) = &mut self.watch else { return false };
        let has_changed = watch.evaluate(now, sources, snapshot, changed, unheard);
        if has_changed && watch.raised().is_some() {
            *rises += 1;
            self.rise = *rises;
        }
        has_changed
    }

    /// Raises or clears it by hand.
    pub(crate) fn inject(&mut self, now: Time, injection: Injection, rises: &mut u64) {
        self.was_injected = true;
        if !injection.raised {
            self.injected = None;
            return;
        }
        *rises += 1;
        self.rise = *rises;
        let reason = if injection.reason.is_empty() { "raised by hand".into() } else { injection.reason };
        self.injected.get_or_insert(Injected { since: now, reason });
    }

    /// How it stands. Where both raised it, the older reason counts.
    pub(crate) fn level(&self, now: Time) -> Level<'_> {
        let injected = self.injected.as_ref().map(|it| (it.since, it.reason.as_str(), None));
        let watched = self.watch.as_ref().and_then(Watch::raised);
        let watched = watched.map(|(since, evidence)| (since, evidence.reason.as_str(), evidence.measured));
        match watched.into_iter().chain(injected).min_by_key(|(since, ..)| *since) {
            Some((since, reason, measured)) => {
                Level::Up(RaisedFlag { name: &self.name, up_for: now - since, reason, measured, rise: self.rise })
            }
            None if self.was_injected || self.watch.as_ref().is_none_or(Watch::is_decided) => Level::Down,
            None => Level::Undecided(&self.name),
        }
    }

    /// When to evaluate it again after `now` even if nothing arrives.
    pub(crate) fn deadline(&self, now: Time, sources: &Sources) -> Option<Time> {
        self.watch.as_ref()?.deadline(now, sources)
    }
}
