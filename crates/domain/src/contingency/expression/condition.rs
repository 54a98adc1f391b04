//! Conditions of a rule, checked: whether they hold at one moment, as far as that is known.

use super::amount::Amount;
use super::lexer::Symbol;
use crate::contingency::snapshot::{Field, Snapshot};

/// What holds or does not.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Condition {
    /// A yes or no of the vehicle is yes.
    Holds(Field),
    /// Something is known of the field.
    Known(Field),
    Compared(Comparison, Amount, Amount),
    /// Two choices have the same name.
    Same(Amount, Amount),
    Not(Box<Condition>),
    Both(Box<Condition>, Box<Condition>),
    Either(Box<Condition>, Box<Condition>),
}

/// A comparison of two numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Comparison {
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
}

impl Comparison {
    pub(super) fn of(symbol: Symbol) -> Option<Comparison> {
        match symbol {
            Symbol::Less => Some(Comparison::Less),
            Symbol::LessOrEqual => Some(Comparison::LessOrEqual),
            Symbol::Greater => Some(Comparison::Greater),
            Symbol::GreaterOrEqual => Some(Comparison::GreaterOrEqual),
            _ => None,
        }
    }

    fn holds(self, left: f64, right: f64) -> bool {
        match self {
            Comparison::Less => left < right,
            Comparison::LessOrEqual => left <= right,
            Comparison::Greater => left > right,
            Comparison::GreaterOrEqual => left >= right,
        }
    }

    /// Whether it holds for what is greater; seen from the other side if `swapped`.
    pub(super) fn is_above(self, swapped: bool) -> bool {
        matches!(self, Comparison::Greater | Comparison::GreaterOrEqual) != swapped
    }
}

impl Condition {
    /// Whether it holds; `None` where that depends on what is not known. (Kleene's three values: what is not known does not
    /// matter beside a part that decides alone.)
    pub(super) fn holds(&self, snapshot: &Snapshot) -> Option<bool> {
        match self {
            Condition::Holds(field) => snapshot.get(*field).map(|it| it > 0.5),
            Condition::Known(field) => Some(snapshot.get(*field).is_some()),
            Condition::Compared(comparison, left, right) => {
                let (left, right) = (left.value(snapshot)?, right.value(snapshot)?);
                // A calculation may have no result for what was measured.
                (left.is_finite() && right.is_finite()).then(|| comparison.holds(left, right))
            }
            Condition::Same(left, right) => Some(left.value(snapshot)? == right.value(snapshot)?),
            Condition::Not(inner) => inner.holds(snapshot).map(|it| !it),
            Condition::Both(left, right) => match (left.holds(snapshot), right.holds(snapshot)) {
                (Some(false), _) | (_, Some(false)) => Some(false),
                (Some(true), Some(true)) => Some(true),
                _ => None,
            },
            Condition::Either(left, right) => match (left.holds(snapshot), right.holds(snapshot)) {
                (Some(true), _) | (_, Some(true)) => Some(true),
                (Some(false), Some(false)) => Some(false),
                _ => None,
            },
        }
    }

    /// Calls `found` for each field that it reads.
    pub(super) fn fields(&self, found: &mut impl FnMut(Field)) {
        match self {
            Condition::Holds(field) | Condition::Known(field) => found(*field),
            Condition::Compared(_, left, right) | Condition::Same(left, right) => {
                left.fields(found);
                right.fields(found);
            }
            Condition::Not(inner) => inner.fields(found),
            Condition::Both(left, right) | Condition::Either(left, right) => {
                left.fields(found);
                right.fields(found);
            }
        }
    }

    /// What it asks for beside whether fields are known.
    pub(super) fn beside_known(&self) -> &Condition {
        match self {
            Condition::Both(left, right) => match (&**left, &**right) {
                (Condition::Known(_), other) | (other, Condition::Known(_)) => other.beside_known(),
                _ => self,
            },
            _ => self,
        }
    }

    /// Calls `found` for each comparison of a field with a constant: the field, the constant, and whether the comparison holds
    /// above it.
    pub(super) fn thresholds(&self, found: &mut impl FnMut(Field, f64, bool)) {
        match self {
            Condition::Compared(comparison, Amount::Field(field), other) => {
                other.constant().into_iter().for_each(|value| found(*field, value, comparison.is_above(false)));
            }
            Condition::Compared(comparison, other, Amount::Field(field)) => {
                other.constant().into_iter().for_each(|value| found(*field, value, comparison.is_above(true)));
            }
            Condition::Both(left, right) | Condition::Either(left, right) => {
                left.thresholds(found);
                right.thresholds(found);
            }
            Condition::Holds(_)
            | Condition::Known(_)
            | Condition::Compared(..)
            | Condition::Same(..)
            | Condition::Not(_) => {}
        }
    }
}
