//! The types of ports and keys.

use std::any::TypeId;
use std::fmt;

use super::object::Object;
use super::value::Value;

/// The type of a port or of a blackboard key.
#[derive(Clone, Copy)]
pub enum Type {
    /// Any type: the key's other users decide.
    Any,
    /// [`Value::Bool`].
    Bool,
    /// [`Value::Int`].
    Int,
    /// [`Value::Float`].
    Float,
    /// [`Value::Text`].
    Text,
    /// [`Value::Object`] of one Rust type.
    Object(ObjectType),
}

/// A type that the user defines.
#[derive(Clone, Copy)]
pub struct ObjectType {
    name: &'static str,
    id: TypeId,
    parse: fn(&str) -> Option<Value>,
}

impl ObjectType {
    /// The type `T`, whose constants `parse` reads.
    pub(crate) fn of<T: Object>(parse: fn(&str) -> Option<Value>) -> Self {
        ObjectType { name: T::NAME, id: TypeId::of::<T>(), parse }
    }
}

impl Type {
    /// The type of a constant. [`Type::Any`] for objects, which have no literals.
    pub(crate) fn of(value: &Value) -> Type {
        match value {
            Value::Bool(_) => Type::Bool,
            Value::Int(_) => Type::Int,
            Value::Float(_) => Type::Float,
            Value::Text(_) => Type::Text,
            Value::Object(_) => Type::Any,
        }
    }

    /// The name in models and messages: the C++ name, which Groot2 knows.
    pub const fn name(self) -> &'static str {
        match self {
            Type::Any => "any",
            Type::Bool => "bool",
            Type::Int => "int",
            Type::Float => "double",
            Type::Text => "std::string",
            Type::Object(object) => object.name,
        }
    }

    /// The type that a `TreeNodesModel` names, with the C++ types that fit into one of ours.
    pub(crate) fn named(name: &str) -> Type {
        match name {
            "bool" => Type::Bool,
            "int" | "int64_t" | "int32_t" | "unsigned" | "unsigned int" | "uint64_t" | "uint32_t" | "long" => Type::Int,
            "double" | "float" => Type::Float,
            "std::string" | "string" | "std::string_view" => Type::Text,
            _ => Type::Any,
        }
    }

    /// Whether a key or port of this type can hold `value`.
    pub(crate) fn accepts(self, value: &Value) -> bool {
        match (self, value) {
            (Type::Any, _)
            | (Type::Bool, Value::Bool(_))
            | (Type::Int, Value::Int(_))
            | (Type::Float, Value::Float(_))
            | (Type::Text, Value::Text(_)) => true,
            (Type::Object(object), Value::Object(value)) => object.id == value.as_any().type_id(),
            _ => false,
        }
    }

    /// Reads a constant of this type. [`Type::Any`] reads the narrowest type that fits.
    pub fn parse(self, text: &str) -> Option<Value> {
        let trimmed = text.trim();
        match self {
            Type::Any => {
                let number =
                    Type::Int.parse(text).or_else(|| Type::Float.parse(text).filter(|_| !is_infinity(trimmed)));
                Some(number.or_else(|| boolean_word(text)).unwrap_or_else(|| Value::Text(text.into())))
            }
            Type::Bool => match trimmed {
                "1" => Some(Value::Bool(true)),
                "0" => Some(Value::Bool(false)),
                _ => boolean_word(trimmed),
            },
            Type::Int => trimmed.parse().ok().map(Value::Int),
            Type::Float => {
                // An infinite limit is meaningful, a limit that is not a number never is.
                let number = trimmed.parse().ok().filter(|it: &f64| it.is_finite() || is_infinity(trimmed));
                number.map(Value::Float)
            }
            Type::Text => Some(Value::Text(text.into())),
            Type::Object(object) => (object.parse)(text),
        }
    }
}

fn is_infinity(text: &str) -> bool {
    matches!(text, "inf" | "+inf" | "-inf")
}

fn boolean_word(text: &str) -> Option<Value> {
    match text {
        "true" | "TRUE" | "True" => Some(Value::Bool(true)),
        "false" | "FALSE" | "False" => Some(Value::Bool(false)),
        _ => None,
    }
}

impl PartialEq for Type {
    fn eq(&self, other: &Type) -> bool {
        match (self, other) {
            (Type::Object(this), Type::Object(that)) => this.id == that.id,
            _ => std::mem::discriminant(self) == std::mem::discriminant(other),
        }
    }
}

impl fmt::Debug for Type {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
