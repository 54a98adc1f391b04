//! The end: holds in the air, reports, and is done once the vehicle stands disarmed on the ground.

use behavior_tree::{Leaf, LeafResult, Ports, Status};
use domain::skill::Goal;
use domain::time::Time;
use kittiwake_proto::v1::MissionOutcome;
use std::time::Duration;

use crate::clients::skills::{Handle, Progress};
use crate::report;
use crate::world::World;

/// The autopilot disarms by itself after a landing (PX4: 2 s, COM_DISARM_LAND); not awaited for ever.
const DISARM_LIMIT: Duration = Duration::from_secs(10);

#[derive(Default)]
pub(super) struct EndMission {
    hold: Option<Handle>,
    landed_at: Option<Time>,
}

impl Leaf<World> for EndMission {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        (self.hold, self.landed_at) = (None, None);
        world.acting = None;
        // Nothing else may bring the tree here; if something does, it must not go on by itself.
        world.end_mission(MissionOutcome::Failure, "the nominal behavior failed without a reason");
        if let Some(over) = world.mission.over.clone() {
            world.say("mission", format!("over: {}", over.reason));
        }
        if world.is_flying() {
            self.hold = Some(world.skills.start(world.now.time, Goal::Stop));
            return Ok(Status::Running);
        }
        self.tick(world, ports)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let now = world.now.time;
        let Some(vehicle) = world.vehicle else {
            ports.because_of("somebody says that the vehicle is on the ground");
            return Ok(Status::Running);
        };
        if vehicle.flying {
            // Known only now to be in the air, or in the air again.
            if self.hold.is_none() {
                self.hold = Some(world.skills.start(now, Goal::Stop));
                return Ok(Status::Running);
            }
            let holds = self.hold.and_then(|it| world.skills.progress(it));
            if matches!(holds, None | Some(Progress::Ended(..))) {
                report::publish(world);
            }
            return Ok(Status::Running);
        }
        let landed_at = *self.landed_at.get_or_insert(now);
        if vehicle.armed && now - landed_at < DISARM_LIMIT {
            ports.tick_at((landed_at + DISARM_LIMIT).since_start());
            return Ok(Status::Running);
        }
        report::publish(world);
        Ok(Status::Failure)
    }

    fn halt(&mut self, world: &mut World, _: &mut Ports<'_>) {
        if let Some(hold) = self.hold.take() {
            world.skills.halt(hold);
        }
    }
}
