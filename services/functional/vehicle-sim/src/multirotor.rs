//! The body in the air: a quadrotor as a point mass that tilts its thrust to move sideways.
//!
//! This is the true state, of which the autopilot has only an estimate. A body that stands on the
//! ground neither slides nor tips. Rotor flow, ground effect
//! and the body's inertia are not modelled: tilt and thrust follow the controls with first-order
//! lags, which are why a real one overshoots.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::config::Airframe;
use crate::frame::horizontal;
use crate::ground::Ground;

/// Standard gravity (ISO 80000-3).
pub(crate) const GRAVITY_M_S2: f64 = 9.80665;

/// Turn rate of a quadrotor that flies on two motors and cannot hold its heading.
const SPIN_RAD_S: f64 = 6.0;

/// A body that is this deep in the ground after one step has come from the side, in metres: more than a fall from 100 m makes of a step.
const FROM_THE_SIDE_M: f64 = 0.3;

/// Slower than this along a wall the body slides. (ENG)
const SLIDES_M_S: f64 = 0.5;

/// What the autopilot makes the body do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Controls {
    /// The force of the motors per mass, NED; a body at rest in the air needs gravity's opposite.
    pub(crate) thrust_m_s2: Vector3<f64>,
    /// About the body's vertical axis.
    pub(crate) yaw_rate_rad_s: f64,
}

impl Controls {
    /// The motors stand still, or turn without lift.
    pub(crate) const IDLE: Controls = Controls { thrust_m_s2: Vector3::new(0.0, 0.0, 0.0), yaw_rate_rad_s: 0.0 };
}

/// What thrust the motors can give.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Motors {
    /// Full thrust.
    Working,
    /// One of four has failed; the opposite one must stand still as well, or the body would tip over.
    OneLost,
    /// No thrust: two have failed, or there is no power.
    NoThrust,
}

impl Motors {
    fn share(self) -> f64 {
        match self {
            Motors::Working => 1.0,
            Motors::OneLost => 0.5,
            Motors::NoThrust => 0.0,
        }
    }
}

/// The true state of the body.
#[derive(Debug, Clone)]
pub(crate) struct Multirotor {
    /// NED, metres.
    pub(crate) position: Vector3<f64>,
    /// NED, metres per second.
    pub(crate) velocity: Vector3<f64>,
    /// From the body frame (forward, right, down) to NED.
    pub(crate) attitude: UnitQuaternion<f64>,
    /// About the body's axes, radians per second.
    pub(crate) rates: Vector3<f64>,
    /// Force of the motors per mass, along the body's upward axis.
    pub(crate) thrust_m_s2: f64,
    /// The force of the air per mass, NED.
    pub(crate) drag_m_s2: Vector3<f64>,
    /// Whether it stands on the ground.
    pub(crate) standing: bool,
    /// What it stands on, or will meet.
    pub(crate) ground: Ground,
    /// How often it has met the ground from the side, faster than it slides along it.
    pub(crate) collisions: u32,
    airframe: Airframe,
}

impl Multirotor {
    /// Standing at the origin, nose to the north.
    pub(crate) fn new(airframe: Airframe) -> Multirotor {
        Multirotor {
            position: Vector3::zeros(),
            velocity: Vector3::zeros(),
            attitude: UnitQuaternion::identity(),
            rates: Vector3::zeros(),
            thrust_m_s2: 0.0,
            drag_m_s2: Vector3::zeros(),
            standing: true,
            ground: Ground::default(),
            collisions: 0,
            airframe,
        }
    }

    /// Where the nose points, from north over east.
    pub(crate) fn heading_rad(&self) -> f64 {
        let nose = self.attitude * Vector3::x();
        nose.y.atan2(nose.x)
    }

    /// Advances by `dt_s`. Returns the speed at which the body met the ground: sinking, or from the side.
    pub(crate) fn step(&mut self, controls: &Controls, motors: Motors, wind: Vector3<f64>, dt_s: f64) -> Option<f64> {
        self.turn(controls, motors, dt_s);
        let upwards = self.attitude * -Vector3::z();
        let limit = self.airframe.thrust_to_weight.get() * GRAVITY_M_S2 * motors.share();
        let wanted = controls.thrust_m_s2.dot(&upwards).clamp(0.0, limit);
        self.thrust_m_s2 += (wanted - self.thrust_m_s2) * share_of(dt_s, self.airframe.motor_lag_s.get());

        let airspeed = wind - self.velocity;
        let drag = self.airframe.linear_drag_1_s.get() + self.airframe.quadratic_drag_1_m.get() * airspeed.norm();
        self.drag_m_s2 = airspeed * drag;
        let acceleration = upwards * self.thrust_m_s2 + self.drag_m_s2 + Vector3::new(0.0, 0.0, GRAVITY_M_S2);
        if self.standing && acceleration.z >= 0.0 {
            self.drag_m_s2 = Vector3::zeros();
            return None;
        }
        self.standing = false;
        // Semi-implicit Euler: the new velocity moves the position, so that no energy is created.
        self.velocity += acceleration * dt_s;
        let before = self.position;
        self.position += self.velocity * dt_s;
        let ground_down_m = self.ground.down_m(self.position);
        if FROM_THE_SIDE_M < self.position.z - ground_down_m {
            return Some(self.collide(before));
        }
        (self.position.z >= ground_down_m && self.velocity.z >= 0.0).then(|| self.meet_the_ground(ground_down_m))
    }

    /// It comes no farther than to a wall, and slides along it.
    fn collide(&mut self, before: Vector3<f64>) -> f64 {
        let speed_m_s = horizontal(self.velocity).norm();
        self.collisions += u32::from(SLIDES_M_S < speed_m_s);
        self.position = Vector3::new(before.x, before.y, self.position.z);
        self.velocity = Vector3::new(0.0, 0.0, self.velocity.z);
        speed_m_s
    }

    /// Turns the thrust towards its demanded direction, and the nose at its demanded rate.
    fn turn(&mut self, controls: &Controls, motors: Motors, dt_s: f64) {
        if self.standing {
            self.rates = Vector3::zeros();
            return;
        }
        let tilt_error = match controls.thrust_m_s2.try_normalize(1e-6) {
            Some(wanted) => {
                let upwards = self.attitude * -Vector3::z();
                self.attitude.inverse_transform_vector(&upwards.cross(&wanted))
            }
            None => Vector3::zeros(),
        };
        let yaw_rate = if motors == Motors::Working { controls.yaw_rate_rad_s } else { SPIN_RAD_S };
        let wanted = horizontal(tilt_error) * self.airframe.attitude_gain_1_s.get() + Vector3::z() * yaw_rate;
        self.rates += (wanted - self.rates) * share_of(dt_s, self.airframe.rate_lag_s.get());
        let turn = Quaternion::from_imag(self.rates * (0.5 * dt_s));
        self.attitude = UnitQuaternion::new_normalize(self.attitude.into_inner() + self.attitude.into_inner() * turn);
    }

    fn meet_the_ground(&mut self, ground_down_m: f64) -> f64 {
        let speed = self.velocity.z;
        let heading = self.heading_rad();
        self.position.z = ground_down_m;
        self.velocity = Vector3::zeros();
        self.rates = Vector3::zeros();
        self.attitude = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
        self.standing = true;
        speed
    }
}

/// The share of the difference by which a first-order lag follows in one step; stable for any step.
fn share_of(dt_s: f64, lag_s: f64) -> f64 {
    dt_s / (lag_s + dt_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::shipped;
    use crate::ground::{Patch, Surface};
    use crate::noise::{Noise, NoiseStream};

    const DT: f64 = 0.004;

    fn airborne() -> Multirotor {
        let mut body = Multirotor::new(shipped::config().airframe);
        body.position.z = -100.0;
        body.standing = false;
        body
    }

    fn hover() -> Controls {
        Controls { thrust_m_s2: Vector3::new(0.0, 0.0, -GRAVITY_M_S2), yaw_rate_rad_s: 0.0 }
    }

    /// Kinetic and potential, per mass.
    fn energy(body: &Multirotor) -> f64 {
        0.5 * body.velocity.norm_squared() - body.position.z * GRAVITY_M_S2
    }

    #[test]
    fn without_thrust_the_body_only_loses_energy() {
        let mut noise = Noise::new(3, NoiseStream::Wind);
        for _ in 0..50 {
            let mut body = airborne();
            body.velocity = noise.vector() * 5.0;
            while !body.standing {
                let before = energy(&body);
                body.step(&Controls::IDLE, Motors::NoThrust, Vector3::zeros(), DT);
                // One step of the integrator is off by at most half a step of free fall.
                assert!(energy(&body) <= before + 0.5 * (GRAVITY_M_S2 * DT).powi(2), "{body:?}");
            }
        }
    }

    #[test]
    fn the_wind_carries_a_level_body_along() {
        let mut body = airborne();
        for _ in 0..15_000 {
            body.step(&hover(), Motors::Working, Vector3::new(0.0, 5.0, 0.0), DT);
        }
        assert!((body.velocity.y - 5.0).abs() < 0.1 && body.velocity.x.abs() < 1e-9, "{body:?}");
    }

    #[test]
    fn every_demanded_thrust_is_reached_and_the_attitude_stays_a_rotation() {
        let mut noise = Noise::new(4, NoiseStream::Wind);
        for _ in 0..100 {
            let mut body = airborne();
            let wanted = Vector3::new(0.0, 0.0, -GRAVITY_M_S2) + noise.vector() * 2.0;
            for _ in 0..500 {
                body.step(
                    &Controls { thrust_m_s2: wanted, yaw_rate_rad_s: 0.5 },
                    Motors::Working,
                    Vector3::zeros(),
                    DT,
                );
            }
            let thrust = body.attitude * Vector3::new(0.0, 0.0, -body.thrust_m_s2);
            assert!((thrust - wanted).norm() < 0.2, "{thrust} instead of {wanted}");
            assert!((body.attitude.norm() - 1.0).abs() < 1e-9);
            assert!((body.rates.z - 0.5).abs() < 1e-3);
        }
    }

    #[test]
    fn a_standing_body_stays_until_the_thrust_exceeds_the_weight() {
        let mut body = Multirotor::new(shipped::config().airframe);
        let almost = Controls { thrust_m_s2: hover().thrust_m_s2 * 0.99, ..hover() };
        for _ in 0..500 {
            body.step(&almost, Motors::Working, Vector3::new(15.0, 0.0, 0.0), DT);
        }
        assert!(body.standing && body.position == Vector3::zeros());
        let more = Controls { thrust_m_s2: hover().thrust_m_s2 * 1.1, ..hover() };
        for _ in 0..250 {
            body.step(&more, Motors::Working, Vector3::zeros(), DT);
        }
        assert!(!body.standing && body.position.z < -0.1);
    }

    #[test]
    fn the_ground_is_as_high_as_it_is_and_nothing_flies_through_it() {
        let mut body = airborne();
        let patches = vec![Patch::square((0.0, 50.0), 40.0, 60.0, Surface::Land)];
        body.ground = Ground { elsewhere_m: -15.0, patches, ..Ground::default() };
        body.position = Vector3::new(0.0, 20.0, -20.0);
        body.velocity = Vector3::new(0.0, 12.0, 0.0);
        let mut met = Vec::new();
        for _ in 0..5_000 {
            met.extend(body.step(&Controls::IDLE, Motors::NoThrust, Vector3::zeros(), DT));
        }
        assert_eq!((body.collisions, met.len(), body.position.z), (1, 2, 15.0));
        assert!(body.position.y < 30.0 && 10.0 < met[0], "{met:?} {body:?}");
        body.position = Vector3::new(0.0, 50.0, -70.0);
        body.standing = false;
        for _ in 0..5_000 {
            body.step(&Controls::IDLE, Motors::NoThrust, Vector3::zeros(), DT);
        }
        assert_eq!((body.standing, body.position.z, body.collisions), (true, -60.0, 1));
    }
}
