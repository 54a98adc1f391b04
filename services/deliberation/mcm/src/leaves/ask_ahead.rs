//! Asking for permissions that later steps need, beside the flight of a step.

use behavior_tree::{In, Leaf, LeafResult, Ports, Status};
use domain::plan::PermissionNeed;
use domain::time::Time;

use super::ports::Ahead;
use crate::clients::permissions::Asking;
use crate::world::World;

/// Asks for each permission when it is time, and succeeds once none is awaited any more, however they were answered: what a
/// refusal means is up to the step that needs the permission.
///
/// Halted, it leaves the requests as they are, because the step may just have been flown: the step that needs them takes them
/// over. What ends the flight of the plan ends them too.
pub(super) struct AskAhead {
    pub(super) permissions: In<Ahead>,
    pub(super) open: Vec<Open>,
}

pub(super) struct Open {
    need: PermissionNeed,
    /// When it is asked for.
    at: Time,
    is_asked: bool,
}

impl Leaf<World> for AskAhead {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let now = world.now();
        let ahead = ports.read(self.permissions)?.0.into_iter();
        self.open = ahead.map(|it| Open { need: it.need, at: now + it.after, is_asked: false }).collect();
        self.tick(world, ports)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        self.open.retain_mut(|it| it.is_awaited(world, ports));
        Ok(if self.open.is_empty() { Status::Success } else { Status::Running })
    }
}

impl Open {
    /// Asks for it when it is time; whether it is still to be waited for.
    fn is_awaited(&mut self, world: &mut World, ports: &mut Ports<'_>) -> bool {
        if world.now() < self.at {
            ports.tick_at(self.at.since_start());
            return true;
        }
        if !self.is_asked {
            self.is_asked = true;
            world.ask_permission_ahead(&self.need);
        }
        match world.asking(&self.need) {
            Asking::Granted => {
                world.stop_asking(&self.need.area);
                false
            }
            // The step that needs it asks again.
            Asking::Lost => false,
            Asking::Awaited(overdue) => {
                ports.tick_at(overdue.since_start());
                true
            }
            Asking::Denied => {
                world.note_denial_ahead(&self.need.area);
                false
            }
        }
    }
}
