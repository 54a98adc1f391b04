//! What the mission manager and the planner were given, and what they decided: recorded, kept in a file, and given to the same nodes
//! again.
//!
//! A recording holds the files that were flown, so that it needs nothing else; every event with its time; and every decision, call and
//! answer as it was. A node reads no clock and no file, so the same events give the same decisions, unless the program has changed:
//! that is what a replay finds.

mod bytes;
mod content;
pub mod file;
mod recorded;
pub mod replay;

pub use content::{Entry, Header, Input};
pub use recorded::{Recorded, Sink, Tape};

/// The names of the tree files.
pub fn trees() -> impl Iterator<Item = &'static str> {
    ["mission.xml", "step.xml", "actions.xml"].into_iter()
}

/// The nodes that are recorded.
pub const RECORDED: [&str; 2] = ["mcm", "planner"];
