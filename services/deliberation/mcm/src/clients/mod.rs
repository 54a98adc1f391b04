//! The other processes as the tree sees them: what was asked, what is known, what to ask next.
//!
//! Each is a small state machine fed by replies and events. None of them waits.

pub(crate) mod permissions;
pub(crate) mod planner;
pub(crate) mod skills;
