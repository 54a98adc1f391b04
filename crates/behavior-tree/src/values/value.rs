//! Values on the blackboard, in ports and in records.

use std::fmt;
use std::sync::Arc;

use super::object::{Object, ObjectValue};

/// A value on the blackboard, in a port or in a record.
///
/// Cloning never allocates: text and objects are shared.
#[derive(Clone)]
pub enum Value {
    /// `true` or `false`.
    Bool(bool),
    /// An integer.
    Int(i64),
    /// A floating-point number.
    Float(f64),
    /// Text.
    Text(Arc<str>),
    /// A value of a type that the user defines, see [`Object`].
    Object(ObjectValue),
}

impl Value {
    /// The user's value inside, if it is of type `T`.
    pub fn object<T: Object>(&self) -> Option<&T> {
        match self {
            Value::Object(object) => object.as_any().downcast_ref(),
            _ => None,
        }
    }

    /// The value as a number. Booleans count as 0 and 1.
    pub fn number(&self) -> Option<f64> {
        match self {
            Value::Bool(flag) => Some(f64::from(u8::from(*flag))),
            Value::Int(number) => Some(*number as f64),
            Value::Float(number) => Some(*number),
            Value::Text(_) | Value::Object(_) => None,
        }
    }
}

impl fmt::Debug for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Text(text) => fmt::Debug::fmt(text, f),
            _ => fmt::Display::fmt(self, f),
        }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Bool(flag) => write!(f, "{flag}"),
            Value::Int(number) => write!(f, "{number}"),
            Value::Float(number) => write!(f, "{number}"),
            Value::Text(text) => f.write_str(text),
            Value::Object(object) => write!(f, "{object}"),
        }
    }
}

/// An object is equal only to itself and its clones, because [`Object`] asks for no comparison.
impl PartialEq for Value {
    fn eq(&self, other: &Value) -> bool {
        match (self, other) {
            (Value::Bool(this), Value::Bool(that)) => this == that,
            (Value::Int(this), Value::Int(that)) => this == that,
            (Value::Float(this), Value::Float(that)) => this == that,
            (Value::Text(this), Value::Text(that)) => this == that,
            (Value::Object(this), Value::Object(that)) => this.is_same(that),
            _ => false,
        }
    }
}

impl From<&str> for Value {
    fn from(text: &str) -> Value {
        Value::Text(text.into())
    }
}
