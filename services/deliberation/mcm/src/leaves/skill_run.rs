//! A skill that a leaf flies: started, watched, given up.

use std::sync::Arc;

use behavior_tree::{LeafResult, Ports, Status};
use domain::skill::{Goal, SkillOutcome};
use domain::task::TaskGoal;

use crate::clients::skills::{Handle, Progress, ending};
use crate::world::World;

#[derive(Debug, Clone, Copy)]
pub(super) struct SkillRun {
    handle: Handle,
    lands: bool,
}

impl SkillRun {
    pub(super) fn start(world: &mut World, goal: Goal) -> SkillRun {
        SkillRun::start_with(world, goal, Vec::new())
    }

    /// With tasks that go on meanwhile.
    pub(super) fn start_with(world: &mut World, goal: Goal, along: Vec<Arc<TaskGoal>>) -> SkillRun {
        let lands = goal.lands();
        SkillRun { handle: world.start_skill(goal, along), lands }
    }

    /// Those of its tasks that may go on, if one of them may not any more.
    pub(super) fn broken_along(self, world: &mut World) -> Option<Vec<Arc<TaskGoal>>> {
        world.broken_along(self.handle)
    }

    /// The tasks along it that go on.
    pub(super) fn along(self, world: &World) -> Vec<Arc<TaskGoal>> {
        world.along(self.handle)
    }

    /// Its progress: success with its outcome, failure with the reason for any other outcome.
    pub(super) fn poll(self, world: &World, ports: &mut Ports<'_>) -> LeafResult {
        match world.skill_progress(self.handle) {
            Some(Progress::Ended(SkillOutcome::Succeeded, _)) => Ok(Status::Success),
            Some(Progress::Ended(outcome, reason)) => {
                ports.explain(ending(*outcome, reason));
                Ok(Status::Failure)
            }
            Some(_) => Ok(Status::Running),
            None => Err("the skill was forgotten while it was flown".into()),
        }
    }

    /// Whether it has ended, with any outcome.
    pub(super) fn is_over(self, world: &World) -> bool {
        matches!(world.skill_progress(self.handle), None | Some(Progress::Ended(..)))
    }

    /// Whether it was a landing that took too long.
    pub(super) fn did_not_come_down(self, world: &World) -> bool {
        let has_timed_out =
            matches!(world.skill_progress(self.handle), Some(Progress::Ended(SkillOutcome::TimedOut, _)));
        self.lands && has_timed_out
    }

    pub(super) fn halt(self, world: &mut World) {
        world.halt_skill(self.handle);
    }
}
