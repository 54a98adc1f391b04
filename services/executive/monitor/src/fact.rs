//! Whether the fact of a rule holds.
//!
//! A sample counts until the next one arrives: a value that was bad before its source became silent
//! stays bad, and the silence is a fact of its own.

use std::time::Duration;

use domain::contingency::Rule;
use domain::contingency::rule::{DataSource, During};
use domain::time::{Pace, Time};

use crate::config::Config;
use crate::derived::{reported, value};
use crate::sources::Sources;
use crate::staleness::staleness_limit;

/// How a fact stands at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Finding {
    /// It holds.
    Holds,
    /// Neither: between the threshold and `clear`, or nothing is known.
    Unsettled,
    /// It does not hold.
    Gone,
}

/// A rule, with its limits in mission time at this pace.
#[derive(Debug, Clone)]
pub(crate) struct Fact {
    /// The rule.
    pub(crate) rule: Rule,
    /// How long the fact must hold before its flag is raised.
    pub(crate) hold: Duration,
    /// From the last sample of the source until it is stale.
    pub(crate) stale_after: Duration,
    /// From the first sample of any source until this one, never heard, is stale.
    pub(crate) absent_after: Duration,
}

impl Fact {
    /// The fact of `rule`.
    pub(crate) fn new(rule: Rule, config: &Config, pace: Pace) -> Fact {
        let (hold, stale_after, absent_after) = match rule {
            Rule::Below { for_s, .. } | Rule::Above { for_s, .. } | Rule::Reported { for_s, .. } => {
                (Duration::from_secs_f64(for_s), Duration::ZERO, Duration::ZERO)
            }
            Rule::Stale { source, after_s, .. } => {
                let stale_after = staleness_limit(pace, source, after_s);
                let absent_after = staleness_limit(pace, source, config.absent_after_s);
                (Duration::ZERO, stale_after, absent_after.max(stale_after))
            }
        };
        Fact { rule, hold, stale_after, absent_after }
    }

    /// How it stands now.
    pub(crate) fn finding(&self, sources: &Sources, now: Time) -> Finding {
        if !self.applies(sources) {
            return Finding::Gone;
        }
        match self.rule {
            Rule::Below { value: quantity, threshold, clear, .. } => match value(quantity, sources) {
                Some(value) if value < threshold => Finding::Holds,
                Some(value) if clear <= value => Finding::Gone,
                _ => Finding::Unsettled,
            },
            Rule::Above { value: quantity, threshold, clear, .. } => match value(quantity, sources) {
                Some(value) if threshold < value => Finding::Holds,
                Some(value) if value <= clear => Finding::Gone,
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
    pub(crate) fn applies(&self, sources: &Sources) -> bool {
        match self.during() {
            During::Always => true,
            During::Armed => sources.armed(),
            During::Flying => sources.flying() == Some(true),
        }
    }

    /// The situation that the rule is about.
    pub(crate) fn during(&self) -> During {
        match self.rule {
            Rule::Below { during, .. }
            | Rule::Above { during, .. }
            | Rule::Reported { during, .. }
            | Rule::Stale { during, .. } => during,
        }
    }

    /// When the rule's source becomes stale if nothing new arrives; `None` if the rule has no
    /// source, or no source at all was heard, or this one was never heard and there need not be one.
    pub(crate) fn stale_at(&self, sources: &Sources) -> Option<Time> {
        let Rule::Stale { source, .. } = self.rule else { return None };
        let silent_for = |since: Time, limit: Duration| since + limit + sources.away_since(since);
        match sources.last_update(source) {
            Some(update) => Some(silent_for(update.at, self.stale_after)),
            // A link that never existed cannot be lost, and neither can a tower. One that was lost before this monitor was started is still lost.
            None if is_optional(source) && !sources.was_ever_heard(source) => None,
            None => sources.first_heard().map(|at| silent_for(at, self.absent_after)),
        }
    }
}

/// Whether a vehicle may fly without this source from the beginning.
fn is_optional(source: DataSource) -> bool {
    matches!(source, DataSource::GroundLink | DataSource::ControlTower)
}
