//! What outlives the planner's process: the mission as it stands, so that an uploaded one is not
//! forgotten and what has been reached is not flown to again.
//!
//! The plan is not kept: the mission manager asks for one from where the vehicle is by then. Who keeps
//! the memory, and where, is none of the planner's business.

use domain::area::Area;
use domain::geometry::Ned;
use domain::mission::{self, Mission};
use domain::wire::Senseless;
use kittiwake_proto::v1;

use crate::answer;
use crate::mission_planner::MissionPlanner;
use crate::objectives::{Objective, Objectives, Progress};

/// Why a memory is of no use.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Useless {
    /// The planner was started with another mission since: that one is meant.
    #[error("it is of another mission file, and that is what counts")]
    OfAnotherMission,
    /// There is no mission in it.
    #[error("it has no objective")]
    Empty,
    /// Something in it is none of ours.
    #[error(transparent)]
    Senseless(#[from] Senseless),
    /// An objective in it could not have been taken in.
    #[error(transparent)]
    Unbelievable(#[from] mission::Unbelievable),
}

/// What `planner`, which was started with `configured`, remembers.
pub fn memory(planner: &MissionPlanner, configured: &str) -> v1::PlannerMemory {
    let status = v1::PlannerStatus {
        plan: Some(v1::Plan { revision: planner.revision(), ..Default::default() }),
        hold: String::new(),
        ..answer::status(planner)
    };
    v1::PlannerMemory { status: Some(status), configured: configured.to_owned(), last_step_id: planner.last_step_id() }
}

/// Has `planner`, which was started with `configured` and has planned nothing, go on where `memory` ends.
///
/// # Errors
/// Why the memory is of no use; nothing is changed then.
pub fn resume(planner: &mut MissionPlanner, configured: &str, memory: v1::PlannerMemory) -> Result<(), Useless> {
    if memory.configured != configured {
        return Err(Useless::OfAnotherMission);
    }
    let status = memory.status.ok_or(Senseless::Missing("status"))?;
    let areas: Vec<Area> = status.areas.into_iter().map(Area::try_from).collect::<Result<_, _>>()?;
    let past: Vec<Objective> = status.objectives.into_iter().map(objective).collect::<Result<_, _>>()?;
    if past.is_empty() {
        return Err(Useless::Empty);
    }
    let objective = |it: &Objective| mission::Objective {
        name: it.name.clone(),
        position: it.goal.position,
        flying: it.goal.flying,
    };
    let mission = Mission { name: status.mission, objectives: past.iter().map(objective).collect(), areas };
    let revision = status.plan.map_or(0, |it| it.revision);
    planner.go_on(mission, Objectives::with_past(past), status.epoch, revision, memory.last_step_id);
    Ok(())
}

fn objective(it: v1::Objective) -> Result<Objective, Useless> {
    let position = Ned::try_from(it.position.ok_or(Senseless::Missing("position"))?)?;
    let progress = match it.state() {
        v1::ObjectiveState::Success => Progress::Success,
        v1::ObjectiveState::Failure => Progress::Failure(it.reason),
        v1::ObjectiveState::Waiting | v1::ObjectiveState::Unspecified => Progress::Waiting,
    };
    let believed = mission::Objective::new(it.name, position, it.flying)?;
    let plans = if it.plan_steps == 0 { 0 } else { it.replans + 1 };
    Ok(Objective {
        progress,
        plan_steps: it.plan_steps,
        plans,
        permissions: it.permissions,
        ..Objective::waiting(&believed)
    })
}
