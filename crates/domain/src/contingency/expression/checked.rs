//! Constants that a rule may have.

use super::Problem;
use super::amount::Amount;
use super::parser::Node;
use crate::contingency::snapshot::Kind;

/// Whether a constant that is compared with a field lies in the field's range: otherwise the rule would always hold, or
/// never. Other sides are not judged.
pub(super) fn range(side: &Amount, constant: &Node, other: &Amount) -> Result<(), Problem> {
    let (Amount::Field(field), Some(value)) = (side, other.constant()) else { return Ok(()) };
    let Kind::Number { unit, least, most } = field.kind() else { return Ok(()) };
    if least <= value && value <= most {
        return Ok(());
    }
    let message = format!("{value} {unit} is beyond the range of `{}`", field.name());
    Err(Problem::new(constant.span.clone(), message, format!("expected {least} to {most} {unit}")))
}

/// Whether a calculation with constants has a result: numbers that are too large have none.
pub(super) fn finite(node: &Node, amount: &Amount) -> Result<(), Problem> {
    match amount.constant() {
        Some(value) if !value.is_finite() => {
            Err(Problem::new(node.span.clone(), "this calculation has no result", "a number is too large"))
        }
        _ => Ok(()),
    }
}
