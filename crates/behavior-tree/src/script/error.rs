//! Why an expression has no value.

use crate::values::value::Value;

/// Why an expression has no value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum EvalError {
    /// The key has no value yet.
    Empty(u32),
    /// The operator cannot be applied to a value.
    Misfit(&'static str, Value),
    /// The value is neither true nor false.
    NoCondition(Value),
    Overflow,
    /// A value does not fit the key it is assigned to.
    WrongType(u32, Value),
}

impl EvalError {
    /// The error in words. `keys` are the names of the keys, by slot.
    pub(crate) fn describe(&self, keys: &[String]) -> String {
        let name = |key: &u32| keys.get(*key as usize).map_or("?", String::as_str);
        match self {
            EvalError::Empty(key) => format!("key `{}` has no value yet", name(key)),
            EvalError::Misfit(operator, value) => format!("`{operator}` cannot be applied to {value:?}"),
            EvalError::NoCondition(value) => format!("{value:?} is neither true nor false"),
            EvalError::Overflow => "integer overflow".to_owned(),
            EvalError::WrongType(key, value) => format!("{value:?} cannot be assigned to key `{}`", name(key)),
        }
    }
}
