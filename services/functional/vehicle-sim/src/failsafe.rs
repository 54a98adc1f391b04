//! The autopilot's own last resorts, as a table: which condition overrides the intended mode, and
//! with what.
//!
//! Nothing here remembers: a condition that is gone no longer overrides, and the intended mode
//! flies again. That is how PX4 resumes offboard by itself when the setpoints return.

use crate::pilot::Mode;

/// Something that keeps the vehicle from flying as intended; the later, the worse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Condition {
    /// Offboard is intended and its setpoints have stopped.
    OffboardLost,
    /// The charge is below the emergency limit.
    BatteryEmergency,
    /// One motor is gone, or more.
    MotorFailed,
    /// Nobody knows where the vehicle is.
    PositionLost,
    /// It hit the ground too hard to be used again.
    Crashed,
}

impl std::fmt::Display for Condition {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Condition::OffboardLost => "the offboard setpoints are lost",
            Condition::BatteryEmergency => "the battery is nearly empty",
            Condition::MotorFailed => "a motor has failed",
            Condition::PositionLost => "the position is not known",
            Condition::Crashed => "the vehicle has crashed",
        })
    }
}

/// The mode that overrides the intended one under `condition`.
fn response(condition: Condition) -> Mode {
    match condition {
        Condition::OffboardLost => Mode::Loiter,
        Condition::BatteryEmergency | Condition::MotorFailed => Mode::Land,
        Condition::PositionLost | Condition::Crashed => Mode::Descend,
    }
}

/// The mode to fly in place of `intended`, if `condition`, the worst there is, demands one. A
/// vehicle that is landing anyway is left to it unless it can no longer do even that.
pub fn pre_empt(intended: Mode, condition: Option<Condition>) -> Option<Mode> {
    let response = response(condition?);
    (intended != response).then_some(response)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_condition_has_its_response() {
        #[track_caller]
        fn check(intended: Mode, condition: Option<Condition>, expected: Option<Mode>) {
            assert_eq!(pre_empt(intended, condition), expected, "{intended:?} {condition:?}");
        }
        check(Mode::Offboard, None, None);
        check(Mode::Offboard, Some(Condition::OffboardLost), Some(Mode::Loiter));
        check(Mode::Offboard, Some(Condition::BatteryEmergency), Some(Mode::Land));
        check(Mode::Loiter, Some(Condition::MotorFailed), Some(Mode::Land));
        check(Mode::Land, Some(Condition::BatteryEmergency), None);
        check(Mode::Land, Some(Condition::PositionLost), Some(Mode::Descend));
    }

    #[test]
    fn what_is_worse_wins() {
        assert!(Condition::PositionLost > Condition::BatteryEmergency);
        assert!(Condition::BatteryEmergency > Condition::OffboardLost);
    }
}
