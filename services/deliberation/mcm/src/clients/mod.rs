//! The other processes as the manager sees them: what was asked, what is known, what to ask next.
//!
//! Each is a state machine fed by replies and events. None of them waits, and none knows a message: what arrives is
//! parsed before it comes here.

pub(crate) mod permissions;
pub(crate) mod planner;
pub(crate) mod skills;
