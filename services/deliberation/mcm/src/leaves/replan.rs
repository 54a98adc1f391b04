//! Asks the planner for a plan until there is one, or until none is wanted any more.

use behavior_tree::{Leaf, LeafResult, Ports, Status};

use crate::world::{PlanProgress, World};

pub(super) struct Replan;

impl Leaf<World> for Replan {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        world.begin_asking_for_plan();
        self.tick(world, ports)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        match world.pursue_plan() {
            PlanProgress::Awaited(until) => {
                if let Some(at) = until {
                    ports.tick_at(at.since_start());
                }
                Ok(Status::Running)
            }
            PlanProgress::Changed => {
                ports.tick_again();
                Ok(Status::Running)
            }
            PlanProgress::Adopted => {
                ports.tick_again();
                Ok(Status::Success)
            }
            PlanProgress::Finished => {
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
