//! Skill goals, checked: a goal that holds a number that is none, or a speed that cannot be flown,
//! does not exist in this type.

use kittiwake_proto::v1;

use crate::geometry::{Ned, NedVelocity};

/// What a skill is asked to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// Land where the vehicle is.
    Land,
    /// Arm if necessary and climb straight up.
    Takeoff {
        /// Relative to the height at the time of the request, more than zero.
        climb_m: f64,
    },
    /// Come to rest and loiter; on the ground, nothing.
    Stop,
    /// Offboard, mode 0: fly straight to a position and be slow there.
    Position {
        /// Where.
        target: Ned,
        /// No faster than this, more than zero.
        speed_limit_m_s: f64,
        /// Heading to hold; `None`: as it is.
        yaw_rad: Option<f64>,
        /// Stay at the target until replaced instead of succeeding there.
        hold_at_target: bool,
    },
    /// Offboard, mode 1: fly at a velocity, then loiter.
    Velocity {
        /// How.
        velocity: NedVelocity,
        /// Turn rate; `None`: heading as it is.
        yaw_rate_rad_s: Option<f64>,
        /// In mission seconds; `None`: without end.
        timeout_s: Option<f64>,
    },
}

impl Goal {
    /// The skill that flies it.
    pub fn kind(&self) -> v1::SkillKind {
        match self {
            Goal::Land => v1::SkillKind::Land,
            Goal::Takeoff { .. } => v1::SkillKind::Takeoff,
            Goal::Stop => v1::SkillKind::Stop,
            Goal::Position { .. } | Goal::Velocity { .. } => v1::SkillKind::Offboard,
        }
    }
}

/// The skill's name as users write and read it.
pub fn kind_name(kind: v1::SkillKind) -> &'static str {
    match kind {
        v1::SkillKind::Unspecified => "none",
        v1::SkillKind::Land => "land",
        v1::SkillKind::Takeoff => "takeoff",
        v1::SkillKind::Stop => "stop",
        v1::SkillKind::Offboard => "offboard",
    }
}

/// The outcome as users read it.
pub fn outcome_name(outcome: v1::SkillOutcome) -> &'static str {
    match outcome {
        v1::SkillOutcome::Unspecified => "running",
        v1::SkillOutcome::Succeeded => "succeeded",
        v1::SkillOutcome::Failed => "failed",
        v1::SkillOutcome::Cancelled => "cancelled",
        v1::SkillOutcome::Aborted => "aborted",
        v1::SkillOutcome::Preempted => "pre-empted",
        v1::SkillOutcome::Rejected => "rejected",
        v1::SkillOutcome::TimedOut => "timed out",
    }
}
