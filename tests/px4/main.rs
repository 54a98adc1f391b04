//! Missions of the whole system, real processes over real Zenoh: over the fake PX4, and over a real one if there is one.
//!
//! `KITTIWAKE_PX4=<path of a px4 executable> cargo test --test px4 -- --ignored` flies the real one too, in a network namespace of its own.

#![expect(clippy::disallowed_methods, reason = "stories wait for real processes, up to a limit")]

mod fake;
mod real;
mod support;
