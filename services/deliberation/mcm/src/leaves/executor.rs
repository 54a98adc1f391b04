//! Flies the present step: makes a subtree for it from the templates, and passes on ticks and results.

use std::sync::Arc;

use behavior_tree::{Leaf, LeafError, LeafResult, PortValue, Ports, Status, Tree, Value};
use domain::plan::Step;

use super::ports::{Ahead, Condition, Goal, Needs};
use crate::world::World;

/// The template of a step, of one during which permissions are asked for, and of the same with permissions that later steps need.
const STEP: &str = "step";
const STEP_ASKING: &str = "step_asking";
const STEP_ASKING_AHEAD: &str = "step_asking_ahead";
const STEP_ASKING_AND_ASKING_AHEAD: &str = "step_asking_and_asking_ahead";

#[derive(Default)]
pub(super) struct NominalExecutor {
    flown: Option<(Arc<Step>, Tree<World>)>,
}

impl Leaf<World> for NominalExecutor {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        self.flown = None;
        if world.conditions_are_late() {
            return Ok(Status::Running);
        }
        let Some(step) = world.begin_step() else {
            ports.explain("there is no step to fly");
            return Ok(Status::Failure);
        };
        let subtree = match build(&step, world, ports) {
            Ok(subtree) => subtree,
            Err(error) => {
                world.step_failed(format!("the step cannot be built: {error}"));
                return Err(error);
            }
        };
        self.flown = Some((step, subtree));
        self.tick(world, ports)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        if let Some(reason) = world.withdrawal().map(str::to_owned) {
            if let Some((_, subtree)) = &mut self.flown {
                ports.halt_tree(subtree, world);
            }
            self.flown = None;
            world.give_up_step(&reason);
            ports.explain(format!("given up: {reason}"));
            return Ok(Status::Failure);
        }
        let Some((step, subtree)) = self.flown.as_mut() else { return self.start(world, ports) };
        let answer = ports.tick_tree(subtree, world);
        match answer {
            Status::Success => world.step_flown(step),
            Status::Failure => world.step_failed(reason(subtree)),
            Status::Running | Status::Skipped => {}
        }
        Ok(answer)
    }

    fn halt(&mut self, world: &mut World, ports: &mut Ports<'_>) {
        if let Some((_, subtree)) = &mut self.flown {
            ports.halt_tree(subtree, world);
        }
        self.flown = None;
        world.step_interrupted();
    }

    fn subtree(&self) -> Option<&Tree<World>> {
        self.flown.as_ref().map(|(_, subtree)| subtree)
    }
}

/// Makes the next step of the plan the present one.
pub(super) fn next_step(world: &mut World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    let has_next = world.advance();
    if has_next {
        ports.tick_again();
    } else {
        ports.explain("the plan has no further step");
    }
    Ok(has_next)
}

/// Why a subtree failed, as the engine recorded it.
fn reason(subtree: &Tree<World>) -> String {
    subtree
        .last_failure()
        .and_then(|node| node.why)
        .map_or_else(|| "no leaf said why".to_owned(), |record| record.cause.to_string())
}

fn build(step: &Step, world: &World, ports: &Ports<'_>) -> Result<Tree<World>, LeafError> {
    let set = &step.nominal;
    let mut parameters: Vec<(&str, Value)> = vec![
        ("goal", Goal(set.goal.clone()).into_value()),
        ("precondition", Condition(set.precondition.clone()).into_value()),
        ("invariant", Condition(set.invariant.clone()).into_value()),
    ];
    let (asks, asks_ahead) = (!step.ask.is_empty(), !step.ask_ahead.is_empty());
    if asks {
        parameters.push(("permissions", Needs(step.ask.clone()).into_value()));
    }
    if asks_ahead {
        parameters.push(("ahead", Ahead(step.ask_ahead.clone()).into_value()));
    }
    let template = match (asks, asks_ahead) {
        (false, false) => STEP,
        (true, false) => STEP_ASKING,
        (false, true) => STEP_ASKING_AHEAD,
        (true, true) => STEP_ASKING_AND_ASKING_AHEAD,
    };
    Ok(world.library().instantiate_with(template, &parameters, ports.waker())?)
}
