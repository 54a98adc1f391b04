//! What survives what.

mod faults;
mod files;
mod flaky;
