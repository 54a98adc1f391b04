//! Values, their types, and the Rust types that stand for them.

pub(crate) mod object;
pub(crate) mod port_value;
pub(crate) mod types;
pub(crate) mod value;
