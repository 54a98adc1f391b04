//! Numbers of a rule, checked: what they are at one moment.

use super::lexer::Symbol;
use crate::contingency::snapshot::{Field, Snapshot};

/// A number, in the units that values are kept in; of a choice its place in the list of names.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Amount {
    Constant(f64),
    Field(Field),
    Negative(Box<Amount>),
    Absolute(Box<Amount>),
    Least(Vec<Amount>),
    Greatest(Vec<Amount>),
    Calculated(Operation, Box<Amount>, Box<Amount>),
}

/// A calculation with two numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Operation {
    Plus,
    Minus,
    Times,
    Divide,
}

impl Operation {
    pub(super) fn of(symbol: Symbol) -> Option<Operation> {
        match symbol {
            Symbol::Plus => Some(Operation::Plus),
            Symbol::Minus => Some(Operation::Minus),
            Symbol::Times => Some(Operation::Times),
            Symbol::Divide => Some(Operation::Divide),
            _ => None,
        }
    }

    pub(super) fn of_numbers(self, left: f64, right: f64) -> f64 {
        match self {
            Operation::Plus => left + right,
            Operation::Minus => left - right,
            Operation::Times => left * right,
            Operation::Divide => left / right,
        }
    }
}

impl Amount {
    /// The value; `None` where a field that it reads is not known.
    pub(super) fn value(&self, snapshot: &Snapshot) -> Option<f64> {
        let all = |amounts: &[Amount]| amounts.iter().map(|it| it.value(snapshot)).collect::<Option<Vec<f64>>>();
        match self {
            Amount::Constant(value) => Some(*value),
            Amount::Field(field) => snapshot.get(*field),
            Amount::Negative(inner) => Some(-inner.value(snapshot)?),
            Amount::Absolute(inner) => Some(inner.value(snapshot)?.abs()),
            Amount::Least(amounts) => Some(all(amounts)?.into_iter().fold(f64::INFINITY, f64::min)),
            Amount::Greatest(amounts) => Some(all(amounts)?.into_iter().fold(f64::NEG_INFINITY, f64::max)),
            Amount::Calculated(operation, left, right) => {
                Some(operation.of_numbers(left.value(snapshot)?, right.value(snapshot)?))
            }
        }
    }

    /// The value if it reads no field.
    pub(super) fn constant(&self) -> Option<f64> {
        self.value(&Snapshot::UNKNOWN)
    }

    /// Calls `found` for each field that it reads.
    pub(super) fn fields(&self, found: &mut impl FnMut(Field)) {
        match self {
            Amount::Constant(_) => {}
            Amount::Field(field) => found(*field),
            Amount::Negative(inner) | Amount::Absolute(inner) => inner.fields(found),
            Amount::Least(amounts) | Amount::Greatest(amounts) => amounts.iter().for_each(|it| it.fields(found)),
            Amount::Calculated(_, left, right) => {
                left.fields(found);
                right.fields(found);
            }
        }
    }
}
