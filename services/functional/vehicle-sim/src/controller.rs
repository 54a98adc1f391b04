//! From the demanded velocity to the thrust that achieves it: the inner half of PX4's cascade, with its
//! default gains.
//!
//! It knows neither modes nor setpoints (see [`crate::pilot`]) nor the true state (see
//! [`crate::multirotor`]), only the estimate.

use nalgebra::Vector3;

use crate::config::Limits;
use crate::frame::{horizontal, wrapped};
use crate::multirotor::{Controls, GRAVITY_M_S2};

/// Acceleration per velocity error, 1/s (`MPC_XY_VEL_P_ACC`, `MPC_Z_VEL_P_ACC`).
const VELOCITY_GAIN: Vector3<f64> = Vector3::new(1.8, 1.8, 4.0);
/// Acceleration per integrated velocity error, 1/s^2 (`MPC_XY_VEL_I_ACC`, `MPC_Z_VEL_I_ACC`).
const INTEGRAL_GAIN: Vector3<f64> = Vector3::new(0.4, 0.4, 2.0);
/// The integral never demands more than this, m/s^2: half of gravity holds against a storm.
const INTEGRAL_LIMIT_M_S2: f64 = 5.0;
/// Yaw rate per heading error, 1/s (`MC_YAW_P`).
const HEADING_GAIN: f64 = 2.8;

/// The velocity demand, m/s downwards, that makes a vehicle at rest give the least thrust: the start
/// of the takeoff ramp.
pub(crate) fn least_thrust_m_s(limits: &Limits) -> f64 {
    limits.vertical_acceleration_m_s2.get() / VELOCITY_GAIN.z
}

/// What the flight mode demands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct VelocityDemand {
    /// NED.
    pub(crate) velocity: Vector3<f64>,
    /// Where the nose is to point.
    pub(crate) heading_rad: f64,
    /// Stay level instead of following the horizontal part of the velocity.
    pub(crate) level: bool,
}

/// The velocity controller with its memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct Controller {
    integral: Vector3<f64>,
    acceleration: Vector3<f64>,
}

impl Controller {
    /// The controls that bring the vehicle from `velocity` to the demand.
    pub(crate) fn controls(
        &mut self,
        demand: &VelocityDemand,
        velocity: Vector3<f64>,
        heading_rad: f64,
        limits: &Limits,
        dt_s: f64,
    ) -> Controls {
        let error = demand.velocity - velocity;
        let asked = error.component_mul(&VELOCITY_GAIN) + self.integral;
        let (highest, vertical) = (limits.acceleration_m_s2.get(), limits.vertical_acceleration_m_s2.get());
        let allowed = match demand.level {
            true => Vector3::z() * asked.z,
            false => shortened(horizontal(asked), highest) + Vector3::z() * asked.z,
        };
        let allowed = Vector3::new(allowed.x, allowed.y, allowed.z.clamp(-vertical, vertical));
        let change = allowed - self.acceleration;
        self.acceleration += shortened(change, limits.jerk_m_s3.get() * dt_s);
        // The integral pauses while a limit cuts the acceleration, or the vehicle would overshoot later.
        let free = asked.zip_map(&allowed, |asked, allowed| f64::from(u8::from(asked == allowed)));
        self.integral += error.component_mul(&INTEGRAL_GAIN).component_mul(&free) * dt_s;
        self.integral = self.integral.map(|it| it.clamp(-INTEGRAL_LIMIT_M_S2, INTEGRAL_LIMIT_M_S2));
        let turn_limit = limits.turn_deg_s.get().to_radians();
        Controls {
            thrust_m_s2: thrust_for(self.acceleration, limits.tilt_deg.get().to_radians()),
            yaw_rate_rad_s: (wrapped(demand.heading_rad - heading_rad) * HEADING_GAIN).clamp(-turn_limit, turn_limit),
        }
    }

    /// Starts again on the ground, from no thrust.
    pub(crate) fn reset(&mut self) {
        *self = Controller { integral: Vector3::zeros(), acceleration: Vector3::z() * GRAVITY_M_S2 };
    }
}

/// The force per mass that accelerates by `acceleration` against gravity. The vertical part comes
/// first; the horizontal part gets the tilt that is left.
fn thrust_for(acceleration: Vector3<f64>, tilt_rad: f64) -> Vector3<f64> {
    let upwards = (GRAVITY_M_S2 - acceleration.z).max(0.0);
    shortened(horizontal(acceleration), upwards * tilt_rad.tan()) - Vector3::z() * upwards
}

/// The vector, no longer than `limit`.
fn shortened(vector: Vector3<f64>, limit: f64) -> Vector3<f64> {
    let length = vector.norm();
    if length <= limit { vector } else { vector * (limit / length) }
}
