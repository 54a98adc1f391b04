//! Asking to enter an area, and whether the way is clear once that is granted.

use behavior_tree::{BuildError, In, Leaf, LeafResult, NodeSpec, Ports, Status};
use domain::geometry::Ned;
use domain::route::way_is_clear;
use kittiwake_proto::v1;

use crate::clients::permissions::Asking;
use crate::clients::planner::Next;
use crate::world::World;

/// Asks for one area until it is granted, refused, or never answered.
pub(super) struct RequestPermission {
    area: In<String>,
}

impl RequestPermission {
    pub(super) fn new(spec: &NodeSpec<'_>) -> Result<RequestPermission, BuildError> {
        Ok(RequestPermission { area: spec.input("area")? })
    }
}

impl Leaf<World> for RequestPermission {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let area = ports.read(self.area)?;
        let step_id = world.planner.step.as_ref().map_or(0, |it| it.id);
        if !world.permissions.holds(&area, world.now.time, world.limits.permission_margin) {
            world.say("permission", format!("asking for area {area}"));
            world.permissions.ask(world.now.time, &area, step_id, &world.limits, &mut world.outbox);
        }
        self.tick(world, ports)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let area = ports.read(self.area)?;
        match world.permissions.asking(world.now.time, &area, &world.limits, &mut world.outbox) {
            Asking::Granted => {
                world.permissions.stop_asking(&area);
                Ok(Status::Success)
            }
            Asking::Awaited => {
                if let Some(at) = world.permissions.answer_by(&area) {
                    ports.tick_at(at.since_start());
                }
                Ok(Status::Running)
            }
            Asking::Denied { silent, reason } => {
                world.permissions.stop_asking(&area);
                world.failure.reason = format!("area {area}: {reason}");
                ports.because("the area may be entered", reason.clone(), "granted".to_owned());
                world.failure.denials.push(v1::Denial { area, silent, reason });
                Ok(Status::Failure)
            }
        }
    }

    fn halt(&mut self, world: &mut World, ports: &mut Ports<'_>) {
        if let Ok(area) = ports.read(self.area) {
            world.permissions.stop_asking(&area);
        }
    }
}

/// Succeeds once the vehicle is where the step ends, or may fly straight on to the next step's goal.
pub(super) struct WayIsClear;

impl Leaf<World> for WayIsClear {
    fn tick(&mut self, world: &mut World, _: &mut Ports<'_>) -> LeafResult {
        let Some(vehicle) = world.vehicle else { return Ok(Status::Running) };
        let Next::Fetched(next) = &world.planner.next else { return Ok(Status::Running) };
        let here = world.planner.step.as_ref().and_then(target);
        let arrived = here.is_none_or(|it| vehicle.position.distance_m(it) <= world.limits.arrival_radius_m);
        let clear = || match next.as_deref().map(target) {
            // Land, takeoff and stop happen where this step ends.
            Some(None) => false,
            Some(Some(there)) => {
                way_is_clear(vehicle.position, there, &world.planner.areas, &world.held(), world.now.utc_ms)
            }
            None => false,
        };
        Ok(if arrived || clear() { Status::Success } else { Status::Running })
    }
}

/// Where a position step flies to; other steps stay where they are.
fn target(step: &v1::PlanStep) -> Option<Ned> {
    match step.nominal.as_ref()?.goal.as_ref()?.goal.as_ref()? {
        v1::skill_goal::Goal::Position(it) => Ned::try_from(it.target?).ok(),
        _ => None,
    }
}
