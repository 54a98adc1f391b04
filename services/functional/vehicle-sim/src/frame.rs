//! Conversions between the domain's named coordinates and the vectors of the physics: x north, y
//! east, z down.

use domain::geometry::{Ned, NedVelocity};
use nalgebra::Vector3;

/// The position as a vector.
pub(crate) fn vector(position: Ned) -> Vector3<f64> {
    Vector3::new(position.north_m, position.east_m, position.down_m)
}

/// The velocity as a vector.
pub(crate) fn velocity_vector(velocity: NedVelocity) -> Vector3<f64> {
    Vector3::new(velocity.north_m_s, velocity.east_m_s, velocity.down_m_s)
}

/// The vector as a position.
pub(crate) fn ned(vector: Vector3<f64>) -> Ned {
    Ned::new(vector.x, vector.y, vector.z)
}

/// The vector as a velocity.
pub(crate) fn ned_velocity(vector: Vector3<f64>) -> NedVelocity {
    NedVelocity::new(vector.x, vector.y, vector.z)
}

/// The vector without its vertical part.
pub(crate) fn horizontal(vector: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(vector.x, vector.y, 0.0)
}

/// The same angle between -pi and pi.
pub(crate) fn wrapped(angle_rad: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    (angle_rad + PI).rem_euclid(TAU) - PI
}
