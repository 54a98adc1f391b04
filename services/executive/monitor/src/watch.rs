//! From a fact to a flag: it must hold for a while, and be gone for good.

use std::time::Duration;

use domain::contingency::Rule;
use domain::time::Time;

use crate::fact::{Fact, Finding};
use crate::sources::Sources;
use crate::words::{self, Evidence};

/// Where a rule stands.
#[derive(Debug, Clone, PartialEq)]
pub enum State {
    /// Nothing is wrong.
    Quiet,
    /// The fact holds, not yet for long enough.
    Pending {
        /// Since when it holds.
        since: Time,
    },
    /// The flag is up.
    Up {
        /// Since when.
        since: Time,
        /// Why it rose.
        evidence: Evidence,
    },
}

impl State {
    /// The state after a look at the fact. `hold` is how long the fact must hold, `why` is asked
    /// when the flag rises.
    fn on(self, now: Time, finding: Finding, hold: Duration, why: impl FnOnce() -> Evidence) -> State {
        use {Finding as F, State as S};
        match (self, finding) {
            (S::Quiet, F::Holds) if hold.is_zero() => S::Up { since: now, evidence: why() },
            (S::Quiet, F::Holds) => S::Pending { since: now },
            (S::Quiet, F::Unsettled | F::Gone) => S::Quiet,
            (S::Pending { since }, F::Holds) if hold <= now - since => S::Up { since: now, evidence: why() },
            (S::Pending { since }, F::Holds) => S::Pending { since },
            (S::Pending { .. }, F::Unsettled | F::Gone) => S::Quiet,
            (S::Up { .. }, F::Gone) => S::Quiet,
            (up @ S::Up { .. }, F::Holds | F::Unsettled) => up,
        }
    }

    fn is_up(&self) -> bool {
        matches!(self, State::Up { .. })
    }
}

/// On which occasion a rule is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Occasion {
    /// A sample has arrived; others that arrived with it may still wait to be taken in.
    Sample,
    /// Everything that has arrived is taken in.
    Clock,
}

/// The flag rose or fell.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// It rose.
    Rose(Evidence),
    /// It fell.
    Fell(Evidence),
}

/// A rule and where it stands.
#[derive(Debug, Clone)]
pub struct Watch {
    fact: Fact,
    state: State,
}

impl Watch {
    /// Nothing is wrong yet.
    pub fn new(fact: Fact) -> Watch {
        Watch { fact, state: State::Quiet }
    }

    /// Looks at the fact.
    pub fn look(&mut self, now: Time, occasion: Occasion, sources: &Sources) -> Option<Change> {
        let finding = match (self.fact.look(sources, now), occasion, self.fact.rule) {
            // After a pause of the whole process every source looks late until its mail is opened.
            (Finding::Holds, Occasion::Sample, Rule::Stale { .. }) => Finding::Unsettled,
            (finding, ..) => finding,
        };
        let was_up = self.state.is_up();
        let why = || words::rise(&self.fact, sources, now);
        self.state = std::mem::replace(&mut self.state, State::Quiet).on(now, finding, self.fact.hold, why);
        match &self.state {
            State::Up { evidence, .. } if !was_up => Some(Change::Rose(evidence.clone())),
            State::Quiet if was_up => Some(Change::Fell(words::fall(&self.fact, sources))),
            _ => None,
        }
    }

    /// Since when its flag is up, and why.
    pub fn up(&self) -> Option<(Time, &str)> {
        match &self.state {
            State::Up { since, evidence } => Some((*since, &evidence.reason)),
            State::Quiet | State::Pending { .. } => None,
        }
    }

    /// When to look again even if nothing arrives.
    pub fn deadline(&self, sources: &Sources) -> Option<Time> {
        match self.state {
            State::Quiet if self.fact.counts(sources) => self.fact.stale_at(sources),
            State::Pending { since } => Some(since + self.fact.hold),
            State::Quiet | State::Up { .. } => None,
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

    fn up(since: Time) -> State {
        State::Up { since, evidence: Evidence::default() }
    }

    #[test]
    fn every_state_meets_every_finding() {
        /// A look at 5 s with a hold of 1 s.
        #[track_caller]
        fn check(state: State, finding: Finding, expected: State) {
            assert_eq!(state.on(at(5.0), finding, SECOND, Evidence::default), expected);
        }
        let (fresh, ripe) = (State::Pending { since: at(4.5) }, State::Pending { since: at(4.0) });
        check(State::Quiet, Finding::Holds, State::Pending { since: at(5.0) });
        check(State::Quiet, Finding::Unsettled, State::Quiet);
        check(State::Quiet, Finding::Gone, State::Quiet);
        check(fresh.clone(), Finding::Holds, fresh.clone());
        check(fresh.clone(), Finding::Unsettled, State::Quiet);
        check(fresh, Finding::Gone, State::Quiet);
        check(ripe.clone(), Finding::Holds, up(at(5.0)));
        check(ripe.clone(), Finding::Unsettled, State::Quiet);
        check(ripe, Finding::Gone, State::Quiet);
        check(up(at(1.0)), Finding::Holds, up(at(1.0)));
        check(up(at(1.0)), Finding::Unsettled, up(at(1.0)));
        check(up(at(1.0)), Finding::Gone, State::Quiet);
    }

    #[test]
    fn without_a_hold_it_is_up_at_once() {
        let state = State::Quiet.on(at(5.0), Finding::Holds, Duration::ZERO, Evidence::default);
        assert_eq!(state, up(at(5.0)));
    }
}
