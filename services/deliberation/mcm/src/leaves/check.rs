//! The nominal behavior's guards, and a step's.

use std::sync::{Arc, LazyLock};

use behavior_tree::{LeafError, Ports};

use super::ports::Condition;
use crate::conditions::{Unmet, first_unmet};
use crate::world::World;

pub(super) fn mission_not_over(world: &mut World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    if let Some(over) = &world.mission.over {
        ports.because("the mission is over", over.reason.clone(), "not over".to_owned());
    }
    Ok(world.mission.over.is_none())
}

/// Made once: a flag that comes is answered before anything is said about it.
static NONE: LazyLock<Arc<str>> = LazyLock::new(|| "none".into());

pub(super) fn no_errors(world: &mut World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    if let Some(name) = world.flags.first() {
        ports.because("no flag is up", name.clone(), NONE.clone());
        return Ok(false);
    }
    world.acting = None;
    Ok(true)
}

pub(super) fn precondition(world: &mut World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    let condition = ports.get::<Condition>("condition")?;
    // Before the start no skill of the step executes, so its mode cannot be asked about yet.
    let unmet = first_unmet(&condition.0, world, false);
    Ok(judge("precondition", unmet, world, ports))
}

pub(super) fn invariant(world: &mut World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    let condition = ports.get::<Condition>("condition")?;
    let vehicle = world.vehicle.map(|it| (it.mode, it.status_at));
    if let Some((_, at)) = vehicle.filter(|it| condition.0.mode.is_some() && it.0 == condition.0.mode()) {
        world.skills.saw_own_mode(at);
    }
    let judge_mode = world.skills.has_shown_its_mode();
    let unmet = first_unmet(&condition.0, world, judge_mode);
    Ok(judge("invariant", unmet, world, ports))
}

fn judge(what: &'static str, unmet: Option<Unmet>, world: &mut World, ports: &mut Ports<'_>) -> bool {
    let Some(unmet) = unmet else { return true };
    world.failure.reason = format!("{what} not met: {unmet}");
    ports.because(unmet.what, unmet.found, unmet.wanted);
    false
}
