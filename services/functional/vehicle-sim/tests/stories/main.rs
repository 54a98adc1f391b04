//! Whole flights of the simulator, seen from outside: commands and setpoints in, telemetry out, on the
//! test's own clock.

mod determinism;
mod faults;
mod gripper;
mod nominal;
mod offboard_loss;
mod rates;
mod refusals;
mod support;
mod tracking;
