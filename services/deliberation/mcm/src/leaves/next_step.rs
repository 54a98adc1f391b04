//! Makes the step that was fetched while the last one flew the present one.

use behavior_tree::{Leaf, LeafResult, Ports, Status};
use domain::time::Time;

use crate::clients::planner::Next;
use crate::world::World;

#[derive(Default)]
pub(super) struct NextStep {
    give_up_at: Time,
}

impl Leaf<World> for NextStep {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        self.give_up_at = world.now.time + world.limits.request_timeout;
        self.tick(world, ports)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        match &world.planner.next {
            Next::Fetched(_) => {
                if world.planner.advance().is_some() {
                    ports.tick_again();
                    return Ok(Status::Success);
                }
                ports.because_of("the plan has a next step");
            }
            Next::Unknown | Next::Asked if world.now.time < self.give_up_at => {
                ports.tick_at(self.give_up_at.since_start());
                return Ok(Status::Running);
            }
            Next::Unknown | Next::Asked => {
                world.planner.drop_step();
                ports.because_of("the planner said what comes next in time");
            }
        }
        Ok(Status::Failure)
    }

    fn halt(&mut self, world: &mut World, _: &mut Ports<'_>) {
        // The present step was flown; it must not be flown again after whatever came between.
        world.planner.drop_step();
    }
}
