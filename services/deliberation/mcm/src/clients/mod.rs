//! The other processes as the manager sees them: what was asked, what is known, and what to ask next.
//!
//! Each is a state machine fed by replies and events. None of them waits, and none handles a message it receives:
//! messages are parsed before they come here.

pub(crate) mod permissions;
pub(crate) mod planner;
pub(crate) mod skills;
