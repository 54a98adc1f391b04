//! Flies while a plan is made: for the moment that the planner takes, in the direction of the step that failed, slower, and
//! only as far as the next border that may not be crossed; otherwise a stop. On the ground it waits.

use behavior_tree::{Leaf, LeafError, LeafResult, Ports, Status};
use domain::skill::Goal;

use super::skill_run::SkillRun;
use super::why;
use crate::world::{WhatMayBeEntered, World};

#[derive(Default)]
pub(super) struct TransitionExecutor {
    flown: Option<Flown>,
}

struct Flown {
    run: SkillRun,
    chosen_by: WhatMayBeEntered,
    /// It moves on; it no longer does once the planner lets it wait.
    goes_on: bool,
}

impl Leaf<World> for TransitionExecutor {
    fn start(&mut self, world: &mut World, _: &mut Ports<'_>) -> LeafResult {
        self.flown = None;
        world.set_in_transition(false);
        let Some(goal) = world.transition_goal() else { return Ok(Status::Running) };
        world.say("plan", format!("transition: {goal}"));
        world.set_in_transition(true);
        let goes_on = matches!(goal, Goal::Position { .. });
        self.flown = Some(Flown { run: SkillRun::start(world, goal), chosen_by: world.what_may_be_entered(), goes_on });
        Ok(Status::Running)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let Some(Flown { run, chosen_by, goes_on }) = &self.flown else { return Ok(Status::Running) };
        if *chosen_by != world.what_may_be_entered() || (*goes_on && world.rests_without_plan()) {
            // The goal may lie in an area that may no longer be entered, or before one that now may be; or it rests until there is a plan.
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
        if let Some(Flown { run, .. }) = self.flown.take() {
            run.halt(world);
        }
    }
}

/// Always fails, so that the row of its flag takes over.
pub(super) fn raise_transition_failed(world: &mut World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    world.raise_transition_failed(&why(ports));
    Ok(false)
}
