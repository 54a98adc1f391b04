//! Asks the planner for a plan until there is one, or until none is wanted any more.

use behavior_tree::{Leaf, LeafResult, Ports, Status};

use crate::decide::{Activity, Awaited, Decision};
use crate::world::World;

pub(super) struct Replan;

impl Leaf<World> for Replan {
    fn start(&mut self, world: &mut World, _: &mut Ports<'_>) -> LeafResult {
        world.begin_asking_for_plan();
        // The decision of this tick does not know yet that the step is over. A flag that counts from now on must not keep the planner
        // from being asked whether anything is left.
        if let Some(wait) = world.decision_now().wait {
            world.go_on_after(wait);
        }
        Ok(Status::Running)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let Decision { activity, wait, .. } = *world.decision();
        match (activity, wait) {
            (_, Some(wait)) => {
                world.go_on_after(wait);
                if wait.what == Awaited::Approval && wait.is_over(world.now()) {
                    ports.tick_again();
                }
                Ok(Status::Running)
            }
            (Activity::Fly, None) => {
                ports.tick_again();
                Ok(Status::Success)
            }
            (_, None) => {
                world.end_with_objectives();
                ports.explain("no objective is left");
                Ok(Status::Failure)
            }
        }
    }

    fn halt(&mut self, world: &mut World, _: &mut Ports<'_>) {
        // A plan that has just come, or is still on its way, was made for a state that has changed.
        world.stop_asking_for_plan();
    }
}
