//! Straight to a position, braking in time: the outer half of PX4's cascade.

use nalgebra::Vector3;

use crate::config::Limits;
use crate::frame::horizontal;

/// Velocity per position error, 1/s (`MPC_XY_P`).
const POSITION_GAIN: f64 = 0.95;

/// The velocity that leads from `position` straight to `target`, no faster than `speed_limit_m_s`
/// and than the vehicle may fly in any direction.
pub(crate) fn towards(
    position: Vector3<f64>,
    target: Vector3<f64>,
    speed_limit_m_s: f64,
    limits: &Limits,
) -> Vector3<f64> {
    let path = target - position;
    let Some(direction) = path.try_normalize(1e-9) else { return Vector3::zeros() };
    let speed = (POSITION_GAIN * path.norm()).min(braking_speed(path.norm(), direction, limits)).min(speed_limit_m_s);
    within_limits(direction * speed, limits)
}

/// The velocity, scaled down until each part is within its limit; its direction stays.
pub(crate) fn within_limits(velocity: Vector3<f64>, limits: &Limits) -> Vector3<f64> {
    let vertical = if velocity.z < 0.0 { limits.climb_m_s } else { limits.descend_m_s };
    let excess = (horizontal(velocity).norm() / limits.cruise_m_s.get()).max(velocity.z.abs() / vertical.get());
    if excess <= 1.0 { velocity } else { velocity / excess }
}

/// The highest speed from which the vehicle comes to rest within `distance_m`, building up its
/// deceleration at the jerk limit first (PX4: `computeMaxSpeedFromDistance`).
fn braking_speed(distance_m: f64, direction: Vector3<f64>, limits: &Limits) -> f64 {
    let deceleration = along(direction, limits.acceleration_m_s2.get(), limits.vertical_acceleration_m_s2.get());
    let b = 4.0 * deceleration * deceleration / limits.jerk_m_s3.get();
    0.5 * ((b * b + 8.0 * deceleration * distance_m).sqrt() - b)
}

/// The limit along `direction` that follows from one over ground and one vertically.
fn along(direction: Vector3<f64>, over_ground: f64, vertical: f64) -> f64 {
    let share = (horizontal(direction).norm() / over_ground).max(direction.z.abs() / vertical);
    1.0 / share.max(1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::shipped;
    use crate::noise::{Noise, NoiseStream};

    #[test]
    fn the_velocity_leads_straight_to_the_target_within_the_limits() {
        let limits = shipped::config().limits;
        let mut noise = Noise::new(1, NoiseStream::Sensors);
        for _ in 0..1000 {
            let way = noise.vector() * 100.0;
            let speed_limit = 20.0 * noise.unit().abs() + 0.1;
            let velocity =
                towards(Vector3::new(1.0, 2.0, -3.0), Vector3::new(1.0, 2.0, -3.0) + way, speed_limit, &limits);
            assert!(velocity.normalize().dot(&way.normalize()) > 1.0 - 1e-9, "{velocity} for {way}");
            assert!(velocity.norm() <= speed_limit * (1.0 + 1e-9) && velocity.norm() <= 0.95 * way.norm() + 1e-9);
            assert!(horizontal(velocity).norm() <= 12.0 + 1e-9 && (-3.0 - 1e-9..=1.5 + 1e-9).contains(&velocity.z));
        }
        assert_eq!(towards(Vector3::zeros(), Vector3::zeros(), 5.0, &limits), Vector3::zeros());
    }
}
