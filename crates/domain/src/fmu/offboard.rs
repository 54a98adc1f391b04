//! Setpoints for the mode offboard.

use crate::geometry::{Ned, NedVelocity};

/// What a setpoint controls. Streamed with each setpoint as the proof of life.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OffboardControl {
    /// The position.
    Position,
    /// The velocity.
    Velocity,
}

/// Where or how to fly offboard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Setpoint {
    /// Fly straight to a position.
    Position {
        /// Where to.
        target: Ned,
        /// No faster than this, more than zero; `None`: the vehicle's own limit.
        speed_limit_m_s: Option<f64>,
        /// Heading to turn to; `None`: keep the heading.
        yaw_rad: Option<f64>,
    },
    /// Fly at a velocity.
    Velocity {
        /// How fast, and which way.
        velocity: NedVelocity,
        /// Turn rate; `None`: do not turn.
        yaw_rate_rad_s: Option<f64>,
    },
}

impl Setpoint {
    /// The control that this setpoint belongs to.
    pub fn control(&self) -> OffboardControl {
        match self {
            Setpoint::Position { .. } => OffboardControl::Position,
            Setpoint::Velocity { .. } => OffboardControl::Velocity,
        }
    }
}
