//! Stories over real processes: what happens, from the outside.

#[path = "../support/mod.rs"]
mod support;

mod bad_input;
mod bad_messages;
mod disturbances;
mod ends;
mod missions;
mod operators;
mod page;
mod telemetry;
