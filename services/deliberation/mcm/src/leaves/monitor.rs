//! Takes in the monitor's newest introspection. Raises flags, never lowers one.

use behavior_tree::{Leaf, LeafResult, Ports, Status};

use crate::world::World;

/// Always running.
pub(super) struct Monitor;

impl Leaf<World> for Monitor {
    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        if let Some(lost_from) = world.take_in_news() {
            ports.tick_at(lost_from.since_start());
        }
        Ok(Status::Running)
    }
}
