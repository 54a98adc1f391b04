//! Missions of the whole system, real processes, over a real ArduPilot Copter that speaks MAVLink.
//!
//! `KITTIWAKE_ARDUCOPTER=<path of an arducopter executable, as its own build left it> cargo test --test stories -- --ignored autopilots::` flies it, in
//! a network namespace of its own.

mod arducopter;
