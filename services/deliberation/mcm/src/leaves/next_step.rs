//! Makes the next step of the plan the present one.

use behavior_tree::{Leaf, LeafResult, Ports, Status};

use crate::world::World;

pub(super) struct NextStep;

impl Leaf<World> for NextStep {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        self.tick(world, ports)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        if world.advance() {
            ports.tick_again();
            return Ok(Status::Success);
        }
        ports.explain("the plan has no further step");
        Ok(Status::Failure)
    }

    fn halt(&mut self, _: &mut World, _: &mut Ports<'_>) {}
}
