//! Commands to the autopilot and their acknowledgements.

use std::fmt;

use super::FlightMode;

/// Names a command in its acknowledgement. Chosen by the sender.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct CommandId(pub u64);

/// A command with its id.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VehicleCommand {
    /// The acknowledgement echoes it.
    pub id: CommandId,
    /// What to do.
    pub command: Command,
}

/// What an autopilot can be commanded to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// Let the motors turn.
    Arm,
    /// Stop the motors.
    Disarm,
    /// Climb straight up, then loiter.
    Takeoff {
        /// Height above the origin at which the climb ends.
        height_m: f64,
    },
    /// Land where the vehicle is.
    Land,
    /// The same, on the target that its sensor sees there.
    LandOnTarget,
    /// Set the mode loiter: come to rest and stay there.
    Loiter,
    /// Set the mode offboard: follow the setpoints.
    Offboard,
    /// Open the gripper, so that the load falls. (MAVLink: `MAV_CMD_DO_GRIPPER` with `GRIPPER_ACTION_RELEASE`.)
    Release,
}

impl Command {
    /// The mode that it sets; `None` if it sets none.
    pub fn mode(self) -> Option<FlightMode> {
        match self {
            Command::Arm | Command::Disarm | Command::Release => None,
            Command::Takeoff { .. } => Some(FlightMode::Takeoff),
            Command::Land | Command::LandOnTarget => Some(FlightMode::Land),
            Command::Loiter => Some(FlightMode::Loiter),
            Command::Offboard => Some(FlightMode::Offboard),
        }
    }
}

/// The command as users read it: `takeoff to 10.0 m`.
impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Command::Arm => f.write_str("arm"),
            Command::Disarm => f.write_str("disarm"),
            Command::Takeoff { height_m } => write!(f, "takeoff to {height_m:.1} m"),
            Command::Land => f.write_str("land"),
            Command::LandOnTarget => f.write_str("land on the target"),
            Command::Loiter => f.write_str("loiter"),
            Command::Offboard => f.write_str("offboard"),
            Command::Release => f.write_str("release"),
        }
    }
}

/// The autopilot's acknowledgement of a command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommandAck {
    /// Which command.
    pub id: CommandId,
    /// Whether the autopilot took it.
    pub result: CommandResult,
}

/// Whether the autopilot took a command. That it happens is seen in the telemetry only.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CommandResult {
    /// Taken.
    Accepted,
    /// Not taken.
    Rejected {
        /// Why, for a human; may be empty.
        reason: String,
    },
}
