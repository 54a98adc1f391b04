//! What a tree records: why nodes failed, errors of leaves, which statuses changed.

pub(crate) mod cause;
pub(crate) mod changes;
pub(crate) mod error;
pub(crate) mod failures;
