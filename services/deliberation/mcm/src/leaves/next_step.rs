//! Makes the step that was fetched during the last one the present one.

use behavior_tree::{Leaf, LeafResult, Ports, Status};
use domain::time::Time;

use crate::world::{NextStep as Next, World};

#[derive(Default)]
pub(super) struct NextStep {
    due: Time,
}

impl Leaf<World> for NextStep {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        self.due = world.next_step_due();
        self.tick(world, ports)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        match world.advance() {
            Next::Begun => {
                ports.tick_again();
                return Ok(Status::Success);
            }
            Next::None => ports.explain("the plan has no further step"),
            Next::Awaited if world.now() < self.due => {
                ports.tick_at(self.due.since_start());
                return Ok(Status::Running);
            }
            Next::Awaited => {
                world.drop_step();
                ports.explain("the planner did not say in time what comes next");
            }
        }
        Ok(Status::Failure)
    }

    fn halt(&mut self, world: &mut World, _: &mut Ports<'_>) {
        // The present step was flown; it must not be flown again after an interruption.
        world.drop_step();
    }
}
