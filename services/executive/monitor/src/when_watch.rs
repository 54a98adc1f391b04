//! From an expression to a flag: raised once the expression has held for long enough, cleared once it has been over for long
//! enough.

use std::time::Duration;

use domain::contingency::expression::Expression;
use domain::contingency::rule::During;
use domain::contingency::snapshot::{Field, Fields, Kind, Snapshot};
use domain::contingency::when::{Finding, When};
use domain::measured::Unit;
use domain::time::Time;

use crate::evidence::Evidence;
use crate::rule_watch::Change;
use crate::sources::Sources;

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

impl State {
    /// Whether a wish changes nothing of it, whatever the time.
    fn stays(&self, wish: Wish) -> bool {
        match self {
            State::Down => wish != Wish::Raise,
            State::Pending { .. } => false,
            State::Up { over_since, .. } => over_since.is_none() && matches!(wish, Wish::Raise | Wish::Keep),
        }
    }

    /// The state after a wish; `why` is called when the flag is raised.
    fn on(self, now: Time, wish: Wish, when: &When, why: impl FnOnce() -> Evidence) -> State {
        use {State as S, Wish as W};
        match (self, wish) {
            (S::Down, W::Raise) if when.hold.is_zero() => S::Up { since: now, evidence: why(), over_since: None },
            (S::Down, W::Raise) => S::Pending { since: now },
            (S::Down, W::Keep | W::Clear | W::Drop) => S::Down,
            (S::Pending { since }, W::Raise) if when.hold <= now - since => {
                S::Up { since: now, evidence: why(), over_since: None }
            }
            (S::Pending { since }, W::Raise) => S::Pending { since },
            (S::Pending { .. }, W::Keep | W::Clear | W::Drop) => S::Down,
            (S::Up { since, evidence, .. }, W::Raise | W::Keep) => S::Up { since, evidence, over_since: None },
            (S::Up { since, evidence, over_since }, W::Clear) => {
                let over = over_since.unwrap_or(now);
                let is_long = when.clears_after <= now - over;
                if is_long { S::Down } else { S::Up { since, evidence, over_since: Some(over) } }
            }
            (S::Up { .. }, W::Drop) => S::Down,
        }
    }
}

/// The expression of a row, and how its flag stands.
#[derive(Debug, Clone)]
pub(crate) struct WhenWatch {
    when: When,
    /// From the first sample of any source until a field of which nothing is known counts as raised.
    absent_after: Duration,
    /// What the expressions read, and what they found; `None` before the first time.
    reads: Fields,
    finding: Option<Finding>,
    state: State,
}

impl WhenWatch {
    /// The flag is down.
    pub(crate) fn new(when: When, absent_after: Duration) -> WhenWatch {
        let clears = when.clears.iter().flat_map(Expression::fields);
        let reads = Fields::of(when.fields().iter().chain(clears).copied());
        WhenWatch { when, absent_after, reads, finding: None, state: State::Down }
    }

    /// Evaluates the expression; `changed` is what differs between this snapshot and the one of the time before.
    pub(crate) fn evaluate(
        &mut self,
        now: Time,
        sources: &Sources,
        snapshot: &Snapshot,
        changed: Fields,
    ) -> Option<Change> {
        let known = self.finding.filter(|_| !changed.meets(self.reads));
        let finding = known.unwrap_or_else(|| self.when.finding(snapshot));
        self.finding = Some(finding);
        let wish = self.wish(finding, sources, now);
        // Nearly always nothing happens, a thousand times a second.
        if self.state.stays(wish) {
            return None;
        }
        let was_up = matches!(self.state, State::Up { .. });
        let why = || for_raising(&self.when, finding, snapshot);
        self.state = std::mem::replace(&mut self.state, State::Down).on(now, wish, &self.when, why);
        match &self.state {
            State::Up { evidence, .. } if !was_up => Some(Change::Raised(evidence.clone())),
            State::Down if was_up => Some(Change::Cleared(for_clearing(&self.when, wish, snapshot))),
            State::Down | State::Pending { .. } | State::Up { .. } => None,
        }
    }

    /// Since when its flag is up, and why.
    pub(crate) fn raised(&self) -> Option<(Time, &Evidence)> {
        match &self.state {
            State::Up { since, evidence, .. } => Some((*since, evidence)),
            State::Down | State::Pending { .. } => None,
        }
    }

    /// When to evaluate it again even if nothing arrives.
    pub(crate) fn deadline(&self) -> Option<Time> {
        match self.state {
            State::Pending { since } => Some(since + self.when.hold),
            State::Up { over_since, .. } => over_since.map(|over| over + self.when.clears_after),
            State::Down => None,
        }
    }

    fn wish(&self, finding: Finding, sources: &Sources, now: Time) -> Wish {
        let applies = match self.when.during {
            During::Always => true,
            During::Armed => sources.armed(),
            During::Flying => sources.flying() == Some(true),
        };
        let may_be_absent = sources.first_heard().is_none_or(|first| now < first + self.absent_after);
        match finding {
            _ if !applies => Wish::Drop,
            Finding::Raises => Wish::Raise,
            // Until every source had the time to be heard, that one was not says nothing.
            Finding::Unknown(_) if may_be_absent => Wish::Keep,
            Finding::Unknown(_) => Wish::Raise,
            Finding::Between => Wish::Keep,
            Finding::Clears => Wish::Clear,
        }
    }
}

fn for_raising(when: &When, finding: Finding, snapshot: &Snapshot) -> Evidence {
    let text = when.raises.text();
    let hold_s = when.hold.as_secs_f64();
    let lasting = if when.hold.is_zero() { String::new() } else { format!(" for {hold_s:.1} s") };
    let values = match finding {
        Finding::Unknown(Some(field)) => format!("{} is not known, which counts as raised", field.name()),
        Finding::Unknown(None) => "the rule has no result, which counts as raised".to_owned(),
        Finding::Raises | Finding::Between | Finding::Clears => values(when.fields(), snapshot),
    };
    let reason = format!("{values}; the rule is `{text}`{lasting}");
    Evidence { reason, ..compared(&when.raises, snapshot) }
}

fn for_clearing(when: &When, wish: Wish, snapshot: &Snapshot) -> Evidence {
    if wish == Wish::Drop {
        let situation = if when.during == During::Flying { "flying" } else { "armed" };
        return Evidence { reason: format!("the vehicle is no longer {situation}"), ..Evidence::default() };
    }
    let cleared_by = when.clears.as_ref().unwrap_or(&when.raises);
    let (values, text) = (values(cleared_by.fields(), snapshot), cleared_by.text());
    let reason = match when.clears {
        Some(_) => format!("{values}; it is cleared by `{text}`"),
        None => format!("{values}; `{text}` no longer holds"),
    };
    Evidence { reason, ..compared(cleared_by, snapshot) }
}

/// Every field with its value: `battery.charge_percent 4.20 %, vehicle.flying true`.
fn values(fields: &[Field], snapshot: &Snapshot) -> String {
    let in_words = |field: &Field| match snapshot.get(*field) {
        Some(value) => format!("{} {}", field.name(), field.in_words(value)),
        None => format!("{} not known", field.name()),
    };
    fields.iter().map(in_words).collect::<Vec<_>>().join(", ")
}

/// The value and its threshold, where the expression is one comparison.
fn compared(expression: &Expression, snapshot: &Snapshot) -> Evidence {
    let Some(threshold) = expression.threshold() else { return Evidence::default() };
    let unit = match threshold.field.kind() {
        Kind::Number { unit, .. } => Unit::try_from(unit).ok(),
        _ => None,
    };
    let (value, threshold) = (snapshot.get(threshold.field), Some(threshold.value));
    Evidence { value, threshold, unit, ..Evidence::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    fn at(s: f64) -> Time {
        Time::after(Duration::from_secs_f64(s))
    }

    fn when(hold: Duration, clears_after: Duration) -> When {
        let raises = Expression::parse("vehicle.armed").unwrap();
        When { raises, clears: None, hold, clears_after, during: During::Always }
    }

    fn up(since: Time, over_since: Option<Time>) -> State {
        State::Up { since, evidence: Evidence::default(), over_since }
    }

    #[test]
    fn every_state_meets_every_wish() {
        /// A wish at 5 s, with a hold of 1 s and 1 s until it clears.
        #[track_caller]
        fn check(state: &State, wish: Wish, expected: &State) {
            let found = state.clone().on(at(5.0), wish, &when(SECOND, SECOND), Evidence::default);
            assert_eq!(&found, expected, "{state:?} {wish:?}");
            assert!(!state.stays(wish) || &found == state, "{state:?} {wish:?}");
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
    }

    #[test]
    fn without_times_it_rises_and_falls_at_once() {
        let at_once = when(Duration::ZERO, Duration::ZERO);
        let raised = State::Down.on(at(5.0), Wish::Raise, &at_once, Evidence::default);
        assert_eq!(raised, up(at(5.0), None));
        assert_eq!(raised.on(at(5.0), Wish::Clear, &at_once, Evidence::default), State::Down);
    }
}
