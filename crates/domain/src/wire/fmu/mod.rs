//! The messages of the `fmu/` topics, from and to [`crate::fmu`].

mod command;
mod offboard;
mod telemetry;

#[cfg(test)]
mod properties;
#[cfg(test)]
mod samples;
