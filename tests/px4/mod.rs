//! Missions of the whole system, real processes over real Zenoh: over the fake PX4, and over a real one if there is one.
//!
//! `KITTIWAKE_PX4=<path of a px4 executable> cargo test --test stories -- --ignored px4::` flies the real one too, in a network namespace of its own.

mod fake;
mod real;
pub mod support;
