//! Tree files: BehaviorTree.CPP's XML, format 4.

pub(crate) mod element;
pub(crate) mod source;
mod write;
