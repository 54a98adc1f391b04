//! The vocabulary of the `fmu/` topics: an autopilot's inputs and outputs, as checked types.
//!
//! It is the same for every autopilot. The skill manager commands with it, the monitor judges by it, and a backend (the
//! simulator, a bridge to a real autopilot) translates between it and the autopilot's own protocol. The conversions
//! from and to the messages are in [`mod@crate::wire`]; a value that came through them is in its range.
//!
//! What an autopilot does not know is left out and never replaced by a number: a mode without a name here is `None` in
//! [`Status`]; for a charge that is not measured (-1 in MAVLink) no [`Battery`] is sent; a land detector that is
//! undecided sends no [`LandDetected`]. The monitor then sees that the source is stale or absent.

mod command;
mod mode_observer;
mod offboard;
mod pre_emption;
mod telemetry;

pub use command::{Command, CommandAck, CommandId, CommandResult, VehicleCommand};
pub use mode_observer::{Author, ModeObserver, Seen, Taken};
pub use offboard::{OffboardControl, Setpoint};
pub use pre_emption::{PreEmption, Reported};
pub use telemetry::{
    Attitude, Battery, FailsafeReason, Failure, GlobalPosition, Gripper, LandDetected, LocalPosition, Status,
    TrafficKind, TransponderReport, Wind,
};

/// A flight mode, intended or actual.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FlightMode {
    /// Hold the position.
    Loiter,
    /// Climb to a height, then loiter.
    Takeoff,
    /// Descend to the ground.
    Land,
    /// Follow setpoints.
    Offboard,
    /// The autopilot's own return, flown only as one of its failsafes.
    Return,
}

impl FlightMode {
    /// Whether Kittiwake commands this mode. Any other, and one without a name here, is chosen by somebody else or by the autopilot.
    pub fn is_commanded(self) -> bool {
        self != FlightMode::Return
    }
}

/// The name as users read it.
impl std::fmt::Display for FlightMode {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            FlightMode::Loiter => "loiter",
            FlightMode::Takeoff => "takeoff",
            FlightMode::Land => "land",
            FlightMode::Offboard => "offboard",
            FlightMode::Return => "return",
        })
    }
}
