//! What comes in and what goes out, as checked types.

use domain::fmu::{CommandAck, LandDetected, LocalPosition, Setpoint, Status, VehicleCommand};
use domain::task::Task;
use kittiwake_proto::v1::SkillKind;

use crate::fsm::{SkillId, SkillState};

/// Something that the autopilot says.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Input {
    Position(LocalPosition),
    Status(Status),
    Landed(LandDetected),
    Acknowledged(CommandAck),
    /// The process of a declared skill says how it stands.
    Task(TaskReport),
}

/// Something to be published.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Output {
    /// A command to the autopilot.
    Command(VehicleCommand),
    /// A setpoint, with its proof of life.
    Setpoint(Setpoint),
    /// A skill changed its state, or could not be cancelled.
    Report(SkillReport),
    /// How far a skill still has to go.
    Feedback(Feedback),
    /// To the process of a declared skill.
    Task(TaskOrder),
}

/// Begin a task, or end it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TaskOrder {
    pub(crate) request_id: String,
    pub(crate) task: Task,
    pub(crate) cancel: bool,
}

/// How a process that carries out a declared skill stands.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TaskReport {
    pub(crate) skill: String,
    /// What it is about; empty while it is ready.
    pub(crate) request_id: String,
    pub(crate) state: TaskState,
    /// Once it has ended.
    pub(crate) outcome: String,
    pub(crate) reason: String,
    /// What it has found out.
    pub(crate) results: Vec<(String, f64)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TaskState {
    Ready,
    Running,
    Ended,
}

/// A skill at one moment.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SkillReport {
    pub(crate) id: SkillId,
    /// The caller's name for it.
    pub(crate) request_id: String,
    pub(crate) kind: SkillKind,
    pub(crate) state: SkillState,
    /// Where and how the vehicle is, if that is known.
    pub(crate) motion: Option<LocalPosition>,
    /// When the land detector last spoke, by the vehicle's clock; 0 for never.
    pub(crate) landed_timestamp_us: u64,
    /// It was pre-empted by a pilot or another ground station.
    pub(crate) flown_by_other: bool,
    /// The skill of a task along a flight; empty for every other one.
    pub(crate) along: String,
}

/// The progress of a skill that executes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Feedback {
    pub(crate) id: SkillId,
    pub(crate) kind: SkillKind,
    pub(crate) motion: LocalPosition,
    pub(crate) distance_left_m: f64,
}
