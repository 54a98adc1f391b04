//! From a fact to a flag: the flag is raised once the fact has held for long enough, and cleared
//! once the fact no longer holds.

use std::time::Duration;

use domain::contingency::Rule;
use domain::time::Time;

use crate::evidence::{self, Evidence};
use crate::fact::{Fact, Finding};
use crate::sources::Sources;

/// How the flag of a rule stands, as far as the rule is concerned.
#[derive(Debug, Clone, PartialEq)]
enum FlagState {
    /// The fact does not hold.
    Down,
    /// The fact holds, not yet for long enough.
    Pending {
        /// Since when it holds.
        since: Time,
    },
    /// The flag is raised.
    Up {
        /// Since when.
        since: Time,
        /// Why.
        evidence: Evidence,
    },
}

impl FlagState {
    /// The state after a finding. `hold` is how long the fact must hold; `why` is called when the
    /// flag is raised.
    fn on(self, now: Time, finding: Finding, hold: Duration, why: impl FnOnce() -> Evidence) -> FlagState {
        use {Finding as F, FlagState as S};
        match (self, finding) {
            (S::Down, F::Holds) if hold.is_zero() => S::Up { since: now, evidence: why() },
            (S::Down, F::Holds) => S::Pending { since: now },
            (S::Down, F::Unsettled | F::Gone) => S::Down,
            (S::Pending { since }, F::Holds) if hold <= now - since => S::Up { since: now, evidence: why() },
            (S::Pending { since }, F::Holds) => S::Pending { since },
            (S::Pending { .. }, F::Unsettled | F::Gone) => S::Down,
            (S::Up { .. }, F::Gone) => S::Down,
            (up @ S::Up { .. }, F::Holds | F::Unsettled) => up,
        }
    }

    /// Whether a finding changes nothing of it, whatever the time.
    fn stays(&self, finding: Finding) -> bool {
        match self {
            FlagState::Down => finding != Finding::Holds,
            FlagState::Pending { .. } => false,
            FlagState::Up { .. } => finding != Finding::Gone,
        }
    }

    fn is_up(&self) -> bool {
        matches!(self, FlagState::Up { .. })
    }
}

/// On which occasion a rule is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Occasion {
    /// A sample has arrived; others that arrived with it may still wait.
    Sample,
    /// Everything that has arrived was taken in.
    Clock,
}

/// The flag was raised or cleared.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Change {
    Raised(Evidence),
    Cleared(Evidence),
}

/// A rule, and how its flag stands.
#[derive(Debug, Clone)]
pub(crate) struct RuleWatch {
    fact: Fact,
    state: FlagState,
}

impl RuleWatch {
    /// The flag is down.
    pub(crate) fn new(fact: Fact) -> RuleWatch {
        RuleWatch { fact, state: FlagState::Down }
    }

    /// Whether the rule is about a source that brings nothing new.
    pub(crate) fn is_about_silence(&self) -> bool {
        matches!(self.fact.rule, Rule::Stale { .. })
    }

    /// Evaluates the rule.
    pub(crate) fn evaluate(&mut self, now: Time, occasion: Occasion, sources: &Sources) -> Option<Change> {
        let finding = match (self.fact.finding(sources, now), occasion) {
            // After a pause of the whole process every source looks stale until its mailbox is empty.
            (Finding::Holds, Occasion::Sample) if self.is_about_silence() => Finding::Unsettled,
            (finding, _) => finding,
        };
        // Nearly always nothing happens, a thousand times a second.
        if self.state.stays(finding) {
            return None;
        }
        let was_up = self.state.is_up();
        let why = || evidence::for_raising(&self.fact, sources, now);
        self.state = std::mem::replace(&mut self.state, FlagState::Down).on(now, finding, self.fact.hold, why);
        match &self.state {
            FlagState::Up { evidence, .. } if !was_up => Some(Change::Raised(evidence.clone())),
            FlagState::Down if was_up => Some(Change::Cleared(evidence::for_clearing(&self.fact, sources))),
            _ => None,
        }
    }

    /// Since when its flag is up, and why.
    pub(crate) fn raised(&self) -> Option<(Time, &Evidence)> {
        match &self.state {
            FlagState::Up { since, evidence } => Some((*since, evidence)),
            FlagState::Down | FlagState::Pending { .. } => None,
        }
    }

    /// When to evaluate it again even if nothing arrives.
    pub(crate) fn deadline(&self, sources: &Sources) -> Option<Time> {
        match self.state {
            FlagState::Down if self.fact.applies(sources) => self.fact.stale_at(sources),
            FlagState::Pending { since } => Some(since + self.fact.hold),
            FlagState::Down | FlagState::Up { .. } => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    fn at(s: f64) -> Time {
        Time::after(Duration::from_secs_f64(s))
    }

    fn up(since: Time) -> FlagState {
        FlagState::Up { since, evidence: Evidence::default() }
    }

    #[test]
    fn every_state_meets_every_finding() {
        /// A finding at 5 s with a hold of 1 s.
        #[track_caller]
        fn check(state: FlagState, finding: Finding, expected: FlagState) {
            assert!(!state.stays(finding) || state == expected, "{state:?} {finding:?}");
            assert_eq!(state.on(at(5.0), finding, SECOND, Evidence::default), expected);
        }
        use FlagState::{Down, Pending};
        let (fresh, ripe) = (Pending { since: at(4.5) }, Pending { since: at(4.0) });
        check(Down, Finding::Holds, Pending { since: at(5.0) });
        check(Down, Finding::Unsettled, Down);
        check(Down, Finding::Gone, Down);
        check(fresh.clone(), Finding::Holds, fresh.clone());
        check(fresh.clone(), Finding::Unsettled, Down);
        check(fresh, Finding::Gone, Down);
        check(ripe.clone(), Finding::Holds, up(at(5.0)));
        check(ripe.clone(), Finding::Unsettled, Down);
        check(ripe, Finding::Gone, Down);
        check(up(at(1.0)), Finding::Holds, up(at(1.0)));
        check(up(at(1.0)), Finding::Unsettled, up(at(1.0)));
        check(up(at(1.0)), Finding::Gone, Down);
    }

    #[test]
    fn without_a_hold_it_is_up_at_once() {
        let state = FlagState::Down.on(at(5.0), Finding::Holds, Duration::ZERO, Evidence::default);
        assert_eq!(state, up(at(5.0)));
    }
}
