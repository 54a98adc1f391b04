//! Proof of life and setpoints.

use kittiwake_proto::v1;

use crate::fmu::{OffboardControl, Setpoint};
use crate::geometry::{Ned, NedVelocity};
use crate::wire::{InvalidMessage, finite, out_of_range, positive};

impl From<OffboardControl> for v1::OffboardControlMode {
    fn from(control: OffboardControl) -> v1::OffboardControlMode {
        let control = match control {
            OffboardControl::Position => v1::OffboardControl::Position,
            OffboardControl::Velocity => v1::OffboardControl::Velocity,
        };
        v1::OffboardControlMode { control: control as i32 }
    }
}

impl TryFrom<v1::OffboardControlMode> for OffboardControl {
    type Error = InvalidMessage;
    fn try_from(message: v1::OffboardControlMode) -> Result<OffboardControl, InvalidMessage> {
        match message.control() {
            v1::OffboardControl::Position => Ok(OffboardControl::Position),
            v1::OffboardControl::Velocity => Ok(OffboardControl::Velocity),
            v1::OffboardControl::Unspecified => Err(InvalidMessage::Missing("control")),
        }
    }
}

impl From<Setpoint> for v1::TrajectorySetpoint {
    fn from(setpoint: Setpoint) -> v1::TrajectorySetpoint {
        match setpoint {
            Setpoint::Position { target, speed_limit_m_s, yaw_rad } => v1::TrajectorySetpoint {
                position: Some(target.into()),
                speed_limit_m_s,
                yaw_rad,
                ..v1::TrajectorySetpoint::default()
            },
            Setpoint::Velocity { velocity, yaw_rate_rad_s } => v1::TrajectorySetpoint {
                velocity: Some(velocity.into()),
                yaw_rate_rad_s,
                ..v1::TrajectorySetpoint::default()
            },
        }
    }
}

/// A field that the control does not use must be valid as well: otherwise the sender made a mistake.
impl TryFrom<v1::TrajectorySetpoint> for Setpoint {
    type Error = InvalidMessage;
    fn try_from(message: v1::TrajectorySetpoint) -> Result<Setpoint, InvalidMessage> {
        let position = message.position.map(Ned::try_from).transpose()?;
        let velocity = message.velocity.map(NedVelocity::try_from).transpose()?;
        let speed_limit_m_s = message.speed_limit_m_s.map(|it| positive("speed_limit_m_s", it)).transpose()?;
        let yaw_rad = message.yaw_rad.map(|it| finite("yaw_rad", it)).transpose()?;
        let yaw_rate_rad_s = message.yaw_rate_rad_s.map(|it| finite("yaw_rate_rad_s", it)).transpose()?;
        match (position, velocity) {
            (Some(target), None) => Ok(Setpoint::Position { target, speed_limit_m_s, yaw_rad }),
            (None, Some(velocity)) => Ok(Setpoint::Velocity { velocity, yaw_rate_rad_s }),
            (None, None) => Err(InvalidMessage::Missing("position or velocity")),
            (Some(_), Some(velocity)) => Err(out_of_range("velocity", velocity, "none beside a position")),
        }
    }
}
