//! From an expression to a flag: raised once the expression has held for long enough, cleared once it has been over for long
//! enough.

use std::time::Duration;

use domain::contingency::expression::Expression;
use domain::contingency::snapshot::{Fields, Snapshot};
use domain::contingency::source::DataSource;
use domain::contingency::when::{Finding, When};
use domain::time::{Pace, Time};

use crate::sources::{Sources, Unheard};
use crate::words::{self, Evidence};

/// A flag is up for at least this long, in wall time: a reader that keeps only the newest introspection sees it. (ENG: ten introspections.)
const SHOWN: Duration = Duration::from_millis(100);

/// How the flag stands.
#[derive(Debug, Clone, PartialEq)]
enum State {
    /// It is down.
    Down,
    /// What raises it holds, not yet for long enough.
    Pending {
        /// Since when.
        since: Time,
    },
    /// It is up.
    Up {
        /// Since when.
        since: Time,
        /// Why.
        evidence: Evidence,
        /// Since when what raised it is over, if it is.
        over_since: Option<Time>,
    },
}

/// What an expression asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Wish {
    Raise,
    /// Neither.
    Keep,
    Clear,
    /// The situation in which the expression counts has ended.
    Drop,
}

/// For how long an expression must hold or be over, and for how long its flag is up at least.
#[derive(Debug, Clone, Copy)]
struct Times {
    hold: Duration,
    clears_after: Duration,
    shown: Duration,
}

impl State {
    /// The state after a wish; `why` is called when the flag is raised.
    fn on(self, now: Time, wish: Wish, times: Times, why: impl FnOnce() -> Evidence) -> State {
        use {State as S, Wish as W};
        match (self, wish) {
            (S::Down, W::Raise) if times.hold.is_zero() => S::Up { since: now, evidence: why(), over_since: None },
            (S::Down, W::Raise) => S::Pending { since: now },
            (S::Down, W::Keep | W::Clear | W::Drop) => S::Down,
            (S::Pending { since }, W::Raise) if times.hold <= now - since => {
                S::Up { since: now, evidence: why(), over_since: None }
            }
            (S::Pending { since }, W::Raise) => S::Pending { since },
            (S::Pending { .. }, W::Keep | W::Clear | W::Drop) => S::Down,
            (S::Up { since, evidence, .. }, W::Raise | W::Keep) => S::Up { since, evidence, over_since: None },
            (S::Up { since, evidence, over_since }, W::Clear) => {
                let over = over_since.unwrap_or(now);
                let is_long = times.clears_after <= now - over && times.shown <= now - since;
                if is_long { S::Down } else { S::Up { since, evidence, over_since: Some(over) } }
            }
            (S::Up { .. }, W::Drop) => S::Down,
        }
    }

    fn is_up(&self) -> bool {
        matches!(self, State::Up { .. })
    }

    /// When it may change although nothing else does.
    fn deadline(&self, times: Times) -> Option<Time> {
        match self {
            State::Down => None,
            State::Pending { since } => Some(*since + times.hold),
            State::Up { since, over_since, .. } => {
                over_since.map(|over| (over + times.clears_after).max(*since + times.shown))
            }
        }
    }
}

/// The expression of a row, and how its flag stands.
#[derive(Debug, Clone)]
pub(crate) struct Watch {
    when: When,
    times: Times,
    /// What decides how the flag stands.
    reads: Fields,
    /// The silences that are compared with a number, which they reach although nothing arrives.
    silences: Vec<(DataSource, f64)>,
    state: State,
    /// Whether it has found since its start that the flag is up, or is not.
    is_decided: bool,
}

impl Watch {
    /// The flag is down.
    pub(crate) fn new(when: When, pace: Pace) -> Watch {
        let clears = when.clears.iter().flat_map(Expression::fields);
        let reads = Fields::of(when.fields().iter().chain(clears).copied().chain(when.during.field()));
        let silences = when.raises.thresholds().into_iter().filter(|it| it.above);
        let silences = silences.filter_map(|it| Some((it.field.silence()?, it.value))).collect();
        let times = Times { hold: when.hold, clears_after: when.clears_after, shown: pace.wall(SHOWN) };
        Watch { when, times, reads, silences, state: State::Down, is_decided: false }
    }

    /// Evaluates the expression, unless nothing that it reads is in `changed` since the time before, and it waits for no time to pass.
    /// Returns whether the flag was raised or cleared.
    pub(crate) fn evaluate(
        &mut self,
        now: Time,
        sources: &Sources,
        snapshot: &Snapshot,
        changed: Fields,
        unheard: Unheard,
    ) -> bool {
        if !changed.meets(self.reads) && self.state.deadline(self.times).is_none() {
            return false;
        }
        let (finding, was_up) = (self.when.finding(snapshot), self.state.is_up());
        let wish = self.wish(finding, snapshot, unheard);
        let why = || words::for_raising(&self.when, finding, now, snapshot, sources);
        self.state = std::mem::replace(&mut self.state, State::Down).on(now, wish, self.times, why);
        self.is_decided |= self.state.is_up() || matches!(wish, Wish::Clear | Wish::Drop);
        self.state.is_up() != was_up
    }

    /// Since when its flag is up, and why.
    pub(crate) fn raised(&self) -> Option<(Time, &Evidence)> {
        match &self.state {
            State::Up { since, evidence, .. } => Some((*since, evidence)),
            State::Down | State::Pending { .. } => None,
        }
    }

    /// Whether it has found since its start that the flag is up, or is not.
    pub(crate) fn is_decided(&self) -> bool {
        self.is_decided
    }

    /// When to evaluate it again after `now` even if nothing arrives.
    pub(crate) fn deadline(&self, now: Time, sources: &Sources) -> Option<Time> {
        let silences = self.silences.iter().filter(|_| !self.state.is_up());
        let reached = silences.filter_map(|(source, silent_s)| sources.silent_at(*source, *silent_s));
        reached.chain(self.state.deadline(self.times)).filter(|it| now < *it).min()
    }

    fn wish(&self, finding: Finding, snapshot: &Snapshot, unheard: Unheard) -> Wish {
        let may_be_heard = unheard.unknown.meets(self.reads);
        match (self.when.during.applies(snapshot), finding) {
            (None, _) if may_be_heard => Wish::Keep,
            (None | Some(false), _) => Wish::Drop,
            (Some(true), Finding::Raises) => Wish::Raise,
            // Until every source had the time to be heard, that one was not says nothing.
            (Some(true), Finding::Unknown(_)) if may_be_heard => Wish::Keep,
            (Some(true), Finding::Unknown(_)) => Wish::Raise,
            (Some(true), Finding::Between) => Wish::Keep,
            (Some(true), Finding::Clears) if may_be_heard || unheard.silences.meets(self.reads) => Wish::Keep,
            (Some(true), Finding::Clears) => Wish::Clear,
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

    fn up(since: Time, over_since: Option<Time>) -> State {
        State::Up { since, evidence: Evidence::default(), over_since }
    }

    #[test]
    fn every_state_meets_every_wish() {
        /// A wish at 5 s, with a hold of 1 s, 1 s until it clears, and 2 s for which it is up at least.
        #[track_caller]
        fn check(state: &State, wish: Wish, expected: &State) {
            let times = Times { hold: SECOND, clears_after: SECOND, shown: 2 * SECOND };
            let found = state.clone().on(at(5.0), wish, times, Evidence::default);
            assert_eq!(&found, expected, "{state:?} {wish:?}");
        }
        use State::{Down, Pending};
        let (fresh, ripe) = (Pending { since: at(4.5) }, Pending { since: at(4.0) });
        check(&Down, Wish::Raise, &Pending { since: at(5.0) });
        check(&Down, Wish::Keep, &Down);
        check(&Down, Wish::Clear, &Down);
        check(&Down, Wish::Drop, &Down);
        check(&fresh, Wish::Raise, &fresh);
        check(&ripe, Wish::Raise, &up(at(5.0), None));
        for pending in [&fresh, &ripe] {
            check(pending, Wish::Keep, &Down);
            check(pending, Wish::Clear, &Down);
            check(pending, Wish::Drop, &Down);
        }
        for over_since in [None, Some(at(4.5))] {
            check(&up(at(1.0), over_since), Wish::Raise, &up(at(1.0), None));
            check(&up(at(1.0), over_since), Wish::Keep, &up(at(1.0), None));
            check(&up(at(1.0), over_since), Wish::Drop, &Down);
        }
        check(&up(at(1.0), None), Wish::Clear, &up(at(1.0), Some(at(5.0))));
        check(&up(at(1.0), Some(at(4.5))), Wish::Clear, &up(at(1.0), Some(at(4.5))));
        check(&up(at(1.0), Some(at(4.0))), Wish::Clear, &Down);
        check(&up(at(3.5), Some(at(4.0))), Wish::Clear, &up(at(3.5), Some(at(4.0))));
    }

    #[test]
    fn without_times_it_rises_and_falls_at_once() {
        let at_once = Times { hold: Duration::ZERO, clears_after: Duration::ZERO, shown: Duration::ZERO };
        let raised = State::Down.on(at(5.0), Wish::Raise, at_once, Evidence::default);
        assert_eq!(raised, up(at(5.0), None));
        assert_eq!(raised.on(at(5.0), Wish::Clear, at_once, Evidence::default), State::Down);
    }

    #[test]
    fn the_next_change_is_when_every_time_has_passed() {
        #[track_caller]
        fn check(state: &State, expected_s: Option<f64>) {
            let times = Times { hold: SECOND, clears_after: SECOND, shown: 2 * SECOND };
            assert_eq!(state.deadline(times), expected_s.map(at), "{state:?}");
        }
        check(&State::Down, None);
        check(&State::Pending { since: at(4.0) }, Some(5.0));
        check(&up(at(4.0), None), None);
        check(&up(at(4.0), Some(at(4.5))), Some(6.0));
        check(&up(at(4.0), Some(at(9.0))), Some(10.0));
    }
}
