//! Whole flights of the simulator, told in what it publishes: commands and setpoints in, telemetry
//! out, on a clock of the test's own.

mod determinism;
mod faults;
mod nominal;
mod offboard_loss;
mod rates;
mod refusals;
mod support;
mod tracking;
