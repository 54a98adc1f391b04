//! Asking for permissions, and whether the vehicle may then fly on.

use behavior_tree::{In, Leaf, LeafResult, Ports, Status};

use super::ports::Needs;
use crate::clients::permissions::Asking;
use crate::world::World;

/// Asks for permissions until all of them are granted, or one is denied or never answered.
pub(super) struct RequestPermissions {
    pub(super) needs: In<Needs>,
}

impl Leaf<World> for RequestPermissions {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        for need in &ports.read(self.needs)?.0 {
            world.ask_permission(need);
        }
        self.tick(world, ports)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let needs = ports.read(self.needs)?.0;
        let mut answer = Status::Success;
        for need in &needs {
            match world.asking(need) {
                Asking::Granted => world.stop_asking(&need.area),
                // While another one was awaited: it was revoked, or has become too short.
                Asking::Lost => {
                    let answer_by = world.ask_permission(need);
                    ports.tick_at(answer_by.since_start());
                    answer = Status::Running;
                }
                Asking::Awaited(overdue) => {
                    ports.tick_at(overdue.since_start());
                    answer = Status::Running;
                }
                Asking::Denied => {
                    needs.iter().for_each(|need| world.stop_asking(&need.area));
                    ports.explain(format!("area {}: {}", need.area, world.denial(&need.area).unwrap_or("denied")));
                    return Ok(Status::Failure);
                }
            }
        }
        Ok(answer)
    }

    fn halt(&mut self, world: &mut World, ports: &mut Ports<'_>) {
        if let Ok(needs) = ports.read(self.needs) {
            needs.0.iter().for_each(|need| world.stop_asking(&need.area));
        }
    }
}

/// Succeeds once the vehicle is where the step ends, or may fly straight on to the next step's goal.
pub(super) struct WayIsClear;

impl Leaf<World> for WayIsClear {
    fn tick(&mut self, world: &mut World, _: &mut Ports<'_>) -> LeafResult {
        Ok(if world.may_go_on() { Status::Success } else { Status::Running })
    }
}
