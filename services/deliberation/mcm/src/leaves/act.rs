//! Flies a skill: wants it when started, gives it up when halted, answers as it ends.

use behavior_tree::{BuildError, In, Leaf, LeafResult, NodeSpec, Ports, Status};
use kittiwake_proto::v1::{SkillOutcome, TimingPoint};

use super::ports::Goal;
use crate::clients::skills::{Handle, Progress, ending};
use crate::world::World;

pub(super) struct Act {
    what: What,
    skill: Option<Handle>,
}

enum What {
    Port(In<Goal>),
    Fixed(domain::skill::Goal),
}

impl Act {
    /// What its port says.
    pub(super) fn with_port(spec: &NodeSpec<'_>) -> Result<Act, BuildError> {
        Ok(Act { what: What::Port(spec.input("goal")?), skill: None })
    }

    /// Always the same.
    pub(super) fn fixed(goal: domain::skill::Goal) -> Act {
        Act { what: What::Fixed(goal), skill: None }
    }
}

impl Leaf<World> for Act {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let goal = match &self.what {
            What::Port(port) => ports.read(*port)?.0,
            What::Fixed(goal) => *goal,
        };
        self.skill = Some(world.skills.start(world.now.time, goal));
        if world.acting.is_some() {
            world.timing.mark_flag(TimingPoint::ActionTriggered, goal.kind(), world.acting.clone());
        }
        Ok(Status::Running)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let progress = self.skill.and_then(|it| world.skills.progress(it));
        match progress {
            Some(Progress::Ended(SkillOutcome::Succeeded, _)) => Ok(Status::Success),
            Some(Progress::Ended(outcome, reason)) => {
                let words = ending(*outcome, reason);
                world.failure.reason = words.clone();
                ports.because("the skill succeeded", words, "succeeded".to_owned());
                Ok(Status::Failure)
            }
            Some(_) => Ok(Status::Running),
            None => Err("ticked without having been started".into()),
        }
    }

    fn halt(&mut self, world: &mut World, _: &mut Ports<'_>) {
        if let Some(skill) = self.skill.take() {
            world.skills.halt(skill);
        }
    }
}
