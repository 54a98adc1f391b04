//! Decides what the vehicle does next: flies the plan, replans when a step fails, answers every flag.
//!
//! One behavior tree (`config/trees/`) over a `World` of what is known. Events are taken in
//! as they come; after each batch the tree is ticked until no node asks for another tick at this moment, and only
//! then its requests are sent, so that "halt this" and "start that" of one decision leave together.
//! So the manager is a pure function of its inputs.
//!
//! It does not know how a flag is detected (the monitor does) nor how a skill is flown (the skill
//! manager does), and it never waits for either.

mod clients;
pub mod config;
mod decide;
mod flags;
mod journal;
mod leaves;
mod manager;
mod outbox;
mod permits;
mod repeats;
mod snapshot;
mod tick_time;
mod timing;
mod trees;
mod vehicle;
mod world;

pub use manager::Mcm;
pub use trees::{LoadedTrees, Trees, contingency_xml};
pub use world::persisted::UnusableState;

// The stories use this crate as others do, in the program of its unit tests: one program links faster than two.
#[cfg(test)]
extern crate self as mcm;
#[cfg(test)]
#[path = "../tests/stories.rs"]
mod stories;
