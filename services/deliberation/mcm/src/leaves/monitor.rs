//! Takes in what the monitor process says: the newest introspection, and flags. Raises flags, never lowers one.

use behavior_tree::{Leaf, LeafResult, Ports, Status};
use kittiwake_proto::v1::{SkillKind, TimingPoint};

use crate::world::{SELF, World};

/// The flag raised when the monitor process itself has gone quiet.
const INTROSPECTION_LOST: &str = "introspection_lost";

/// Always running.
pub(super) struct Monitor;

impl Leaf<World> for Monitor {
    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        if let Some(vehicle) = world.inbox.vehicle.take() {
            world.vehicle = Some(world.shown.correct(vehicle, world.now.time, world.limits.introspection));
            world.flags.condition_gone(INTROSPECTION_LOST, SELF);
        }
        for event in std::mem::take(&mut world.inbox.flags) {
            if event.raised {
                let known = world.flags.number(&event.name).map(|row| world.flags.name(row).clone());
                world.timing.mark_flag(TimingPoint::FlagSeen, SkillKind::Unspecified, known);
                world.raise(&event.name, event.source, event.reason);
            } else {
                world.flags.condition_gone(&event.name, &event.source);
            }
        }
        if let Some(vehicle) = world.vehicle
            && vehicle.flying
        {
            let silent_from = vehicle.seen_at + world.limits.introspection;
            if silent_from <= world.now.time && world.flags.number(INTROSPECTION_LOST).is_some() {
                world.raise(INTROSPECTION_LOST, SELF, "the monitor has gone quiet");
            } else {
                ports.tick_at(silent_from.since_start());
            }
        }
        Ok(Status::Running)
    }
}
