//! Computing an expression. Numbers are computed without allocating.

use std::cmp::Ordering;

use super::Script;
use super::expr::{Assignment, Binary, Comparison, Expr, Unary};
use crate::shape::SlotDef;
use crate::types::Type;
use crate::value::Value;

/// Why an expression has no value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum EvalError {
    /// The key has not been written to yet.
    Empty(u32),
    /// The operator cannot be applied to these values.
    Misfit(&'static str, Value),
    Overflow,
    /// A value does not fit the key it is assigned to.
    WrongType(u32, Value),
}

impl EvalError {
    /// With the names of the keys.
    pub(crate) fn describe(&self, names: &[String]) -> String {
        let name = |key: &u32| names.get(*key as usize).map_or("?", String::as_str);
        match self {
            EvalError::Empty(key) => format!("nothing has been written to `{}` yet", name(key)),
            EvalError::Misfit(operator, value) => format!("`{operator}` cannot be applied to {value:?}"),
            EvalError::Overflow => "a whole number is too large".to_owned(),
            EvalError::WrongType(key, value) => format!("{value:?} does not fit `{}`", name(key)),
        }
    }
}

/// The blackboard, as an expression sees it.
pub(crate) struct Scene<'a> {
    pub(crate) values: &'a mut [Option<Value>],
    pub(crate) slots: &'a [SlotDef],
    /// What was compared last: tells why a condition did not hold.
    pub(crate) compared: Option<(Value, Value)>,
}

impl Script {
    /// The value of the last statement, after all of them.
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

/// Zero and the empty text are false.
fn truth(value: &Value) -> Result<bool, EvalError> {
    match value {
        Value::Text(text) => Ok(!text.is_empty()),
        _ => value.number().map(|it| it != 0.0).ok_or_else(|| EvalError::Misfit("is it true?", value.clone())),
    }
}

fn unary(operator: Unary, operand: Value) -> Result<Value, EvalError> {
    match (operator, &operand) {
        (Unary::Not, _) => Ok(Value::Bool(!truth(&operand)?)),
        (Unary::Negate, Value::Float(it)) => Ok(Value::Float(-it)),
        (Unary::Negate, _) => match whole(&operand) {
            Some(it) => it.checked_neg().map(Value::Int).ok_or(EvalError::Overflow),
            None => Err(EvalError::Misfit("-", operand)),
        },
        (Unary::Complement, _) => match whole(&operand) {
            Some(it) => Ok(Value::Int(!it)),
            None => Err(EvalError::Misfit("~", operand)),
        },
    }
}

fn binary(operator: Binary, left: Value, right: Value) -> Result<Value, EvalError> {
    let whole = whole(&left).zip(whole(&right));
    let real = left.number().zip(right.number());
    let result = match (operator, whole, real) {
        (Binary::Plus, Some((left, right)), _) => return checked(left.checked_add(right)),
        (Binary::Minus, Some((left, right)), _) => return checked(left.checked_sub(right)),
        (Binary::Times, Some((left, right)), _) => return checked(left.checked_mul(right)),
        (Binary::BitAnd, Some((left, right)), _) => Some(Value::Int(left & right)),
        (Binary::BitOr, Some((left, right)), _) => Some(Value::Int(left | right)),
        (Binary::BitXor, Some((left, right)), _) => Some(Value::Int(left ^ right)),
        (Binary::Plus, _, Some((left, right))) => Some(Value::Float(left + right)),
        (Binary::Minus, _, Some((left, right))) => Some(Value::Float(left - right)),
        (Binary::Times, _, Some((left, right))) => Some(Value::Float(left * right)),
        (Binary::Divide, _, Some((left, right))) => Some(Value::Float(left / right)),
        (Binary::Plus, _, _) => concatenated(&left, &right).filter(|_| is_text(&left) && is_text(&right)),
        (Binary::Concat, _, _) => concatenated(&left, &right).filter(|_| is_text(&left) || is_text(&right)),
        _ => None,
    };
    match result {
        Some(value) => Ok(value),
        None if left.number().is_some() && operator != Binary::Concat => Err(EvalError::Misfit(operator.sign(), right)),
        None => Err(EvalError::Misfit(operator.sign(), left)),
    }
}

fn checked(result: Option<i64>) -> Result<Value, EvalError> {
    result.map(Value::Int).ok_or(EvalError::Overflow)
}

fn whole(value: &Value) -> Option<i64> {
    match value {
        Value::Int(it) => Some(*it),
        Value::Bool(it) => Some(i64::from(*it)),
        _ => None,
    }
}

fn is_text(value: &Value) -> bool {
    matches!(value, Value::Text(_))
}

/// Texts longer than this are refused, or a script in a loop would fill the memory.
const MAX_TEXT: usize = 64 * 1024;

fn concatenated(left: &Value, right: &Value) -> Option<Value> {
    let is_plain = |value: &Value| !matches!(value, Value::Object(_));
    let text = if is_plain(left) && is_plain(right) { format!("{left}{right}") } else { return None };
    (text.len() <= MAX_TEXT).then(|| Value::Text(text.into()))
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

/// Real numbers this close are equal, as in BehaviorTree.CPP.
const CLOSE: f64 = f32::EPSILON as f64;

fn compare(operator: Comparison, left: &Value, right: &Value) -> Result<bool, EvalError> {
    let (ordering, is_equal) = match (left, right) {
        (Value::Text(left), Value::Text(right)) => (Some(left.cmp(right)), left == right),
        _ => match (whole(left).zip(whole(right)), left.number().zip(right.number())) {
            (Some((left, right)), _) => (Some(left.cmp(&right)), left == right),
            (None, Some((left, right))) => (left.partial_cmp(&right), (left - right).abs() <= CLOSE || left == right),
            (None, None) => return Err(EvalError::Misfit(operator.sign(), left.clone())),
        },
    };
    Ok(match operator {
        Comparison::Equal => is_equal,
        Comparison::NotEqual => !is_equal,
        Comparison::Less => ordering == Some(Ordering::Less),
        Comparison::Greater => ordering == Some(Ordering::Greater),
        Comparison::LessEqual => matches!(ordering, Some(Ordering::Less | Ordering::Equal)),
        Comparison::GreaterEqual => matches!(ordering, Some(Ordering::Greater | Ordering::Equal)),
    })
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
    let value = fitted(ty, value).map_err(|value| EvalError::WrongType(key, value))?;
    scene.values[key as usize] = Some(value.clone());
    Ok(value)
}

/// A value as a key of type `ty` keeps it: whole numbers widen to real ones, and numbers and booleans into each other
/// where nothing is lost.
fn fitted(ty: Type, value: Value) -> Result<Value, Value> {
    if ty.accepts(&value) {
        return Ok(value);
    }
    match (ty, &value) {
        (Type::Float, Value::Int(it)) => Ok(Value::Float(*it as f64)),
        (Type::Float, Value::Bool(it)) => Ok(Value::Float(f64::from(u8::from(*it)))),
        (Type::Int, Value::Bool(it)) => Ok(Value::Int(i64::from(*it))),
        (Type::Bool, Value::Int(it @ (0 | 1))) => Ok(Value::Bool(*it == 1)),
        _ => Err(value),
    }
}

impl Binary {
    pub(crate) const fn sign(self) -> &'static str {
        match self {
            Binary::Plus => "+",
            Binary::Minus => "-",
            Binary::Times => "*",
            Binary::Divide => "/",
            Binary::Concat => "..",
            Binary::BitAnd => "&",
            Binary::BitOr => "|",
            Binary::BitXor => "^",
            Binary::And => "&&",
            Binary::Or => "||",
        }
    }
}

impl Comparison {
    pub(crate) const fn sign(self) -> &'static str {
        match self {
            Comparison::Equal => "==",
            Comparison::NotEqual => "!=",
            Comparison::Less => "<",
            Comparison::Greater => ">",
            Comparison::LessEqual => "<=",
            Comparison::GreaterEqual => ">=",
        }
    }
}
