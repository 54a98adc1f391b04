//! PX4's modes (`nav_state`), and which mode of the vocabulary each is.

use domain::fmu::{Command, FlightMode};

/// PX4's number of a mode (`VehicleStatus.NAVIGATION_STATE_*`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NavState(pub u8);

impl NavState {
    /// Hold.
    pub const LOITER: NavState = NavState(4);
    /// Return.
    pub const RETURN: NavState = NavState(5);
    /// Descend without a position.
    pub const DESCEND: NavState = NavState(12);
    /// Follow setpoints.
    pub const OFFBOARD: NavState = NavState(14);
    /// Climb, then loiter.
    pub const TAKEOFF: NavState = NavState(17);
    /// Land.
    pub const LAND: NavState = NavState(18);
    /// Land precisely.
    pub const PRECISION_LAND: NavState = NavState(20);

    /// The mode that a command sets, if it sets one.
    pub fn of(command: Command) -> Option<NavState> {
        if command == Command::LandOnTarget {
            return Some(NavState::PRECISION_LAND);
        }
        Some(match command.mode()? {
            FlightMode::Loiter => NavState::LOITER,
            FlightMode::Takeoff => NavState::TAKEOFF,
            FlightMode::Land => NavState::LAND,
            FlightMode::Offboard => NavState::OFFBOARD,
            FlightMode::Return => NavState::RETURN,
        })
    }

    /// The mode in the vocabulary; `None` for one that has no name there, such as those of a pilot.
    pub fn mode(self) -> Option<FlightMode> {
        match self {
            NavState::LOITER => Some(FlightMode::Loiter),
            NavState::TAKEOFF => Some(FlightMode::Takeoff),
            NavState::LAND | NavState::DESCEND | NavState::PRECISION_LAND => Some(FlightMode::Land),
            NavState::OFFBOARD => Some(FlightMode::Offboard),
            NavState::RETURN => Some(FlightMode::Return),
            NavState(_) => None,
        }
    }

    /// Whether a command of ours can have set it.
    pub fn is_commandable(self) -> bool {
        use NavState as N;
        [N::LOITER, N::TAKEOFF, N::LAND, N::PRECISION_LAND, N::OFFBOARD].contains(&self)
    }

    /// Its name as PX4's users know it.
    pub fn name(self) -> &'static str {
        const NAMES: [&str; 31] = [
            "Manual",
            "Altitude",
            "Position",
            "Mission",
            "Hold",
            "Return",
            "Position Slow",
            "mode 7",
            "Altitude Cruise",
            "mode 9",
            "Acro",
            "mode 11",
            "Descend",
            "Termination",
            "Offboard",
            "Stabilized",
            "mode 16",
            "Takeoff",
            "Land",
            "Follow",
            "Precision Land",
            "Orbit",
            "VTOL Takeoff",
            "External 1",
            "External 2",
            "External 3",
            "External 4",
            "External 5",
            "External 6",
            "External 7",
            "External 8",
        ];
        NAMES.get(usize::from(self.0)).copied().unwrap_or("an unknown mode")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_command_sets_is_reported_as_the_mode_that_it_asked_for() {
        let takeoff = Command::Takeoff { height_m: 5.0 };
        for command in [takeoff, Command::Land, Command::LandOnTarget, Command::Loiter, Command::Offboard] {
            let state = NavState::of(command).unwrap_or_else(|| panic!("{command} sets a mode"));
            assert!(state.is_commandable());
            assert_eq!(state.mode(), command.mode());
        }
        assert_eq!(NavState::of(Command::Arm), None);
    }

    #[test]
    fn a_pilots_mode_has_no_name_and_a_blind_descent_is_a_landing() {
        assert_eq!((NavState(2).mode(), NavState(2).name()), (None, "Position"));
        assert_eq!(NavState::DESCEND.mode(), Some(FlightMode::Land));
        assert!(!NavState::RETURN.is_commandable());
        assert_eq!(NavState(31).name(), "an unknown mode");
    }
}
