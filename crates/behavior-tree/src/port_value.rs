//! Rust types that ports carry.

use std::any::{Any, TypeId};
use std::fmt;
use std::sync::Arc;

use crate::types::{ObjectType, Type};
use crate::value::{ObjectValue, Value};

/// A Rust type that a port can carry.
///
/// Implemented for `bool`, the integers up to 64 bits, `f64`, `f32`, `String`, `Arc<str>`, [`Value`] itself and every
/// [`Object`].
pub trait PortValue: Sized {
    /// The type a port of this Rust type is declared with.
    fn port_type() -> Type;

    /// Reads it back; `None` if `value` is of another type or does not fit.
    fn from_value(value: &Value) -> Option<Self>;

    /// Makes a value of it.
    fn into_value(self) -> Value;
}

impl<T: Object> PortValue for T {
    fn port_type() -> Type {
        let parse = |text: &str| T::parse(text).map(T::into_value);
        Type::Object(ObjectType { name: T::NAME, id: TypeId::of::<T>(), parse })
    }

    fn from_value(value: &Value) -> Option<Self> {
        value.object::<T>().cloned()
    }

    fn into_value(self) -> Value {
        Value::Object(ObjectValue { value: Arc::new(self) })
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

macro_rules! port_value {
    ($rust:ty, $variant:ident, $value:ident => $read:expr, $this:ident => $make:expr) => {
        impl PortValue for $rust {
            fn port_type() -> Type {
                Type::$variant
            }

            fn from_value(value: &Value) -> Option<Self> {
                match value {
                    Value::$variant($value) => $read,
                    _ => None,
                }
            }

            fn into_value(self) -> Value {
                let $this = self;
                Value::$variant($make)
            }
        }

        impl From<$rust> for Value {
            fn from(it: $rust) -> Value {
                it.into_value()
            }
        }
    };
}

port_value!(bool, Bool, it => Some(*it), it => it);
port_value!(i64, Int, it => Some(*it), it => it);
port_value!(i32, Int, it => i32::try_from(*it).ok(), it => i64::from(it));
port_value!(u32, Int, it => u32::try_from(*it).ok(), it => i64::from(it));
port_value!(u16, Int, it => u16::try_from(*it).ok(), it => i64::from(it));
port_value!(u8, Int, it => u8::try_from(*it).ok(), it => i64::from(it));
port_value!(f64, Float, it => Some(*it), it => it);
port_value!(f32, Float, it => Some(*it as f32), it => f64::from(it));
port_value!(String, Text, it => Some(it.to_string()), it => it.into());
port_value!(Arc<str>, Text, it => Some(it.clone()), it => it);

/// A type of the user's that may travel through ports.
///
/// ```
/// #[derive(Clone, Debug)]
/// struct Waypoint { north: f64, east: f64 }
///
/// impl behavior_tree::Object for Waypoint {
///     const NAME: &'static str = "Waypoint";
///
///     /// `goal="12;4"` in a tree file.
///     fn parse(text: &str) -> Option<Self> {
///         let (north, east) = text.split_once(';')?;
///         Some(Waypoint { north: north.parse().ok()?, east: east.parse().ok()? })
///     }
/// }
/// ```
pub trait Object: Clone + fmt::Debug + Send + Sync + 'static {
    /// The name of the type in models, dumps and messages.
    const NAME: &'static str;

    /// Reads a constant written in a tree file; `None` refuses it.
    fn parse(_text: &str) -> Option<Self> {
        None
    }
}

/// An [`Object`] whose type is known only when it runs.
pub(crate) trait AnyObject: Any + Send + Sync {
    fn name(&self) -> &'static str;
    fn as_any(&self) -> &dyn Any;
    fn show(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result;
}

impl<T: Object> AnyObject for T {
    fn name(&self) -> &'static str {
        T::NAME
    }

    fn as_any(&self) -> &dyn Any {
        self
    }

    fn show(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self, f)
    }
}
