//! Types and units: from the tree to a condition that can be evaluated, or to what is wrong with it.

use super::amount::{Amount, Operation};
use super::condition::{Comparison, Condition};
use super::lexer::Symbol;
use super::parser::{Node, Part};
use super::{Problem, checked};
use crate::contingency::snapshot::{Field, Kind, TRUTH};
use crate::contingency::unit::Unit;
use crate::file::did_you_mean;

/// A number, and its unit; `None`: it was written without one, and takes that of what it meets.
type Measured = (Amount, Option<Unit>);

/// The message where a number is expected.
pub(super) const NO_NUMBER: &str = "this holds or does not, and is not a number";
/// The functions of numbers.
pub(super) const FUNCTIONS: [&str; 3] = ["abs", "min", "max"];

/// A part that holds or does not.
pub(super) fn condition(node: &Node) -> Result<Condition, Problem> {
    let problem = |message: String, help: &str| Err(Problem::new(node.span.clone(), message, help));
    match &node.part {
        Part::Not(inner) => Ok(Condition::Not(Box::new(condition(inner)?))),
        Part::Pair(Symbol::And, left, right) => {
            Ok(Condition::Both(Box::new(condition(left)?), Box::new(condition(right)?)))
        }
        Part::Pair(Symbol::Or, left, right) => {
            Ok(Condition::Either(Box::new(condition(left)?), Box::new(condition(right)?)))
        }
        Part::Pair(symbol @ (Symbol::Equal | Symbol::NotEqual), left, right) => {
            let same = Condition::Same(choice(left, right)?, choice(right, left)?);
            Ok(if *symbol == Symbol::Equal { same } else { Condition::Not(Box::new(same)) })
        }
        Part::Pair(symbol, left, right) => match Comparison::of(*symbol) {
            Some(comparison) => compared(node, comparison, left, right),
            None => problem("this is a number, and not yet a condition".into(), "compare it: `< 25 %`"),
        },
        Part::Call(name, arguments) if name == "known" => match arguments.as_slice() {
            [Node { part: Part::Name(field), span }] => Ok(Condition::Known(field_named(field, span)?)),
            _ => problem("`known` asks for one field".into(), "write `known(position.height_m)`"),
        },
        Part::Name(name) => {
            let field = field_named(name, &node.span)?;
            match field.kind() {
                Kind::Choice(names) if names == TRUTH => Ok(Condition::Holds(field)),
                Kind::Choice(names) => {
                    let message = format!("`{name}` is one of {}, and not yet a condition", names.join(", "));
                    problem(message, &format!("write `{name} == {}`", names[0]))
                }
                Kind::Number { unit, .. } => {
                    let message = format!("`{name}` is a number in {unit}, and not yet a condition");
                    problem(message, &format!("compare it: `{name} < ...`"))
                }
            }
        }
        Part::Number(..) | Part::Negative(_) | Part::Call(..) => {
            // A mistake inside says more than that this is a number.
            amount(node)?;
            problem("this is a number, and not yet a condition".into(), "compare it with a field")
        }
    }
}

fn compared(node: &Node, comparison: Comparison, left: &Node, right: &Node) -> Result<Condition, Problem> {
    let ((left_amount, left_unit), (right_amount, right_unit)) = (amount(left)?, amount(right)?);
    alike(node, "compared", left_unit, right_unit)?;
    if left_amount.constant().is_some() && right_amount.constant().is_some() {
        let message = "two constants are compared: this never changes";
        return Err(Problem::new(node.span.clone(), message, "one side reads a field"));
    }
    checked::range(&left_amount, right, &right_amount)?;
    checked::range(&right_amount, left, &left_amount)?;
    Ok(Condition::Compared(comparison, left_amount, right_amount))
}

/// A part that is a number.
fn amount(node: &Node) -> Result<Measured, Problem> {
    match &node.part {
        Part::Number(number, unit) => Ok((Amount::Constant(*number), *unit)),
        Part::Name(name) => {
            let field = field_named(name, &node.span)?;
            match field.kind() {
                Kind::Number { unit, .. } => Ok((Amount::Field(field), Some(unit))),
                Kind::Choice(names) => {
                    let message = format!("`{name}` is one of {}, and no number", names.join(", "));
                    Err(Problem::new(node.span.clone(), message, "compare it with `==` or `!=`"))
                }
            }
        }
        Part::Negative(inner) => {
            let (inner, unit) = amount(inner)?;
            Ok((Amount::Negative(Box::new(inner)), unit))
        }
        Part::Pair(symbol, left, right) => match Operation::of(*symbol) {
            Some(operation) => calculated(node, operation, left, right),
            None => Err(Problem::new(
                node.span.clone(),
                NO_NUMBER,
                "compare numbers, and join comparisons by `and` and `or`",
            )),
        },
        Part::Not(_) => {
            Err(Problem::new(node.span.clone(), NO_NUMBER, "compare numbers, and join comparisons by `and` and `or`"))
        }
        Part::Call(name, arguments) => called(node, name, arguments),
    }
}

fn calculated(node: &Node, operation: Operation, left: &Node, right: &Node) -> Result<Measured, Problem> {
    let ((left_amount, left_unit), (right_amount, right_unit)) = (amount(left)?, amount(right)?);
    if operation == Operation::Divide && right_amount.constant() == Some(0.0) {
        return Err(Problem::new(right.span.clone(), "this divides by zero", ""));
    }
    let unit = match (operation, left_unit, right_unit) {
        (Operation::Plus | Operation::Minus, ..) => alike(node, "added or subtracted", left_unit, right_unit)?,
        (Operation::Times | Operation::Divide, None, None) => None,
        (Operation::Times | Operation::Divide, ..) => {
            let (above, below) = (left_unit.unwrap_or(Unit::NONE), right_unit.unwrap_or(Unit::NONE));
            let unit = if operation == Operation::Times { above.times(below) } else { above.per(below) };
            let too_high = || {
                let message = format!("{above} and {below} come to a power that nothing of a vehicle has");
                Problem::new(node.span.clone(), message, "")
            };
            Some(unit.ok_or_else(too_high)?)
        }
    };
    let result = Amount::Calculated(operation, Box::new(left_amount), Box::new(right_amount));
    checked::finite(node, &result)?;
    Ok((result, unit))
}

fn called(node: &Node, name: &str, arguments: &[Node]) -> Result<Measured, Problem> {
    if !FUNCTIONS.contains(&name) {
        let known: Vec<&str> = FUNCTIONS.iter().copied().chain(["known"]).collect();
        let message = if name == "known" {
            "`known` holds or does not, and is not a number".to_owned()
        } else {
            format!("there is no function `{name}`")
        };
        return Err(Problem::new(node.span.clone(), message, did_you_mean(name, &known)));
    }
    let mut amounts = Vec::new();
    let mut unit = None;
    for argument in arguments {
        let (amount, of_argument) = amount(argument)?;
        unit = alike(node, &format!("arguments of `{name}`"), unit, of_argument)?;
        amounts.push(amount);
    }
    match (name, amounts.len()) {
        ("abs", 1) => Ok((Amount::Absolute(Box::new(amounts.remove(0))), unit)),
        ("abs", number) => {
            let message = format!("`abs` takes one argument, found {number}");
            Err(Problem::new(node.span.clone(), message, "write `abs(motion.climb_m_s)`"))
        }
        (_, 1) => {
            let message = format!("`{name}` of one value is that value");
            Err(Problem::new(node.span.clone(), message, "name two or more, separated by commas"))
        }
        ("min", _) => Ok((Amount::Least(amounts), unit)),
        _ => Ok((Amount::Greatest(amounts), unit)),
    }
}

/// The unit of two values that must be alike; one without a unit takes that of the other.
fn alike(node: &Node, how: &str, left: Option<Unit>, right: Option<Unit>) -> Result<Option<Unit>, Problem> {
    match (left, right) {
        (Some(left), Some(right)) if left != right => {
            let message = format!("{left} and {right} are {how}, expected two values of one unit");
            Err(Problem::new(node.span.clone(), message, "the name of a field ends in its unit"))
        }
        _ => Ok(left.or(right)),
    }
}

/// One side of `==` or `!=`: a field that is a choice, or a name that the field on the other side can have.
fn choice(node: &Node, other: &Node) -> Result<Amount, Problem> {
    let help = "`==` and `!=` compare a field with a name that it can have; compare measured numbers with `<` or `>`";
    let problem = |message: String| Err(Problem::new(node.span.clone(), message, help));
    let names_of = |name: &str| match Field::named(name).map(Field::kind) {
        Some(Kind::Choice(names)) => Some(names),
        _ => None,
    };
    let other_names = match &other.part {
        Part::Name(name) => names_of(name),
        _ => None,
    };
    let Part::Name(name) = &node.part else { return problem("a measured number never equals another one".into()) };
    match (Field::named(name), names_of(name), other_names) {
        (Some(field), Some(names), Some(others)) if names == others => Ok(Amount::Field(field)),
        (Some(_), Some(_), Some(_)) => problem(format!("`{name}` and the other side never have the same name")),
        (Some(field), Some(_), None) => Ok(Amount::Field(field)),
        (Some(_), None, _) => problem("a measured number never equals another one".into()),
        (None, _, Some(others)) => match others.iter().position(|it| it == name) {
            Some(place) => Ok(Amount::Constant(place as f64)),
            None => {
                let message = format!("there is no `{name}` here, expected one of {}", others.join(", "));
                Err(Problem::new(node.span.clone(), message, did_you_mean(name, others)))
            }
        },
        (None, _, None) => field_named(name, &node.span).map(Amount::Field),
    }
}

fn field_named(name: &str, span: &std::ops::Range<usize>) -> Result<Field, Problem> {
    Field::named(name).ok_or_else(|| {
        let known: Vec<&str> = Field::ALL.iter().map(|it| it.name()).collect();
        Problem::new(span.clone(), format!("there is no field `{name}`"), did_you_mean(name, &known))
    })
}
