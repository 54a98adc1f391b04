//! The messages of this service, from and to what it thinks in.

use domain::wire::Senseless;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1::{self, CommandResult, FlightMode, OffboardControl, WhenBusy};

use crate::commands::Answer;
use crate::fsm::SkillId;
use crate::resource::Request;
use crate::stream::Setpoint;
use crate::vehicle::{Landed, Motion, Status};

/// Position and velocity.
pub fn motion(it: v1::VehicleLocalPosition) -> Result<Motion, Senseless> {
    Ok(Motion {
        position: it.position.ok_or(Senseless::Missing("position"))?.try_into()?,
        velocity: it.velocity.ok_or(Senseless::Missing("velocity"))?.try_into()?,
        horizontal_valid: it.horizontal_valid,
        vertical_valid: it.vertical_valid,
        timestamp_us: it.timestamp_us,
    })
}

/// What the land detector says.
pub fn landed(it: &v1::VehicleLandDetected) -> Landed {
    Landed { landed: it.landed, timestamp_us: it.timestamp_us }
}

/// What the autopilot does.
pub fn status(it: &v1::VehicleStatus) -> Result<Status, Senseless> {
    let (intended, actual) = (it.intended_mode(), it.actual_mode());
    if intended == FlightMode::Unspecified {
        return Err(Senseless::Missing("intended_mode"));
    }
    if actual == FlightMode::Unspecified {
        return Err(Senseless::Missing("actual_mode"));
    }
    Ok(Status { armed: it.armed, intended, actual, failsafe: it.failsafe })
}

/// The answer to a command.
pub fn answer(it: v1::VehicleCommandAck) -> Result<Answer, Senseless> {
    match it.result() {
        CommandResult::Accepted => Ok(Answer::Accepted),
        CommandResult::Rejected => Ok(Answer::Rejected(it.reason)),
        CommandResult::Unspecified => Err(Senseless::Missing("result")),
    }
}

/// A request, with what is wrong with it instead of a goal that cannot be flown.
pub fn request(it: v1::SkillRequest) -> Request {
    let when_busy = it.when_busy();
    let goal = match when_busy {
        WhenBusy::Unspecified => Err(Senseless::Missing("when_busy")),
        WhenBusy::Replace | WhenBusy::Refuse => {
            it.goal.ok_or(Senseless::Missing("goal")).and_then(|goal| goal.try_into())
        }
    };
    Request {
        id: it.request_id,
        goal: goal.map_err(|it| it.to_string()),
        replaces: when_busy == WhenBusy::Replace,
        gave_up: (it.gave_up_skill_id != 0).then_some(SkillId(it.gave_up_skill_id)),
    }
}

/// A setpoint, behind the proof of life that says which kind it is.
pub fn setpoint(it: Setpoint) -> [Message; 2] {
    let (control, setpoint) = match it {
        Setpoint::Position { target, speed_limit_m_s, yaw_rad } => (
            OffboardControl::Position,
            v1::TrajectorySetpoint {
                position: Some(target.into()),
                speed_limit_m_s: Some(speed_limit_m_s),
                yaw_rad,
                ..v1::TrajectorySetpoint::default()
            },
        ),
        Setpoint::Velocity { velocity, yaw_rate_rad_s } => (
            OffboardControl::Velocity,
            v1::TrajectorySetpoint {
                velocity: Some(velocity.into()),
                yaw_rate_rad_s,
                ..v1::TrajectorySetpoint::default()
            },
        ),
    };
    [v1::OffboardControlMode { control: control as i32 }.into(), setpoint.into()]
}
