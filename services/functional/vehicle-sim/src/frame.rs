//! Between the domain's named coordinates and the vectors the physics computes with: x north,
//! y east, z down.

use domain::geometry::{Ned, NedVelocity};
use nalgebra::Vector3;

/// The position as a vector.
pub fn vector(it: Ned) -> Vector3<f64> {
    Vector3::new(it.north_m, it.east_m, it.down_m)
}

/// The velocity as a vector.
pub fn velocity_vector(it: NedVelocity) -> Vector3<f64> {
    Vector3::new(it.north_m_s, it.east_m_s, it.down_m_s)
}

/// The vector as a position.
pub fn ned(it: Vector3<f64>) -> Ned {
    Ned::new(it.x, it.y, it.z)
}

/// The vector as a velocity.
pub fn ned_velocity(it: Vector3<f64>) -> NedVelocity {
    NedVelocity::new(it.x, it.y, it.z)
}

/// The vector without its vertical part.
pub fn horizontal(it: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(it.x, it.y, 0.0)
}

/// The angle, brought between -pi and pi.
pub fn wrapped(angle_rad: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    (angle_rad + PI).rem_euclid(TAU) - PI
}
