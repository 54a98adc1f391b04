//! The wire contract: every message, every topic, every service, and their canonical JSON.
//!
//! Messages are compiled from `proto/kittiwake/v1/*.proto`. [`topics`] is the one table of what
//! travels where and how. This crate knows nothing of any transport: `bus` does.

pub mod json;
pub mod schema;
pub mod topics;

/// Bytes that are shared, not copied.
pub use prost::bytes::Bytes;

/// The version of the exchange between the mission manager and the planner: see `PlanningBasis`. Either refuses another one.
pub const PLANNING_PROTOCOL: u32 = 4;

/// The messages, as compiled from the `.proto` files.
#[allow(missing_docs, clippy::all)]
pub mod v1 {
    include!(concat!(env!("OUT_DIR"), "/kittiwake.v1.rs"));
}
