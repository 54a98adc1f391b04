//! Whether the fact that a rule is about holds.
//!
//! A sample holds until another contradicts it: a value that was bad before its source went quiet
//! stays bad, and that the source is quiet is a fact of its own.

use std::time::Duration;

use domain::contingency::Rule;
use domain::contingency::rule::{DataSource, During};
use domain::time::{Pace, Time};

use crate::config::Config;
use crate::derived::{reported, value};
use crate::patience::patience;
use crate::sources::Sources;

/// What a look at a fact finds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finding {
    /// It holds.
    Holds,
    /// It does not hold, but is not gone either: between threshold and `clear`, or nothing is known.
    Unsettled,
    /// It does not hold.
    Gone,
}

/// A rule, with its limits as they are at this pace.
#[derive(Debug, Clone)]
pub struct Fact {
    /// The rule.
    pub rule: Rule,
    /// How long it must hold before it counts.
    pub hold: Duration,
    /// A source is stale so long after it was last heard.
    pub stale_after: Duration,
    /// A source that was never heard is stale so long after the first of the others was heard.
    pub absent_after: Duration,
}

impl Fact {
    /// The fact of `rule`.
    pub fn new(rule: Rule, config: &Config, pace: Pace) -> Fact {
        let (hold, stale_after, absent_after) = match rule {
            Rule::Below { for_s, .. } | Rule::Above { for_s, .. } | Rule::Reported { for_s, .. } => {
                (Duration::from_secs_f64(for_s), Duration::ZERO, Duration::ZERO)
            }
            Rule::Stale { source, after_s, .. } => {
                let stale_after = patience(pace, source, after_s);
                (Duration::ZERO, stale_after, patience(pace, source, config.absent_after_s).max(stale_after))
            }
        };
        Fact { rule, hold, stale_after, absent_after }
    }

    /// Whether it holds now.
    pub fn look(&self, sources: &Sources, now: Time) -> Finding {
        if !self.counts(sources) {
            return Finding::Gone;
        }
        match self.rule {
            Rule::Below { value: quantity, threshold, clear, .. } => match value(quantity, sources) {
                Some(it) if it < threshold => Finding::Holds,
                Some(it) if clear <= it => Finding::Gone,
                _ => Finding::Unsettled,
            },
            Rule::Above { value: quantity, threshold, clear, .. } => match value(quantity, sources) {
                Some(it) if threshold < it => Finding::Holds,
                Some(it) if it <= clear => Finding::Gone,
                _ => Finding::Unsettled,
            },
            Rule::Reported { condition, .. } => match reported(condition, sources) {
                Some(true) => Finding::Holds,
                Some(false) => Finding::Gone,
                None => Finding::Unsettled,
            },
            Rule::Stale { .. } => match self.stale_at(sources) {
                Some(at) if at <= now => Finding::Holds,
                _ => Finding::Gone,
            },
        }
    }

    /// Whether the vehicle is in the situation that the rule is about.
    pub fn counts(&self, sources: &Sources) -> bool {
        match self.during() {
            During::Always => true,
            During::Armed => sources.armed(),
            During::Flying => sources.flying(),
        }
    }

    /// The situation that the rule is about.
    pub fn during(&self) -> During {
        match self.rule {
            Rule::Below { during, .. }
            | Rule::Above { during, .. }
            | Rule::Reported { during, .. }
            | Rule::Stale { during, .. } => during,
        }
    }

    /// When the rule's source becomes stale if nothing new arrives; `None` if the rule has no
    /// source, or no source at all has been heard.
    pub fn stale_at(&self, sources: &Sources) -> Option<Time> {
        let Rule::Stale { source, .. } = self.rule else { return None };
        match sources.heard(source) {
            Some(heard) => Some(heard.at + self.stale_after),
            // One that was never there cannot be lost.
            None if source == DataSource::GroundLink => None,
            None => sources.first_heard.map(|it| it + self.absent_after),
        }
    }
}
