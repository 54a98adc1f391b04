//! Computing an expression.

use super::Script;
use super::error::EvalError;
use super::expr::{Assignment, Binary, Comparison, Expr};
use super::operators::{binary, compare, truth, unary};
use crate::board::SlotDef;
use crate::values::types::Type;
use crate::values::value::Value;

/// The blackboard, as an expression sees it.
pub(crate) struct Scene<'a> {
    pub(crate) values: &'a mut [Option<Value>],
    pub(crate) slots: &'a [SlotDef],
    /// The two sides of the last comparison, which are the reason if a condition does not hold.
    pub(crate) compared: Option<(Value, Value)>,
}

impl Script {
    /// Computes all statements. Returns the value of the last one.
    pub(crate) fn run(&self, scene: &mut Scene<'_>) -> Result<Value, EvalError> {
        let mut last = Value::Bool(false);
        for statement in &self.statements {
            last = statement.value(scene)?;
        }
        Ok(last)
    }

    /// [`Script::run`], as a condition.
    pub(crate) fn holds(&self, scene: &mut Scene<'_>) -> Result<bool, EvalError> {
        truth(&self.run(scene)?)
    }
}

impl Expr {
    fn value(&self, scene: &mut Scene<'_>) -> Result<Value, EvalError> {
        match self {
            Expr::Literal(value) => Ok(value.clone()),
            Expr::Key(key) => scene.values[*key as usize].clone().ok_or(EvalError::Empty(*key)),
            Expr::Unary(operator, operand) => unary(*operator, operand.value(scene)?),
            Expr::Binary(Binary::And, left, right) => {
                Ok(Value::Bool(truth(&left.value(scene)?)? && truth(&right.value(scene)?)?))
            }
            Expr::Binary(Binary::Or, left, right) => {
                Ok(Value::Bool(truth(&left.value(scene)?)? || truth(&right.value(scene)?)?))
            }
            Expr::Binary(operator, left, right) => binary(*operator, left.value(scene)?, right.value(scene)?),
            Expr::Compare(first, rest) => compare_all(first, rest, scene),
            Expr::If(condition, then, otherwise) => {
                if truth(&condition.value(scene)?)? {
                    then.value(scene)
                } else {
                    otherwise.value(scene)
                }
            }
            Expr::Assign(key, how, value) => assign(*key, *how, value.value(scene)?, scene),
        }
    }
}

fn compare_all(first: &Expr, rest: &[(Comparison, Expr)], scene: &mut Scene<'_>) -> Result<Value, EvalError> {
    let mut left = first.value(scene)?;
    for (operator, operand) in rest {
        let right = operand.value(scene)?;
        let holds = compare(*operator, &left, &right)?;
        scene.compared = Some((left, right.clone()));
        if !holds {
            return Ok(Value::Bool(false));
        }
        left = right;
    }
    Ok(Value::Bool(true))
}

fn assign(key: u32, how: Assignment, value: Value, scene: &mut Scene<'_>) -> Result<Value, EvalError> {
    let value = match how {
        Assignment::Create | Assignment::Set => value,
        Assignment::With(operator) => {
            let before = scene.values[key as usize].clone().ok_or(EvalError::Empty(key))?;
            binary(operator, before, value)?
        }
    };
    let ty = scene.slots[key as usize].ty;
    let value = converted(value, ty).map_err(|value| EvalError::WrongType(key, value))?;
    scene.values[key as usize] = Some(value.clone());
    Ok(value)
}

/// A value as a key of type `ty` holds it: integers become doubles, and numbers and booleans become one another where
/// nothing is lost.
fn converted(value: Value, ty: Type) -> Result<Value, Value> {
    if ty.accepts(&value) {
        return Ok(value);
    }
    match (ty, &value) {
        (Type::Float, Value::Int(number)) => Ok(Value::Float(*number as f64)),
        (Type::Float, Value::Bool(flag)) => Ok(Value::Float(f64::from(u8::from(*flag)))),
        (Type::Int, Value::Bool(flag)) => Ok(Value::Int(i64::from(*flag))),
        (Type::Bool, Value::Int(number @ (0 | 1))) => Ok(Value::Bool(*number == 1)),
        _ => Err(value),
    }
}
