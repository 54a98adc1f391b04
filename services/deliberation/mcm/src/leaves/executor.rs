//! Flies the present step: makes a subtree for it from the templates and passes ticks and results.

use behavior_tree::{Leaf, LeafError, LeafResult, PortValue, Ports, Status, Tree, Value};
use kittiwake_proto::v1::{SkillKind, TimingPoint};

use super::ports::{Condition, Goal};
use crate::words;
use crate::world::World;

#[derive(Default)]
pub(super) struct NominalExecutor {
    subtree: Option<Tree<World>>,
    step_id: u64,
    kind: SkillKind,
}

impl Leaf<World> for NominalExecutor {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        world.discarded.extend(self.subtree.take());
        let Some(step) = world.planner.step.clone() else {
            ports.because_of("there is a step to fly");
            return Ok(Status::Failure);
        };
        world.failure = Default::default();
        let (number, count) = (world.planner.step_number, world.planner.step_count);
        world.say("step", format!("step {number} of {count}: {}", words::step(&step)));
        let subtree = match build(&step, world, ports) {
            Ok(subtree) => subtree,
            Err(error) => {
                let (now, pause) = (world.now.time, world.limits.retry_pause);
                world.planner.fail(now, format!("the step cannot be built: {error}"), Vec::new(), pause);
                return Err(error);
            }
        };
        self.step_id = step.id;
        self.subtree = Some(subtree);
        self.kind = kind(&step);
        let answer = self.tick(world, ports);
        if matches!(answer, Ok(Status::Running)) {
            world.timing.mark_skill(TimingPoint::StepStarted, self.kind);
        }
        answer
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        if let Some(reason) = world.planner.withdrawal().map(str::to_owned) {
            if let Some(mut subtree) = self.subtree.take() {
                subtree.halt(ports.now(), world);
            }
            world.say("step", format!("step {} given up: {reason}", world.planner.step_number));
            world.planner.give_up();
            ports.because("the step is still wanted", reason, "wanted".to_owned());
            return Ok(Status::Failure);
        }
        let subtree = self.subtree.as_mut().ok_or("no step was started")?;
        let answer = ports.tick_tree(subtree, world);
        match answer {
            Status::Success => {
                world.timing.mark_skill(TimingPoint::StepSucceeded, self.kind);
                if let Some(state) = world.planning_state() {
                    world.planner.done(self.step_id, state);
                }
                world.say("step", format!("step {} succeeded", world.planner.step_number));
            }
            Status::Failure => {
                world.timing.mark_skill(TimingPoint::StepFailed, self.kind);
                let failure = std::mem::take(&mut world.failure);
                world.say("step", format!("step {} failed: {}", world.planner.step_number, failure.reason));
                let (now, pause) = (world.now.time, world.limits.retry_pause);
                world.planner.fail(now, failure.reason, failure.denials, pause);
            }
            Status::Running | Status::Skipped => {}
        }
        Ok(answer)
    }

    fn halt(&mut self, world: &mut World, ports: &mut Ports<'_>) {
        world.timing.mark_skill(TimingPoint::StepHalted, self.kind);
        if let Some(mut subtree) = self.subtree.take() {
            ports.halt_tree(&mut subtree, world);
            world.discarded.push(subtree);
        }
        let reason = match world.flags.first() {
            Some(flag) => ["interrupted by `", flag, "`"].concat(),
            None => "interrupted".to_owned(),
        };
        world.planner.interrupt(reason, Vec::new());
    }

    fn subtree(&self) -> Option<&Tree<World>> {
        self.subtree.as_ref()
    }
}

fn kind(step: &kittiwake_proto::v1::PlanStep) -> SkillKind {
    let goal = step.nominal.as_ref().and_then(|it| it.goal).and_then(|it| domain::skill::Goal::try_from(it).ok());
    goal.map_or(SkillKind::Unspecified, |it| it.kind())
}

fn build(step: &kittiwake_proto::v1::PlanStep, world: &World, ports: &Ports<'_>) -> Result<Tree<World>, LeafError> {
    let set = step.nominal.clone().ok_or("it has no parameters")?;
    let goal = domain::skill::Goal::try_from(set.goal.ok_or("it has no goal")?)?;
    let mut parameters: Vec<(String, Value)> = vec![
        ("goal".into(), Goal(goal).into_value()),
        ("precondition".into(), Condition(set.precondition.unwrap_or_default()).into_value()),
        ("invariant".into(), Condition(set.invariant.unwrap_or_default()).into_value()),
    ];
    let template = match step.ask_permissions.len() {
        0 => "step".to_owned(),
        count => format!("step_asking_{count}"),
    };
    for (index, area) in step.ask_permissions.iter().enumerate() {
        parameters.push((format!("area_{}", index + 1), Value::Text(area.as_str().into())));
    }
    let parameters: Vec<(&str, Value)> = parameters.iter().map(|(key, value)| (key.as_str(), value.clone())).collect();
    Ok(world.library.instantiate_with(&template, &parameters, ports.waker())?)
}
