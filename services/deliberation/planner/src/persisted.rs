//! What outlives the planner's process: the mission as it stands, so that an uploaded one is not
//! forgotten and what has been reached is not flown to again.
//!
//! The plan is not persisted: the mission manager asks for one from where the vehicle is by then. Where
//! the state is stored is the shell's business.

use domain::mission::{InvalidObjective, Mission, Objective as Goal, ObjectiveStatus, ReleaseProgress};
use domain::plan::PlannerStatus;
use domain::wire::InvalidMessage;

use crate::mission_planner::MissionPlanner;
use crate::objectives::{Objective, Objectives};

/// Why a persisted state cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum UnusableState {
    /// The planner was started with another mission since.
    #[error("it belongs to another mission file")]
    OfAnotherMission,
    /// There is no mission in it.
    #[error("it has no objective")]
    Empty,
    /// A part of it makes no sense.
    #[error(transparent)]
    InvalidMessage(#[from] InvalidMessage),
    /// No mission may have one of its objectives.
    #[error(transparent)]
    InvalidObjective(#[from] InvalidObjective),
}

/// The state of a planner.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Persisted {
    /// The identity of the mission it was started with.
    pub(crate) configured: String,
    /// The mission as it stands, without a plan.
    pub(crate) status: PlannerStatus,
    /// Of the steps given out so far.
    pub(crate) last_step_id: u64,
    /// When the first plan was made, in milliseconds since the Unix epoch, UTC; `None` before.
    pub(crate) begun_utc_ms: Option<i64>,
}

/// What is kept of `planner`, which was started with the mission of identity `configured`.
pub(crate) fn persist(planner: &MissionPlanner, configured: &str) -> Persisted {
    let status = PlannerStatus { steps: Vec::new(), hold: String::new(), ..planner.status() };
    let (last_step_id, begun_utc_ms) = (planner.last_step_id(), planner.begun_utc_ms());
    Persisted { configured: configured.to_owned(), status, last_step_id, begun_utc_ms }
}

/// Lets `planner`, which has planned nothing, continue from `persisted`.
///
/// # Errors
/// Why the state cannot be used; nothing is changed then.
pub(crate) fn resume(planner: &mut MissionPlanner, persisted: Persisted) -> Result<(), UnusableState> {
    let PlannerStatus { mission, objectives, areas, sites, revision, epoch, order, origin, feeds, .. } =
        persisted.status;
    if objectives.is_empty() {
        return Err(UnusableState::Empty);
    }
    let past: Vec<Objective> = objectives.into_iter().map(objective).collect::<Result<_, _>>()?;
    let objectives = past.iter().map(|it| it.objective()).collect();
    let mission = Mission { name: mission, objectives, areas, order, sites, origin, feeds };
    planner.go_on(
        mission,
        Objectives::with_past(past),
        epoch,
        revision,
        persisted.last_step_id,
        persisted.begun_utc_ms,
    );
    Ok(())
}

fn objective(status: ObjectiveStatus) -> Result<Objective, InvalidObjective> {
    let Goal { name, position, flying, terms, survey } = status.objective;
    let checked = Goal { terms, survey, ..Goal::new(name, position, flying)? };
    let mut objective = Objective {
        progress: status.progress,
        plan_steps: status.plan_steps,
        plans: if status.plan_steps == 0 { 0 } else { status.replans + 1 },
        permissions: status.permissions,
        release: status.release,
        ..Objective::waiting(&checked)
    };
    if status.release == ReleaseProgress::Seen {
        objective.release_seen();
    }
    Ok(objective)
}
