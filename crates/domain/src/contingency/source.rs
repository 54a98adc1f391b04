//! The streams of data whose silence is a field.

/// A stream of data that the monitor hears.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DataSource {
    /// `vehicle_status`.
    Status,
    /// `vehicle_attitude`.
    Attitude,
    /// `vehicle_local_position`.
    LocalPosition,
    /// `vehicle_global_position`.
    GlobalPosition,
    /// `vehicle_land_detected`.
    LandDetected,
    /// `battery_status`.
    Battery,
    /// The link to the ground, by the ground's heartbeat: it must arrive, and report that the vehicle is heard.
    GroundLink,
    /// The heartbeats of the planner. A process that hangs sends none, like one that is gone.
    Planner,
    /// The heartbeats of the skill manager.
    SkillManager,
    /// The heartbeats of the mission manager.
    MissionManager,
    /// The ledger of the control tower, which it repeats at 1 Hz.
    ControlTower,
}

impl DataSource {
    /// Whether its silence counts in wall time, however fast mission time runs.
    pub fn keeps_wall_time(self) -> bool {
        use DataSource::{ControlTower, GroundLink, MissionManager, Planner, SkillManager};
        matches!(self, GroundLink | ControlTower | Planner | SkillManager | MissionManager)
    }

    /// Whether a vehicle may fly without it from the beginning: what never existed cannot be lost.
    pub fn is_optional(self) -> bool {
        matches!(self, DataSource::GroundLink | DataSource::ControlTower)
    }
}
