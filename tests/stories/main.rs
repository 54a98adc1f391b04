//! Stories over real processes: what happens, from the outside.

#![expect(clippy::disallowed_methods, reason = "stories wait for real processes, up to a limit")]
#![expect(unreachable_pub, reason = "no other crate uses a test: here `pub` means outside of the module")]

#[path = "../support/mod.rs"]
mod support;

mod audit;
mod bad_input;
mod bad_messages;
mod changed_files;
mod chaos;
mod check;
mod composed;
mod crowd;
mod crowded_airspace;
mod deployment;
mod disturbances;
mod drop;
mod ends;
mod hung;
mod imported;
mod limits;
mod measured;
mod memory;
mod missions;
mod operate;
mod operators;
mod page;
mod page_fleet;
mod page_mission;
mod page_misuse;
mod page_orders;
mod page_people;
mod recordings;
mod remembered;
mod replay;
mod simulate;
mod sockets;
mod storm;
mod supervised;
mod telemetry;
mod tower;
mod when_done;
mod why;
