//! The wire contract: every message, every topic, every service, and their canonical JSON.
//!
//! Messages are compiled from `proto/kittiwake/v1/*.proto`. [`topics`] is the one table of what
//! travels where and how. This crate knows nothing of any transport: `bus` does.

pub mod json;
pub mod schema;
pub mod topics;

/// The messages, as compiled from the `.proto` files.
#[allow(missing_docs, clippy::all)]
pub mod v1 {
    include!(concat!(env!("OUT_DIR"), "/kittiwake.v1.rs"));
}
