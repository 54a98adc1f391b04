//! Values on the blackboard, in ports and in records.

use std::any::TypeId;
use std::fmt;
use std::sync::Arc;

use crate::port_value::{AnyObject, Object};
use crate::types::Type;

/// A value on the blackboard, in a port or in a record.
///
/// Copying one never allocates: text and objects are shared.
#[derive(Clone)]
pub enum Value {
    /// `true` or `false`.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A real number.
    Float(f64),
    /// Text.
    Text(Arc<str>),
    /// A value of a type the user brought, see [`Object`].
    Object(ObjectValue),
}

/// A value of a user's type, shared.
#[derive(Clone)]
pub struct ObjectValue {
    pub(crate) value: Arc<dyn AnyObject>,
}

impl Value {
    /// The type of this value; never [`Type::Any`].
    pub fn value_type(&self) -> ValueType {
        match self {
            Value::Bool(_) => ValueType::Bool,
            Value::Int(_) => ValueType::Int,
            Value::Float(_) => ValueType::Float,
            Value::Text(_) => ValueType::Text,
            Value::Object(object) => {
                ValueType::Object { name: object.value.name(), id: object.value.as_any().type_id() }
            }
        }
    }

    /// Its type among those that a tree file can write.
    pub(crate) fn plain_type(&self) -> Type {
        match self {
            Value::Bool(_) => Type::Bool,
            Value::Int(_) => Type::Int,
            Value::Float(_) => Type::Float,
            Value::Text(_) => Type::Text,
            Value::Object(_) => Type::Any,
        }
    }

    /// The user's value inside, if it is one of type `T`.
    pub fn object<T: Object>(&self) -> Option<&T> {
        match self {
            Value::Object(object) => object.value.as_any().downcast_ref(),
            _ => None,
        }
    }

    /// Its value as a number, booleans counting as 0 and 1.
    pub fn number(&self) -> Option<f64> {
        match self {
            Value::Bool(it) => Some(f64::from(u8::from(*it))),
            Value::Int(it) => Some(*it as f64),
            Value::Float(it) => Some(*it),
            Value::Text(_) | Value::Object(_) => None,
        }
    }
}

/// The type of a value that exists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueType {
    /// [`Value::Bool`].
    Bool,
    /// [`Value::Int`].
    Int,
    /// [`Value::Float`].
    Float,
    /// [`Value::Text`].
    Text,
    /// [`Value::Object`].
    Object {
        /// [`Object::NAME`].
        name: &'static str,
        /// The Rust type.
        id: TypeId,
    },
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
            Value::Bool(it) => write!(f, "{it}"),
            Value::Int(it) => write!(f, "{it}"),
            Value::Float(it) => write!(f, "{it}"),
            Value::Text(it) => f.write_str(it),
            Value::Object(it) => it.value.show(f),
        }
    }
}

/// Objects are equal only to themselves: their types promise no comparison.
impl PartialEq for Value {
    fn eq(&self, other: &Value) -> bool {
        match (self, other) {
            (Value::Bool(this), Value::Bool(that)) => this == that,
            (Value::Int(this), Value::Int(that)) => this == that,
            (Value::Float(this), Value::Float(that)) => this == that,
            (Value::Text(this), Value::Text(that)) => this == that,
            (Value::Object(this), Value::Object(that)) => Arc::ptr_eq(&this.value, &that.value),
            _ => false,
        }
    }
}

impl From<&str> for Value {
    fn from(text: &str) -> Value {
        Value::Text(text.into())
    }
}
