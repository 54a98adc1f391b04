//! Takes in the monitor's newest introspection. Raises flags, never lowers one.

use behavior_tree::{Leaf, LeafResult, Ports, Status};

use crate::world::World;

pub(super) struct TakeInNews;

impl Leaf<World> for TakeInNews {
    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        if let Some(lost_from) = world.take_in_news() {
            ports.tick_at(lost_from.since_start());
        }
        Ok(Status::Running)
    }
}
