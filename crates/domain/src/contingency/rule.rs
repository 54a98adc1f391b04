//! What raises a flag: a fact about the vehicle that has held for a while.

use std::time::Duration;

use serde::Deserialize;

use crate::quantity::Positive;

/// A fact about the vehicle, evaluated by the monitor whenever data arrives.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "fact", deny_unknown_fields)]
pub enum Rule {
    /// A value is below a threshold.
    Below {
        /// Which value.
        value: Quantity,
        /// The threshold, in the value's unit.
        threshold: f64,
        /// The fact no longer holds from this value on; at or above the threshold, so that the flag does not flap.
        clear: f64,
        /// How long it must hold, in seconds of mission time.
        for_s: f64,
        /// In which situation it counts.
        during: During,
    },
    /// A value is above a threshold.
    Above {
        /// Which value.
        value: Quantity,
        /// The threshold, in the value's unit.
        threshold: f64,
        /// The fact no longer holds from this value on; at or below the threshold.
        clear: f64,
        /// How long it must hold, in seconds of mission time.
        for_s: f64,
        /// In which situation it counts.
        during: During,
    },
    /// The vehicle reports a condition.
    Reported {
        /// Which condition.
        condition: Condition,
        /// How long it must hold, in seconds of mission time.
        for_s: f64,
        /// In which situation it counts.
        during: During,
    },
    /// A source is stale.
    Stale {
        /// Which source.
        source: DataSource,
        /// For how long, in seconds; never less than one second of wall time.
        after_s: Positive,
        /// In which situation it counts.
        during: During,
    },
}

impl Rule {
    /// Whether it is raised by the silence of `source`.
    pub fn watches(&self, source: DataSource) -> bool {
        matches!(self, Rule::Stale { source: of_rule, .. } if *of_rule == source)
    }

    /// How long what it is about must last until it raises its flag.
    pub(super) fn raised_within(&self) -> Duration {
        match self {
            Rule::Below { for_s, .. } | Rule::Above { for_s, .. } | Rule::Reported { for_s, .. } => {
                Duration::try_from_secs_f64(*for_s).unwrap_or(Duration::MAX)
            }
            Rule::Stale { after_s, .. } => after_s.seconds(),
        }
    }

    /// Whether it is about what the battery holds.
    pub fn is_about_energy(&self) -> bool {
        use Quantity::{BatteryRemaining, BatteryVoltage};
        match self {
            Rule::Below { value, .. } | Rule::Above { value, .. } => matches!(value, BatteryRemaining | BatteryVoltage),
            Rule::Reported { condition, .. } => *condition == Condition::BatteryFailure,
            Rule::Stale { source, .. } => *source == DataSource::Battery,
        }
    }
}

/// In which situation a fact counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum During {
    /// At any time.
    Always,
    /// While the vehicle is armed.
    Armed,
    /// While it flies.
    Flying,
}

/// A value of the vehicle that a threshold can be set on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// Battery charge, 0 empty to 1 full.
    BatteryRemaining,
    /// Battery voltage, volts.
    BatteryVoltage,
    /// Battery temperature, degrees Celsius.
    BatteryTemperature,
    /// Horizontal standard deviation of the position, metres.
    HorizontalAccuracy,
    /// Vertical standard deviation of the position, metres.
    VerticalAccuracy,
    /// Height above the origin, metres.
    Height,
    /// Distance over ground from the origin, metres.
    DistanceHome,
    /// Speed over ground, metres per second.
    GroundSpeed,
    /// The fastest descent in the last seconds before the vehicle was on the ground, metres per second; 0 in the air.
    TouchdownSpeed,
    /// Angle between the thrust axis and the vertical, radians.
    Tilt,
}

impl Quantity {
    /// As the table has it.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::BatteryRemaining => "battery-remaining",
            Quantity::BatteryVoltage => "battery-voltage",
            Quantity::BatteryTemperature => "battery-temperature",
            Quantity::HorizontalAccuracy => "horizontal-accuracy",
            Quantity::VerticalAccuracy => "vertical-accuracy",
            Quantity::Height => "height",
            Quantity::DistanceHome => "distance-home",
            Quantity::GroundSpeed => "ground-speed",
            Quantity::TouchdownSpeed => "touchdown-speed",
            Quantity::Tilt => "tilt",
        }
    }
}

/// A condition that the vehicle itself reports, or that its reports show together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Condition {
    /// The estimator reports the position as invalid, or reports that it failed.
    EstimatorInvalid,
    /// The offboard proof of life was lost.
    OffboardSignalLost,
    /// Satellite navigation was lost.
    GnssLost,
    /// A motor failed.
    MotorFailure,
    /// The battery reports a fault.
    BatteryFailure,
    /// The link to the ground was lost.
    GroundLinkLost,
    /// The land detector says the opposite of what motors, height and speed show ([`crate::flight_state`]).
    LandDetectorContradicts,
    /// The autopilot would not arm, by its own checks. While it is armed it has.
    WouldNotArm,
    /// The autopilot flies something else than what was asked for, or one of its own failsafes.
    AutopilotPreempts,
}

impl Condition {
    /// As the table has it.
    pub fn name(self) -> &'static str {
        match self {
            Condition::EstimatorInvalid => "estimator-invalid",
            Condition::OffboardSignalLost => "offboard-signal-lost",
            Condition::GnssLost => "gnss-lost",
            Condition::MotorFailure => "motor-failure",
            Condition::BatteryFailure => "battery-failure",
            Condition::GroundLinkLost => "ground-link-lost",
            Condition::LandDetectorContradicts => "land-detector-contradicts",
            Condition::WouldNotArm => "would-not-arm",
            Condition::AutopilotPreempts => "autopilot-preempts",
        }
    }
}

/// A stream of data from the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
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
    /// The link to the ground, by the ground's heartbeat: it must arrive, and report that the vehicle is heard. Its
    /// limit is in seconds of wall time at every speed factor; a link that never existed cannot be lost.
    GroundLink,
    /// The heartbeats of the planner. A process that hangs sends none, like one that is gone. As for all processes the limit
    /// is in seconds of wall time.
    Planner,
    /// The heartbeats of the skill manager.
    SkillManager,
    /// The heartbeats of the mission manager.
    MissionManager,
    /// The ledger of the control tower, which it repeats at 1 Hz. Its limit is in seconds of wall time; a tower that was never heard
    /// cannot be lost.
    ControlTower,
}

impl DataSource {
    /// As the table has it.
    pub fn name(self) -> &'static str {
        match self {
            DataSource::Status => "status",
            DataSource::Attitude => "attitude",
            DataSource::LocalPosition => "local-position",
            DataSource::GlobalPosition => "global-position",
            DataSource::LandDetected => "land-detected",
            DataSource::Battery => "battery",
            DataSource::GroundLink => "ground-link",
            DataSource::Planner => "planner",
            DataSource::SkillManager => "skill-manager",
            DataSource::MissionManager => "mission-manager",
            DataSource::ControlTower => "control-tower",
        }
    }

    /// Whether it is the heartbeats of a process, not something that the vehicle says.
    pub fn is_process(self) -> bool {
        matches!(self, DataSource::Planner | DataSource::SkillManager | DataSource::MissionManager)
    }
}
