//! Missions of the whole system, real processes, over a real ArduPilot Copter that speaks MAVLink.
//!
//! `KITTIWAKE_ARDUCOPTER=<path of an arducopter executable, as its own build left it> cargo test --test autopilots -- --ignored` flies it, in
//! a network namespace of its own.

#![expect(clippy::disallowed_methods, reason = "stories wait for real processes, up to a limit")]

mod arducopter;
#[path = "../px4/support.rs"]
mod support;
