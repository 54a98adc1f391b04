//! What a tree records: why nodes failed, what went wrong in leaves, which statuses changed.

pub(crate) mod cause;
pub(crate) mod changes;
pub(crate) mod error;
pub(crate) mod failures;
