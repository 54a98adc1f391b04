//! The autopilot's own failsafes, as a table: which cause overrides the intended mode, and with
//! which mode.
//!
//! Nothing is stored here: a cause that has ended no longer overrides, and the intended mode flies
//! again. That is how PX4 resumes offboard by itself when the setpoints return.

use crate::pilot::Mode;

/// Something that keeps the vehicle from flying as intended; the later, the worse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum FailsafeCause {
    /// Offboard is intended and its setpoints have stopped.
    OffboardLost,
    /// The charge is below the emergency limit.
    BatteryEmergency,
    /// At least one motor has failed.
    MotorFailed,
    /// The estimator does not know where the vehicle is.
    PositionLost,
    /// It hit the ground too hard to be used again.
    Crashed,
}

impl std::fmt::Display for FailsafeCause {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            FailsafeCause::OffboardLost => "the offboard setpoints are lost",
            FailsafeCause::BatteryEmergency => "the battery is nearly empty",
            FailsafeCause::MotorFailed => "a motor has failed",
            FailsafeCause::PositionLost => "the position is not known",
            FailsafeCause::Crashed => "the vehicle has crashed",
        })
    }
}

/// The mode that overrides the intended one.
fn response(cause: FailsafeCause) -> Mode {
    match cause {
        FailsafeCause::OffboardLost => Mode::Loiter,
        FailsafeCause::BatteryEmergency | FailsafeCause::MotorFailed => Mode::Land,
        FailsafeCause::PositionLost | FailsafeCause::Crashed => Mode::Descend,
    }
}

/// The mode to fly in place of `intended`, if `cause`, the worst there is, demands one. A vehicle
/// that is landing goes on landing unless it can no longer do even that.
pub(crate) fn pre_empt(intended: Mode, cause: Option<FailsafeCause>) -> Option<Mode> {
    let response = response(cause?);
    (intended != response).then_some(response)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_cause_has_its_response() {
        #[track_caller]
        fn check(intended: Mode, cause: Option<FailsafeCause>, expected: Option<Mode>) {
            assert_eq!(pre_empt(intended, cause), expected, "{intended:?} {cause:?}");
        }
        check(Mode::Offboard, None, None);
        check(Mode::Offboard, Some(FailsafeCause::OffboardLost), Some(Mode::Loiter));
        check(Mode::Offboard, Some(FailsafeCause::BatteryEmergency), Some(Mode::Land));
        check(Mode::Loiter, Some(FailsafeCause::MotorFailed), Some(Mode::Land));
        check(Mode::Land, Some(FailsafeCause::BatteryEmergency), None);
        check(Mode::Land, Some(FailsafeCause::PositionLost), Some(Mode::Descend));
    }

    #[test]
    fn the_worse_cause_wins() {
        assert!(FailsafeCause::PositionLost > FailsafeCause::BatteryEmergency);
        assert!(FailsafeCause::BatteryEmergency > FailsafeCause::OffboardLost);
    }
}
