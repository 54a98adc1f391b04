//! Keys that are set from outside.

use crate::shape::Shape;
use crate::values::types::Type;
use crate::values::value::Value;

/// A key could not be set from outside.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SetError {
    /// The tree has no such key, or does not declare that it can be set.
    #[error("tree `{tree}` has no parameter or global `{key}`")]
    NoSuchKey {
        /// The tree.
        tree: String,
        /// The key.
        key: String,
    },
    /// The key has another type.
    #[error("key `{key}`: expected {declared:?}, found `{value}`")]
    WrongType {
        /// The key.
        key: String,
        /// Its type.
        declared: Type,
        /// The refused value.
        value: Value,
    },
}

/// Sets a parameter or global in `values`, which has a place for every slot of `shape`.
pub(crate) fn set(shape: &Shape, values: &mut [Option<Value>], key: &str, value: Value) -> Result<(), SetError> {
    let Some(slot) = shape.slot(key).filter(|slot| shape.slots[*slot].open) else {
        return Err(SetError::NoSuchKey { tree: shape.tree_id.to_string(), key: key.to_owned() });
    };
    let declared = shape.slots[slot].ty;
    if !declared.accepts(&value) {
        return Err(SetError::WrongType { key: key.to_owned(), declared, value });
    }
    values[slot] = Some(value);
    Ok(())
}
