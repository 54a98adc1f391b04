//! The simulator's parameters. The shipped values are in the configuration file; there are no
//! defaults in the code.

mod origin;

use std::num::NonZeroU8;

use domain::quantity::{Fraction, Positive};
use serde::Deserialize;

/// Everything about the simulated vehicle.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Offboard setpoints older than this count as lost (PX4: `COM_OF_LOSS_T`). A machine limit.
    pub offboard_loss_s: Positive,
    /// A vehicle that is armed on the ground and does not take off disarms itself after this time
    /// (PX4: `COM_DISARM_PRFLT`). A machine limit, since the takeoff command comes over the wire.
    pub preflight_disarm_s: Positive,
    /// From the landing until the vehicle disarms itself (PX4: `COM_DISARM_LAND`).
    pub landed_disarm_s: Positive,
    /// With the landing site blocked, a landing stops at this height above the ground.
    pub blocked_site_height_m: Positive,
    /// Where the local frame has its origin.
    pub origin: Origin,
    /// The autopilot's limits.
    pub limits: Limits,
    /// The vehicle's body.
    pub airframe: Airframe,
    /// The battery.
    pub battery: Battery,
    /// The gripper.
    pub gripper: Gripper,
    /// Errors of the position estimate.
    pub estimator: Estimator,
    /// Rates of the telemetry.
    pub rates: Rates,
}

/// The origin of the local frame, WGS 84.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Origin {
    /// Geodetic latitude; not at the poles, where east has no direction.
    pub latitude_deg: Within<-89, 89>,
    /// Longitude.
    pub longitude_deg: Within<-180, 180>,
    /// Above mean sea level, which is taken for the ellipsoid.
    pub altitude_amsl_m: Within<-500, 9000>,
    /// Where a mission has an origin, the vehicle stands there instead.
    pub at_mission_origin: bool,
}

/// Speeds, accelerations and angles that the autopilot does not exceed; PX4's parameter in brackets.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Fastest over ground (`MPC_XY_VEL_MAX`).
    pub cruise_m_s: Positive,
    /// Fastest upwards (`MPC_Z_VEL_MAX_UP`).
    pub climb_m_s: Positive,
    /// Fastest downwards (`MPC_Z_VEL_MAX_DN`).
    pub descend_m_s: Positive,
    /// Upwards in the takeoff mode (`MPC_TKO_SPEED`).
    pub takeoff_m_s: Positive,
    /// From no thrust to the takeoff speed (`MPC_TKO_RAMP_T`).
    pub takeoff_ramp_s: Positive,
    /// From arming to motors that can lift (`COM_SPOOLUP_TIME`).
    pub spool_up_s: Positive,
    /// Downwards in the last part of a landing (`MPC_LAND_SPEED`).
    pub land_m_s: Positive,
    /// A landing slows down below this height (`MPC_LAND_ALT1`).
    pub land_slow_from_m: Positive,
    /// Below this height a landing has its final speed (`MPC_LAND_ALT2`).
    pub land_slow_below_m: Positive,
    /// Over ground (`MPC_ACC_HOR_MAX`).
    pub acceleration_m_s2: Positive,
    /// Up and down (`MPC_ACC_DOWN_MAX`).
    pub vertical_acceleration_m_s2: Positive,
    /// How fast an acceleration may change.
    pub jerk_m_s3: Positive,
    /// Steepest tilt (`MPC_TILTMAX_AIR`).
    pub tilt_deg: Within<1, 80>,
    /// Fastest turn (`MPC_YAWRAUTO_MAX`).
    pub turn_deg_s: Positive,
}

/// The body of the vehicle.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Airframe {
    /// Take-off mass.
    pub mass_kg: Positive,
    /// Full thrust over weight; a vehicle with 1 or less never flies.
    pub thrust_to_weight: Positive,
    /// Deceleration by air resistance per m/s of airspeed.
    pub linear_drag_1_s: Positive,
    /// Deceleration by air resistance per (m/s)^2 of airspeed.
    pub quadratic_drag_1_m: Positive,
    /// Time constant of the thrust.
    pub motor_lag_s: Positive,
    /// Time constant of the body rates.
    pub rate_lag_s: Positive,
    /// Body rate per radian of tilt error (`MC_ROLL_P`).
    pub attitude_gain_1_s: Positive,
}

/// The battery and its consumers.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Battery {
    /// Cells in series.
    pub cells: NonZeroU8,
    /// Energy when full.
    pub capacity_wh: Positive,
    /// Open-circuit voltage of a full cell (`BAT1_V_CHARGED`).
    pub cell_full_v: Positive,
    /// Open-circuit voltage of an empty cell (`BAT1_V_EMPTY`).
    pub cell_empty_v: Positive,
    /// Internal resistance of the pack, which makes the voltage sag.
    pub resistance_ohm: Positive,
    /// Power to hover in still air.
    pub hover_w: Positive,
    /// Power while the motors stand still.
    pub idle_w: Positive,
    /// Below this the autopilot reports a failure (`BAT_CRIT_THR`).
    pub critical: Fraction,
    /// Below this the autopilot lands (`BAT_EMERGEN_THR`).
    pub emergency: Fraction,
    /// Temperature of the air.
    pub ambient_c: Within<-60, 60>,
    /// Heat shed per degree above the air's temperature.
    pub cooling_w_k: Positive,
    /// Heat that warms the pack by one degree.
    pub heat_capacity_j_k: Positive,
}

/// The gripper and its load.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gripper {
    /// Whether it holds a load at the start; it holds at most one.
    pub holds_load: bool,
    /// From the command until it is open.
    pub opens_in_s: Positive,
}

/// Errors of the position estimate.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Estimator {
    /// White noise of each published coordinate, standard deviation.
    pub position_noise_m: Positive,
    /// White noise of each published velocity component, standard deviation.
    pub velocity_noise_m_s: Positive,
    /// Slow wander of the estimate, standard deviation.
    pub wander_m: Positive,
    /// Horizontal standard deviation reported while all is well.
    pub eph_m: Positive,
    /// Vertical standard deviation reported while all is well.
    pub epv_m: Positive,
    /// Above this the estimator does not vouch for the horizontal position (`COM_POS_FS_EPH`).
    pub eph_limit_m: Positive,
    /// Growth of the horizontal deviation without satellites.
    pub dead_reckoning_m_s: Positive,
}

/// Rate of each topic, in Hz of wall time: the reference's table 4.1, and 1 Hz for traffic. All are
/// sent in step with the fastest, the attitude.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rates {
    /// The status, which is also sent on every change.
    pub vehicle_status: Positive,
    /// The attitude; no other rate is higher.
    pub vehicle_attitude: Positive,
    /// Position in the local frame.
    pub vehicle_local_position: Positive,
    /// Position on the globe.
    pub vehicle_global_position: Positive,
    /// The land detector, which also reports every change.
    pub vehicle_land_detected: Positive,
    /// Voltage, current, charge, temperature.
    pub battery_status: Positive,
    /// Other aircraft, one report each.
    pub transponder_report: Positive,
    /// The wind as the estimator has it.
    pub wind: Positive,
}

/// A number from `LO` to `HI`, both included.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "f64")]
pub struct Within<const LO: i32, const HI: i32>(f64);

impl<const LO: i32, const HI: i32> Within<LO, HI> {
    /// The number.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl<const LO: i32, const HI: i32> TryFrom<f64> for Within<LO, HI> {
    type Error = String;
    fn try_from(value: f64) -> Result<Self, String> {
        if (f64::from(LO)..=f64::from(HI)).contains(&value) {
            Ok(Within(value))
        } else {
            Err(format!("found {value}, expected a number from {LO} to {HI}"))
        }
    }
}

#[cfg(test)]
pub mod shipped {
    //! The shipped values, for tests.

    use super::Config;

    const TEXT: &str = include_str!("../tests/vehicle-sim.toml");

    #[derive(serde::Deserialize)]
    struct File {
        vehicle_sim: Config,
    }

    /// The shipped values, or why `text` in place of them is refused.
    pub fn parse(text: &str) -> Result<Config, String> {
        toml::from_str::<File>(text).map(|it| it.vehicle_sim).map_err(|it| it.to_string())
    }

    /// The shipped values.
    pub fn config() -> Config {
        parse(TEXT).unwrap()
    }

    #[test]
    fn a_bad_value_is_refused_with_its_line() {
        #[track_caller]
        fn check(good: &str, bad: &str, expected: &[&str]) {
            assert!(TEXT.contains(good));
            let refused = parse(&TEXT.replacen(good, bad, 1)).unwrap_err();
            for part in expected {
                assert!(refused.contains(part), "{refused}");
            }
        }
        check("latitude_deg = 54.0", "latitude_deg = nan", &["line 16", "found NaN", "from -89 to 89"]);
        check("at_mission_origin = true\n", "", &["missing field `at_mission_origin`"]);
        check("critical = 0.07", "critical = 7", &["found 7", "a fraction from 0 to 1"]);
        check("cells = 6", "cells = 0", &["cells"]);
        check("cruise_m_s = 12.0", "cruise = 12.0", &["unknown field `cruise`"]);
        check("cruise_m_s = 12.0\n", "", &["missing field `cruise_m_s`"]);
    }
}
