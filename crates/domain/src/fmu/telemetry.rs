//! The telemetry of an autopilot.

use super::FlightMode;
use crate::geometry::{Ned, NedVelocity};

/// What the autopilot does.
#[derive(Debug, Clone, PartialEq, Eq)]
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
    /// Drawn at present.
    pub current_a: f64,
    /// Charge left, 0 empty to 1 full.
    pub remaining: f64,
    /// Of the cells.
    pub temperature_c: f64,
}

/// The wind as estimated: the direction it blows to, averaged over some seconds of flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wind {
    /// Towards north.
    pub north_m_s: f64,
    /// Towards east.
    pub east_m_s: f64,
}

/// Another aircraft, as a transponder receiver reports it.
#[derive(Debug, Clone, PartialEq)]
pub struct TransponderReport {
    /// Names the aircraft; never empty.
    pub id: String,
    /// Where it is.
    pub position: Ned,
    /// How fast, and which way it flies.
    pub velocity: NedVelocity,
}

#[cfg(test)]
mod tests {
    use super::*;

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
