//! The skill manager from outside: requests and telemetry in, commands and events out, on a virtual
//! clock.

mod autopilot;
mod contention;
mod every_outcome_reaches_the_caller;
mod others;
mod release;
mod skills;
mod support;
mod task;
