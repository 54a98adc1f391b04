//! The operators, applied to values. Numbers are computed without allocating.

use std::cmp::Ordering;

use super::error::EvalError;
use super::expr::{Binary, Comparison, Unary};
use crate::values::value::Value;

/// Whether a value is true. 0 and the empty text are false.
pub(super) fn truth(value: &Value) -> Result<bool, EvalError> {
    match value {
        Value::Text(text) => Ok(!text.is_empty()),
        _ => value.number().map(|number| number != 0.0).ok_or_else(|| EvalError::NoCondition(value.clone())),
    }
}

pub(super) fn unary(operator: Unary, operand: Value) -> Result<Value, EvalError> {
    match (operator, &operand) {
        (Unary::Not, _) => Ok(Value::Bool(!truth(&operand)?)),
        (Unary::Negate, Value::Float(number)) => Ok(Value::Float(-number)),
        (Unary::Negate, _) => match integer(&operand) {
            Some(number) => number.checked_neg().map(Value::Int).ok_or(EvalError::Overflow),
            None => Err(EvalError::Misfit("-", operand)),
        },
        (Unary::Complement, _) => match integer(&operand) {
            Some(number) => Ok(Value::Int(!number)),
            None => Err(EvalError::Misfit("~", operand)),
        },
    }
}

/// All binary operators but `&&` and `||`, whose right side may not be computed.
pub(super) fn binary(operator: Binary, left: Value, right: Value) -> Result<Value, EvalError> {
    let integers = integer(&left).zip(integer(&right));
    let numbers = left.number().zip(right.number());
    let result = match (operator, integers, numbers) {
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

fn integer(value: &Value) -> Option<i64> {
    match value {
        Value::Int(number) => Some(*number),
        Value::Bool(flag) => Some(i64::from(*flag)),
        _ => None,
    }
}

fn is_text(value: &Value) -> bool {
    matches!(value, Value::Text(_))
}

/// Longer texts are refused, because a script in a loop could fill the memory.
const MAX_TEXT: usize = 64 * 1024;

fn concatenated(left: &Value, right: &Value) -> Option<Value> {
    if matches!(left, Value::Object(_)) || matches!(right, Value::Object(_)) {
        return None;
    }
    let text = format!("{left}{right}");
    (text.len() <= MAX_TEXT).then(|| Value::Text(text.into()))
}

/// Doubles this close are equal, as in BehaviorTree.CPP.
const CLOSE: f64 = f32::EPSILON as f64;

pub(super) fn compare(operator: Comparison, left: &Value, right: &Value) -> Result<bool, EvalError> {
    let (ordering, is_equal) = match (left, right) {
        (Value::Text(left), Value::Text(right)) => (Some(left.cmp(right)), left == right),
        _ => match (integer(left).zip(integer(right)), left.number().zip(right.number())) {
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
