//! The gripper, which has no sensor: a command counts as done after a time, and only its acknowledgement says so.

use std::time::Duration;

use domain::fmu::Command;
use domain::time::Time;

use crate::FakePx4;

/// `VEHICLE_CMD_DO_GRIPPER`.
pub(crate) const COMMAND: u64 = 211;
/// `PD_GRIPPER_TO`, by default.
const MOVES: Duration = Duration::from_secs(1);

const ACCEPTED: u8 = 0;
const TEMPORARILY_REJECTED: u8 = 1;
const FAILED: u8 = 4;
const IN_PROGRESS: u8 = 5;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Gripper {
    /// It is not enabled.
    Missing,
    Grabbed,
    /// It counts as open from then on, which is acknowledged to this system and component.
    Opens(Time, (f64, f64)),
    Released,
}

impl FakePx4 {
    /// A command to it, of which only the release is imitated.
    pub(crate) fn command_gripper(&mut self, action: f64, from: (f64, f64)) {
        assert_eq!(action, 0.0, "only the release is imitated");
        let result = match self.gripper {
            Gripper::Missing => FAILED,
            Gripper::Opens(..) => TEMPORARILY_REJECTED,
            Gripper::Released => ACCEPTED,
            Gripper::Grabbed => {
                self.order(Command::Release);
                self.gripper = Gripper::Opens(self.now + MOVES, from);
                IN_PROGRESS
            }
        };
        self.acknowledge(COMMAND, result, from);
    }

    pub(crate) fn move_gripper(&mut self) {
        if let Gripper::Opens(at, from) = self.gripper
            && at <= self.now
        {
            self.gripper = Gripper::Released;
            self.acknowledge(COMMAND, ACCEPTED, from);
        }
    }
}
