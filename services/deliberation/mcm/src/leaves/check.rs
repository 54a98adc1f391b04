//! The conditions of the nominal behavior and of a step. They ask, and change nothing.

use std::sync::{Arc, LazyLock};

use behavior_tree::{LeafError, Ports};

use super::ports::Condition;
use super::unless;
use crate::decide::Activity;
use crate::world::World;

pub(super) fn mission_not_over(world: &World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    let is_over = matches!(world.decision().activity, Activity::End | Activity::Over);
    if let Some(reason) = world.over().filter(|_| is_over) {
        ports.because("the mission is not over", reason.to_owned(), "not over".to_owned());
    }
    Ok(!is_over)
}

/// Made once, so that a flag is answered before any words are made.
static NONE: LazyLock<Arc<str>> = LazyLock::new(|| "none".into());

pub(super) fn no_flag_answered(world: &World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    let Some(flag) = world.answered_flag() else { return Ok(true) };
    ports.because("no flag is answered", flag.clone(), NONE.clone());
    Ok(false)
}

pub(super) fn precondition(world: &World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    let condition = ports.get::<Condition>("condition")?;
    let breach = || world.breach_of_present_step().map(|it| it.to_string());
    let (height, skill) = (|| world.bad_height_of_present_step(), || world.skill_missing_at_takeoff());
    let unmet = world.unmet_precondition(&condition.0).or_else(breach).or_else(height).or_else(skill);
    unless(unmet.map(|it| format!("precondition not met: {it}")), ports)
}

pub(super) fn invariant(world: &World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    let condition = ports.get::<Condition>("condition")?;
    // Where it touches the ground it may as well stand.
    if world.touches_down() {
        return Ok(true);
    }
    // Until it has lifted off, what had to be true before the step still has to be.
    let breach = || match world.is_on_ground() {
        true => world.breach_of_present_step().map(|it| it.to_string()),
        false => world.breach_ahead().map(|it| it.to_string()),
    };
    let unmet = world.unmet_invariant(&condition.0).or_else(breach);
    unless(unmet.map(|it| format!("invariant not met: {it}")), ports)
}

/// Whether the vehicle may come down where it is. In or over an area that forbids it only where nothing else is left.
pub(super) fn may_land_here(world: &World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    unless(world.why_land_elsewhere(), ports)
}

/// Whether no landing will be in reach if the vehicle goes on with what it does.
pub(super) fn landing_is_at_stake(world: &World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    unless(world.landing_about_to_be_lost().is_none().then(|| "a landing can be reached later too".to_owned()), ports)
}
