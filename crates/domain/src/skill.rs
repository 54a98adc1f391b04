//! Skill goals, checked: a goal with a value that is not a number, or a speed that cannot be flown, does not exist in
//! this type.

use std::sync::Arc;

use kittiwake_proto::v1;

use crate::fmu::FlightMode;
use crate::geometry::{Ned, NedVelocity};
use crate::task::{Stance, TaskGoal};

/// Which skill flies a goal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SkillKind {
    /// Land where the vehicle is.
    Land,
    /// Arm and climb.
    Takeoff,
    /// Come to rest.
    Stop,
    /// Fly by setpoints.
    Offboard,
    /// Open the gripper over a place.
    Release,
    /// Hover or stand while a process of its own carries out a declared skill.
    Task,
}

/// How a skill ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SkillOutcome {
    /// Its postcondition was seen.
    Succeeded,
    /// It could not be flown to its end.
    Failed,
    /// Its caller cancelled it.
    Cancelled,
    /// A newer skill took its place.
    Aborted,
    /// The autopilot, or another controller, took the vehicle from the skill.
    Preempted,
    /// The autopilot rejected its command, or did not acknowledge it in time.
    Rejected,
    /// Its deadline passed.
    TimedOut,
}

/// Where a skill is in its life.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SkillPhase {
    /// Its command waits for the acknowledgement.
    ProcessRequest,
    /// It flies.
    Execute,
    /// It flies until its cancellation is acknowledged.
    Cancel,
    /// On its way out: its outcome, or that it was overwritten, is being reported.
    Closing,
    /// It is over.
    Ended(SkillOutcome),
}

/// A skill changed its phase, or something went wrong that did not change it.
#[derive(Debug, Clone, PartialEq)]
pub struct SkillEvent {
    /// The skill manager's name for it.
    pub skill_id: u64,
    /// The caller's name for it.
    pub request_id: String,
    /// Which skill.
    pub kind: SkillKind,
    /// Where it is now.
    pub phase: SkillPhase,
    /// Why, for every outcome but success, and for an error in a phase that goes on.
    pub reason: String,
    /// Where the vehicle was when it ended.
    pub position: Option<Ned>,
    /// How it moved.
    pub velocity: Option<NedVelocity>,
    /// When that position was measured, by the vehicle's clock; 0 for never.
    pub position_timestamp_us: u64,
    /// When the land detector spoke last, by the same clock; 0 for never.
    pub landed_timestamp_us: u64,
    /// It was pre-empted by a pilot or another ground station, not by the autopilot itself.
    pub flown_by_other: bool,
    /// The skill of a task along a flight, whose request id this is then; empty for every other skill.
    pub along: String,
}

/// What a skill is asked to do.
#[derive(Debug, Clone, PartialEq)]
pub enum Goal {
    /// Land where the vehicle is.
    Land,
    /// The same, on the target that the autopilot's sensor sees there.
    LandOnTarget,
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
    /// Open the gripper, hovering. Ends once the load is seen released, at once if it is; refused away from the place.
    Release {
        /// Over which place.
        over: Ned,
    },
    /// Hover or stand while a process of its own carries out a declared skill.
    Task(Arc<TaskGoal>),
}

impl Goal {
    /// To fly straight to `target`, however it is turned, and end there.
    pub fn fly_to(target: Ned, speed_limit_m_s: f64) -> Goal {
        Goal::Position { target, speed_limit_m_s, yaw_rad: None, hold_at_target: false }
    }

    /// The same, and to stay there until another goal replaces it.
    pub fn hold_at(target: Ned, speed_limit_m_s: f64) -> Goal {
        Goal::Position { target, speed_limit_m_s, yaw_rad: None, hold_at_target: true }
    }

    /// The skill that flies it.
    pub fn skill(&self) -> SkillKind {
        match self {
            Goal::Land | Goal::LandOnTarget => SkillKind::Land,
            Goal::Takeoff { .. } => SkillKind::Takeoff,
            Goal::Stop => SkillKind::Stop,
            Goal::Position { .. } | Goal::Velocity { .. } => SkillKind::Offboard,
            Goal::Release { .. } => SkillKind::Release,
            Goal::Task(_) => SkillKind::Task,
        }
    }

    /// Whether it comes down to the ground.
    pub fn lands(&self) -> bool {
        matches!(self, Goal::Land | Goal::LandOnTarget)
    }

    /// Whether it releases the load.
    pub fn is_release(&self) -> bool {
        matches!(self, Goal::Release { .. })
    }

    /// Whether it goes on until another one replaces it.
    pub fn is_endless(&self) -> bool {
        matches!(self, Goal::Position { hold_at_target: true, .. } | Goal::Velocity { timeout_s: None, .. })
    }

    /// The flight mode in which it is flown.
    pub fn mode(&self) -> FlightMode {
        match self {
            Goal::Land | Goal::LandOnTarget => FlightMode::Land,
            Goal::Takeoff { .. } => FlightMode::Takeoff,
            Goal::Stop | Goal::Release { .. } | Goal::Task(_) => FlightMode::Loiter,
            Goal::Position { .. } | Goal::Velocity { .. } => FlightMode::Offboard,
        }
    }

    /// The same as it goes over the wire.
    pub fn kind(&self) -> v1::SkillKind {
        match self {
            Goal::Land | Goal::LandOnTarget => v1::SkillKind::Land,
            Goal::Takeoff { .. } => v1::SkillKind::Takeoff,
            Goal::Stop => v1::SkillKind::Stop,
            Goal::Position { .. } | Goal::Velocity { .. } => v1::SkillKind::Offboard,
            Goal::Release { .. } => v1::SkillKind::Release,
            Goal::Task(_) => v1::SkillKind::Task,
        }
    }
}

/// In a few words: `fly to (0, 90, 10)`.
impl std::fmt::Display for Goal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Goal::Land => f.write_str("land"),
            Goal::LandOnTarget => f.write_str("land on the target"),
            Goal::Takeoff { climb_m } => write!(f, "takeoff by {climb_m:.0} m"),
            Goal::Stop => f.write_str("stop"),
            Goal::Position { target, .. } => write!(f, "fly to {target}"),
            Goal::Velocity { .. } => f.write_str("fly at a velocity"),
            Goal::Release { over } => write!(f, "release the load over {over}"),
            Goal::Task(it) => {
                let word = if it.stance == Stance::Stands { "at" } else { "over" };
                write!(f, "{} {word} {}", it.task, it.over)
            }
        }
    }
}

/// As users read it.
impl std::fmt::Display for SkillOutcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            SkillOutcome::Succeeded => "succeeded",
            SkillOutcome::Failed => "failed",
            SkillOutcome::Cancelled => "cancelled",
            SkillOutcome::Aborted => "aborted",
            SkillOutcome::Preempted => "pre-empted",
            SkillOutcome::Rejected => "rejected",
            SkillOutcome::TimedOut => "timed out",
        })
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
        v1::SkillKind::Release => "release",
        v1::SkillKind::Task => "task",
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
