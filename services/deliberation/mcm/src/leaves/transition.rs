//! Flies while a plan is made: in the direction of the step that failed, slower, and
//! only as far as the next border that may not be crossed; otherwise a stop. On the ground it waits.

use behavior_tree::{Leaf, LeafError, LeafResult, Ports, Status};

use super::skill_run::SkillRun;
use super::why;
use crate::world::{WhatMayBeEntered, World};

#[derive(Default)]
pub(super) struct TransitionExecutor {
    flown: Option<(SkillRun, WhatMayBeEntered)>,
}

impl Leaf<World> for TransitionExecutor {
    fn start(&mut self, world: &mut World, _: &mut Ports<'_>) -> LeafResult {
        self.flown = None;
        world.set_in_transition(false);
        let Some(goal) = world.transition_goal() else { return Ok(Status::Running) };
        world.say("plan", format!("transition: {goal}"));
        world.set_in_transition(true);
        self.flown = Some((SkillRun::start(world, goal), world.what_may_be_entered()));
        Ok(Status::Running)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let Some((run, chosen_by)) = &self.flown else { return Ok(Status::Running) };
        if *chosen_by != world.what_may_be_entered() {
            // The goal may lie in an area that may no longer be entered, or before one that now may be.
            run.halt(world);
            return self.start(world, ports);
        }
        let status = run.poll(world, ports);
        if !matches!(status, Ok(Status::Running)) {
            world.set_in_transition(false);
        }
        status
    }

    fn halt(&mut self, world: &mut World, _: &mut Ports<'_>) {
        world.set_in_transition(false);
        if let Some((run, _)) = self.flown.take() {
            run.halt(world);
        }
    }
}

/// Always fails, so that the row of its flag takes over.
pub(super) fn raise_transition_failed(world: &mut World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    world.raise_transition_failed(&why(ports));
    Ok(false)
}
