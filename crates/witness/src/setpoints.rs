//! Whether the vehicle flies offboard after a setpoint that is too old.

use std::time::Duration;

use domain::time::Time;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;

/// The vehicle flew offboard without a fresh setpoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StaleSetpoint {
    /// When the vehicle said so.
    pub at: Time,
    /// Since the newest setpoint, or since it flies offboard if that is later.
    pub age: Duration,
}

/// Sees how old the newest setpoint is whenever the vehicle says that it flies offboard. A vehicle that is silent is not judged.
#[derive(Debug)]
pub struct Setpoints {
    limit: Duration,
    newest: Option<Time>,
    offboard_from: Option<Time>,
    is_reported: bool,
    stale: Vec<StaleSetpoint>,
}

impl Setpoints {
    /// For a vehicle that must leave offboard at the latest when its setpoint is as old as `limit`.
    pub fn of(limit: Duration) -> Setpoints {
        Setpoints { limit, newest: None, offboard_from: None, is_reported: false, stale: Vec::new() }
    }

    /// A message passes by at this time.
    pub fn take_in(&mut self, at: Time, message: &Message) {
        match message {
            Message::TrajectorySetpoint(_) => (self.newest, self.is_reported) = (Some(at), false),
            Message::VehicleStatus(it) => {
                let is_offboard = it.armed && it.actual_mode() == v1::FlightMode::Offboard;
                self.offboard_from = is_offboard.then(|| self.offboard_from.unwrap_or(at));
                let Some(from) = self.offboard_from else { return };
                let age = at - self.newest.map_or(from, |newest| newest.max(from));
                if self.limit < age && !self.is_reported {
                    self.is_reported = true;
                    self.stale.push(StaleSetpoint { at, age });
                }
            }
            _ => {}
        }
    }

    /// Each time that it was too old, once until the next setpoint, in order.
    pub fn stale(&self) -> &[StaleSetpoint] {
        &self.stale
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v1::FlightMode::{Loiter, Offboard};

    fn at(ms: u64) -> Time {
        Time::after(Duration::from_millis(ms))
    }

    fn status(mode: v1::FlightMode) -> Message {
        v1::VehicleStatus { armed: true, actual_mode: mode.into(), ..Default::default() }.into()
    }

    #[test]
    fn a_setpoint_is_too_old_only_while_the_vehicle_flies_offboard() {
        let mut setpoints = Setpoints::of(Duration::from_secs(2));
        let setpoint = Message::from(v1::TrajectorySetpoint::default());
        setpoints.take_in(at(0), &setpoint);
        setpoints.take_in(at(5_000), &status(Loiter));
        setpoints.take_in(at(6_000), &status(Offboard));
        setpoints.take_in(at(8_000), &status(Offboard));
        assert!(setpoints.stale().is_empty(), "as long as it may be, since it flies offboard");
        setpoints.take_in(at(8_500), &status(Offboard));
        setpoints.take_in(at(9_000), &status(Offboard));
        let first = StaleSetpoint { at: at(8_500), age: Duration::from_millis(2_500) };
        assert_eq!(setpoints.stale(), [first], "once");
        setpoints.take_in(at(9_500), &setpoint);
        setpoints.take_in(at(11_500), &status(Offboard));
        assert_eq!(setpoints.stale().len(), 1);
        setpoints.take_in(at(12_000), &status(Offboard));
        assert_eq!(setpoints.stale().len(), 2);
        setpoints.take_in(at(12_100), &status(Loiter));
        setpoints.take_in(at(20_000), &status(Loiter));
        assert_eq!(setpoints.stale().len(), 2, "it has left offboard");
    }
}
