//! The telemetry of an autopilot.

use super::{FlightMode, Reported};
use crate::geodesy::Origin;
use crate::geometry::{Ned, NedVelocity};

/// What the autopilot does.
#[derive(Debug, Clone, PartialEq)]
pub struct Status {
    /// Whether the motors may turn.
    pub armed: bool,
    /// The mode that was asked for; `None`: one that has no name here.
    pub intended: Option<FlightMode>,
    /// The mode that is flown; `None`: one that has no name here. Differs from the intended one while the autopilot
    /// pre-empts.
    pub actual: Option<FlightMode>,
    /// Whether one of the autopilot's own failsafes flies.
    pub failsafe: bool,
    /// The failures that the autopilot reports. Those without a name here are left out.
    pub failures: Vec<Failure>,
    /// Where the local frame has its origin; `None` while the autopilot does not know. (PX4 takes the place at which its
    /// estimator first knew the position.)
    pub origin: Option<Origin>,
    /// What its gripper does; `None`: it has none, or does not report it.
    pub gripper: Option<Gripper>,
    /// During a landing on a target: whether the sensor sees it; `None` at all other times, and where the autopilot does not say.
    pub landing_target_seen: Option<bool>,
    /// The mode that is flown was chosen by somebody else, a pilot or another ground station, since Kittiwake last
    /// commanded one. A backend sets a mode before it arms, so that arming ends it. (No autopilot says so; a backend knows which modes it
    /// has commanded. One that was started again says what it sees from then on: who has heard the rest remembers it.)
    pub commanded_by_other: bool,
    /// Why the autopilot flies a mode that was not asked for, or would not arm, in its own words; empty where it does not
    /// say.
    pub reason: String,
    /// Whether it would arm now; `None` where it does not say.
    pub can_arm: Option<bool>,
    /// Changes whenever the autopilot was started again or its local frame moved: positions before and after it cannot be
    /// compared. (PX4: counters of resets; a clock since boot that goes back.)
    pub frame_epoch: u64,
    /// How much the frame shakes, as the standard deviation of the accelerometer's fast part in m/s2; `None` where it is not measured.
    /// (PX4: `accel_vibration_metric`; MAVLink: `VIBRATION`.)
    pub vibration_m_s2: Option<f64>,
    /// Why a failsafe flies; `None` where the autopilot does not say. (PX4 keeps some failsafes until the mode is changed, though what
    /// they were for is over: its flags do not tell.)
    pub failsafe_reason: Option<FailsafeReason>,
    /// When the autopilot made this statement, in microseconds since its start; 0 where it does not say. (PX4: `timestamp` of
    /// `vehicle_status`; a MAVLink `HEARTBEAT` has none.)
    pub timestamp_us: u64,
}

/// Why one of the autopilot's own failsafes flies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FailsafeReason {
    /// Offboard setpoints are missed, and nothing else.
    Setpoints,
    /// Another reason, whether or not setpoints are missed as well.
    Other,
}

impl Status {
    /// Whether it shows that a pilot or another ground station flies: the motors may turn, and either the backend says that somebody else has
    /// chosen the mode, or the mode is one that Kittiwake never commands. (The second half is for a backend that was started again in
    /// flight, and does not know who commanded what. A mode that Kittiwake commands, too, then counts as its own.)
    pub fn is_flown_by_other(&self) -> bool {
        self.armed && (self.commanded_by_other || !self.intended.is_some_and(FlightMode::is_commanded))
    }

    /// What it says about who flies.
    pub fn reported(&self) -> Reported {
        let Status { failsafe, intended, actual, failsafe_reason: reason, .. } = *self;
        let signal_lost = self.failures.contains(&Failure::OffboardSignalLost);
        Reported { failsafe, intended, actual, signal_lost, reason }
    }

    /// Whether it says once more, with the same time, what the `earlier` one says of the motors and the mode. (A backend may have added to
    /// the rest what it knows by itself.) One of an autopilot that tells no time is always a new one.
    pub fn repeats(&self, earlier: &Status) -> bool {
        let of_autopilot = |it: &Status| (it.timestamp_us, it.armed, it.intended, it.actual, it.failsafe);
        self.timestamp_us != 0 && of_autopilot(self) == of_autopilot(earlier)
    }

    /// Since when this is known, if it is heard `now` and the newest one was `before`.
    pub fn known_since<T: Copy>(&self, now: T, before: Option<&(T, Status)>) -> T {
        before.filter(|(_, earlier)| self.repeats(earlier)).map_or(now, |(since, _)| *since)
    }
}

/// What a gripper that carries a load does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Gripper {
    /// It holds a load.
    Holding,
    /// It is open, and holds none.
    Released,
    /// There may be one: what it does is known once it has acknowledged a command, which it does after it has moved.
    Silent,
}

/// As users read it.
impl std::fmt::Display for Gripper {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Gripper::Holding => "holds its load",
            Gripper::Released => "is open",
            Gripper::Silent => "does not say that it has opened",
        })
    }
}

/// A failure that the autopilot reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// Offboard is intended and its setpoints have stopped.
    OffboardSignalLost,
    /// No satellite navigation.
    GnssLost,
    /// The position estimate is invalid.
    Estimator,
    /// A motor has failed.
    Motor,
    /// The battery is critical or faulty.
    Battery,
    /// The ground station is not heard.
    GroundLinkLost,
}

/// The vehicle's attitude and turn rates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attitude {
    /// Rotation from the body frame (forward, right, down) to NED as a quaternion of length 1, Hamilton convention.
    pub q_w: f64,
    /// Its first imaginary part.
    pub q_x: f64,
    /// Its second imaginary part.
    pub q_y: f64,
    /// Its third imaginary part.
    pub q_z: f64,
    /// Turn rate about the body's forward axis.
    pub roll_rate_rad_s: f64,
    /// Turn rate about the body's right axis.
    pub pitch_rate_rad_s: f64,
    /// Turn rate about the body's down axis.
    pub yaw_rate_rad_s: f64,
}

impl Attitude {
    /// Where the nose points, from north over east, -pi to pi.
    pub fn heading_rad(&self) -> f64 {
        let (sin, cos) = (self.q_w * self.q_z + self.q_x * self.q_y, self.q_y * self.q_y + self.q_z * self.q_z);
        (2.0 * sin).atan2(1.0 - 2.0 * cos)
    }

    /// The angle between the body's down axis and the local one.
    pub fn tilt_rad(&self) -> f64 {
        let (upright, sideways) =
            (self.q_w * self.q_w + self.q_z * self.q_z, self.q_x * self.q_x + self.q_y * self.q_y);
        2.0 * sideways.sqrt().atan2(upright.sqrt())
    }
}

/// The vehicle's position in the local frame, and its velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalPosition {
    /// Where.
    pub position: Ned,
    /// How fast, and which way.
    pub velocity: NedVelocity,
    /// Where the nose points, from north over east.
    pub heading_rad: f64,
    /// Whether the estimator reports the horizontal part as valid.
    pub horizontal_valid: bool,
    /// Whether the estimator reports the vertical part as valid.
    pub vertical_valid: bool,
    /// One standard deviation, horizontal.
    pub eph_m: f64,
    /// One standard deviation, vertical.
    pub epv_m: f64,
    /// When it was measured, in microseconds of the vehicle's own clock.
    pub timestamp_us: u64,
}

impl LocalPosition {
    /// Whether it measures the same as `earlier`, as an estimate does not that lives. The estimator's trust in itself may change while its
    /// input stands still.
    pub fn repeats(&self, earlier: &LocalPosition) -> bool {
        self.position == earlier.position && self.velocity == earlier.velocity
    }
}

/// The vehicle's position on the globe, WGS 84.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GlobalPosition {
    /// North is positive.
    pub latitude_deg: f64,
    /// East is positive.
    pub longitude_deg: f64,
    /// Above mean sea level.
    pub altitude_amsl_m: f64,
    /// One standard deviation, horizontal.
    pub eph_m: f64,
    /// One standard deviation, vertical.
    pub epv_m: f64,
}

/// The land detector's statement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LandDetected {
    /// The vehicle is on the ground.
    pub landed: bool,
    /// The vehicle touches the ground; a landing begins with it.
    pub ground_contact: bool,
    /// When it was detected, in microseconds of the vehicle's own clock.
    pub timestamp_us: u64,
}

/// The state of the battery.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Battery {
    /// At the terminals.
    pub voltage_v: f64,
    /// Drawn at present; `None` where it is not measured.
    pub current_a: Option<f64>,
    /// Charge left, 0 empty to 1 full.
    pub remaining: f64,
    /// Of the cells; `None` where it is not measured.
    pub temperature_c: Option<f64>,
}

/// The wind as estimated: the direction it blows to, averaged over some seconds of flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wind {
    /// Towards north.
    pub north_m_s: f64,
    /// Towards east.
    pub east_m_s: f64,
}

/// What a transponder is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TrafficKind {
    /// An aircraft with people in it, or one of which it is not known.
    Crewed,
    /// An aircraft without.
    Uncrewed,
    /// A ship or a boat.
    Vessel,
}

/// Other traffic, as a transponder receiver reports it.
#[derive(Debug, Clone, PartialEq)]
pub struct TransponderReport {
    /// Names the aircraft or the vessel; never empty.
    pub id: String,
    /// Where it is.
    pub position: Ned,
    /// How fast, and which way it flies.
    pub velocity: NedVelocity,
    /// What it is.
    pub kind: TrafficKind,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn somebody_else_flies_by_what_the_backend_says_or_in_a_mode_that_is_never_commanded() {
        #[track_caller]
        fn check(armed: bool, commanded_by_other: bool, intended: Option<FlightMode>, expected: bool) {
            let status = Status::from(kittiwake_proto::v1::VehicleStatus::default());
            let status = Status { armed, commanded_by_other, intended, ..status };
            assert_eq!(status.is_flown_by_other(), expected, "{intended:?}");
        }
        use FlightMode::{Land, Loiter, Offboard, Return, Takeoff};
        for mode in [Loiter, Takeoff, Land, Offboard] {
            check(true, false, Some(mode), false);
            check(true, true, Some(mode), true);
            check(false, true, Some(mode), false);
        }
        for mode in [Some(Return), None] {
            check(true, false, mode, true);
            check(false, false, mode, false);
        }
    }

    #[test]
    fn tilt_is_the_angle_from_upright_whatever_the_heading() {
        #[track_caller]
        fn check([q_w, q_x, q_y, q_z]: [f64; 4], expected_deg: f64) {
            let (roll_rate_rad_s, pitch_rate_rad_s, yaw_rate_rad_s) = (0.0, 0.0, 0.0);
            let attitude = Attitude { q_w, q_x, q_y, q_z, roll_rate_rad_s, pitch_rate_rad_s, yaw_rate_rad_s };
            let tilt_deg = attitude.tilt_rad().to_degrees();
            assert!((tilt_deg - expected_deg).abs() < 1e-9, "{tilt_deg}");
        }
        let half = std::f64::consts::FRAC_1_SQRT_2;
        check([1.0, 0.0, 0.0, 0.0], 0.0);
        check([half, 0.0, 0.0, half], 0.0);
        check([half, half, 0.0, 0.0], 90.0);
        check([0.0, 0.0, 1.0, 0.0], 180.0);
        check([0.5, 0.5, 0.5, 0.5], 90.0);
        check([0.99_f64.sqrt(), 0.0, 0.1, 0.0], 2.0 * 0.1_f64.asin().to_degrees());
    }
}
