//! Rules as expressions: `battery.charge_percent < 25 % and vehicle.flying`.
//!
//! An expression reads the fields of a [`Snapshot`], and is checked as a whole before anything flies: its grammar, its names, its
//! types, its units, and whether a constant lies in the range of the field that it is compared with. It has no variables, no
//! loops and no effects, so that what was checked cannot fail later, other than by data that are missing.
//!
//! What is missing is not replaced by a number: an expression whose result depends on it is [`Verdict::Unknown`], and who asks
//! decides what that means. `known(field)` asks whether there are data.

use std::ops::Range;

use super::snapshot::{Field, Snapshot};

mod amount;
mod check;
mod checked;
mod condition;
pub mod estimate;
mod lexer;
mod parser;
#[cfg(test)]
mod tests;

use condition::Condition;

/// An expression that was checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    text: String,
    condition: Condition,
    fields: Vec<Field>,
}

/// Whether an expression holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It holds.
    Holds,
    /// It does not.
    DoesNotHold,
    /// That depends on a field of which nothing is known; `None`: all are known, and a calculation has no result.
    Unknown(Option<Field>),
}

/// A comparison of a field with a constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Threshold {
    /// What is compared.
    pub field: Field,
    /// The constant, in the field's unit.
    pub value: f64,
    /// Whether it holds for what is greater; otherwise for what is less.
    pub above: bool,
}

/// What is wrong with an expression.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// Where, in bytes of its text.
    pub span: Range<usize>,
    /// What was found and what was expected.
    pub message: String,
    /// How to mend it; may be empty.
    pub help: String,
}

impl Problem {
    fn new(span: Range<usize>, message: impl Into<String>, help: impl Into<String>) -> Problem {
        Problem { span, message: message.into(), help: help.into() }
    }
}

impl Expression {
    /// Reads and checks an expression.
    ///
    /// # Errors
    /// The first thing that is wrong with it, and where.
    pub fn parse(text: &str) -> Result<Expression, Problem> {
        let condition = check::condition(&parser::parse(text)?)?;
        let mut fields = Vec::new();
        condition.fields(&mut |field| {
            if !fields.contains(&field) {
                fields.push(field);
            }
        });
        Ok(Expression { text: text.trim().to_owned(), condition, fields })
    }

    /// As it was written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The fields that it reads, each once, in their order.
    pub fn fields(&self) -> &[Field] {
        &self.fields
    }

    /// Whether it holds for these values.
    pub fn verdict(&self, snapshot: &Snapshot) -> Verdict {
        match self.condition.holds(snapshot) {
            Some(true) => Verdict::Holds,
            Some(false) => Verdict::DoesNotHold,
            None => Verdict::Unknown(self.fields.iter().copied().find(|it| snapshot.get(*it).is_none())),
        }
    }

    /// Each comparison of a field with a constant that it consists of, outside of `not`.
    pub fn thresholds(&self) -> Vec<Threshold> {
        let mut thresholds = Vec::new();
        self.condition.thresholds(&mut |field, value, above| thresholds.push(Threshold { field, value, above }));
        thresholds
    }

    /// Its threshold if it is nothing but one comparison of a field with a constant, or that and `known(..)`.
    pub fn threshold(&self) -> Option<Threshold> {
        match (self.condition.beside_known(), self.thresholds().as_slice()) {
            (Condition::Compared(..), [threshold]) => Some(*threshold),
            _ => None,
        }
    }
}
