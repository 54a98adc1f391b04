//! Rust types that ports carry.

use std::sync::Arc;

use super::object::{Object, ObjectValue};
use super::types::{ObjectType, Type};
use super::value::Value;

/// A Rust type that a port can carry.
///
/// Implemented for `bool`, the integers that fit into `i64`, `f64`, `f32`, `String`, `Arc<str>`, [`Value`] itself and
/// every [`Object`].
pub trait PortValue: Sized {
    /// The type that a port of this Rust type is declared with.
    fn port_type() -> Type;

    /// Reads a value. `None` if `value` has another type or does not fit.
    fn from_value(value: &Value) -> Option<Self>;

    /// Makes a value.
    fn into_value(self) -> Value;
}

impl<T: Object> PortValue for T {
    fn port_type() -> Type {
        Type::Object(ObjectType::of::<T>(|text| T::parse(text).map(T::into_value)))
    }

    fn from_value(value: &Value) -> Option<Self> {
        value.object::<T>().cloned()
    }

    fn into_value(self) -> Value {
        Value::Object(ObjectValue::new(self))
    }
}

impl PortValue for Value {
    fn port_type() -> Type {
        Type::Any
    }

    fn from_value(value: &Value) -> Option<Self> {
        Some(value.clone())
    }

    fn into_value(self) -> Value {
        self
    }
}

/// Implements [`PortValue`] for a Rust type that is carried as one variant of [`Value`].
macro_rules! port_value {
    ($rust:ty, $variant:ident, $held:ident => $read:expr, $rust_value:ident => $hold:expr) => {
        impl PortValue for $rust {
            fn port_type() -> Type {
                Type::$variant
            }

            fn from_value(value: &Value) -> Option<Self> {
                match value {
                    Value::$variant($held) => $read,
                    _ => None,
                }
            }

            fn into_value(self) -> Value {
                let $rust_value = self;
                Value::$variant($hold)
            }
        }

        impl From<$rust> for Value {
            fn from(value: $rust) -> Value {
                value.into_value()
            }
        }
    };
}

port_value!(bool, Bool, held => Some(*held), flag => flag);
port_value!(i64, Int, held => Some(*held), number => number);
port_value!(i32, Int, held => i32::try_from(*held).ok(), number => i64::from(number));
port_value!(u32, Int, held => u32::try_from(*held).ok(), number => i64::from(number));
port_value!(u16, Int, held => u16::try_from(*held).ok(), number => i64::from(number));
port_value!(u8, Int, held => u8::try_from(*held).ok(), number => i64::from(number));
port_value!(f64, Float, held => Some(*held), number => number);
port_value!(f32, Float, held => Some(*held as f32), number => f64::from(number));
port_value!(String, Text, held => Some(held.to_string()), text => text.into());
port_value!(Arc<str>, Text, held => Some(held.clone()), text => text);
