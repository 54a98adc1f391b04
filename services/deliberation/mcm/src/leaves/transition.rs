//! What flies while a plan is being made: in the direction of the step that failed, slower, and
//! only as far as the next border allows; else nothing but a stop. On the ground: wait.

use behavior_tree::{Leaf, LeafError, LeafResult, Ports, Status};
use domain::contingency::TRANSITION_FAILED;
use domain::route::{Whereabouts, transition_goal};
use domain::skill::Goal;
use kittiwake_proto::v1::{SkillOutcome, TimingPoint};

use crate::clients::skills::{Handle, Progress, ending};
use crate::words;
use crate::world::{SELF, World};

#[derive(Default)]
pub(super) struct TransitionExecutor {
    skill: Option<Handle>,
    /// The areas that could be entered when it was planned.
    held: Vec<String>,
}

impl Leaf<World> for TransitionExecutor {
    fn start(&mut self, world: &mut World, _: &mut Ports<'_>) -> LeafResult {
        self.skill = None;
        let Some(vehicle) = world.vehicle.filter(|it| it.flying) else { return Ok(Status::Running) };
        let whereabouts = Whereabouts { position: vehicle.position, flying: vehicle.flying };
        let failed = world.planner.failed_goal.unwrap_or(Goal::Stop);
        self.held = world.held();
        let (areas, limits) = (&world.planner.areas, world.limits.transition);
        let goal = transition_goal(whereabouts, &failed, areas, &self.held, world.now.utc_ms, limits);
        world.say("plan", format!("transition: {}", words::goal(&goal.into())));
        world.in_transition = true;
        self.skill = Some(world.skills.start(world.now.time, goal));
        world.timing.mark_skill(TimingPoint::TransitionStarted, goal.kind());
        Ok(Status::Running)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let Some(skill) = self.skill else { return Ok(Status::Running) };
        if self.held != world.held() {
            // It may lead into an area that may no longer be entered, or stop before one that may.
            world.skills.halt(skill);
            return self.start(world, ports);
        }
        match world.skills.progress(skill) {
            Some(Progress::Ended(SkillOutcome::Succeeded, _)) => Ok(Status::Success),
            Some(Progress::Ended(outcome, reason)) => {
                let words = ending(*outcome, reason);
                world.failure.reason = words.clone();
                ports.because("the transition goes on", words, "going on".to_owned());
                world.in_transition = false;
                Ok(Status::Failure)
            }
            _ => Ok(Status::Running),
        }
    }

    fn halt(&mut self, world: &mut World, _: &mut Ports<'_>) {
        world.in_transition = false;
        if let Some(skill) = self.skill.take() {
            world.skills.halt(skill);
        }
    }
}

/// Always fails, so that the row of its flag takes over.
pub(super) fn raise_transition_failed(world: &mut World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    let reason = std::mem::take(&mut world.failure.reason);
    world.raise(TRANSITION_FAILED, SELF, reason);
    // The flag has to be seen by the contingency branch before anything is sent.
    ports.tick_again();
    Ok(false)
}
