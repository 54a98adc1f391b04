//! The mission report.

use kittiwake_proto::v1;

use crate::world::World;

/// Sets the report, once.
pub(crate) fn publish(world: &mut World) {
    if world.mission.report.is_some() {
        return;
    }
    let Some(over) = world.mission.over.clone() else { return };
    let started = world.mission.started.unwrap_or(world.now.time);
    let objectives = world.planner.status.iter().flat_map(|it| &it.objectives).map(objective).collect();
    world.mission.report = Some(v1::MissionReport {
        outcome: over.outcome as i32,
        reason: over.reason,
        vehicle: world.mission.vehicle_name.clone(),
        duration_s: (world.now.time - started).as_secs_f64(),
        objectives,
    });
}

fn objective(it: &v1::Objective) -> v1::ObjectiveReport {
    v1::ObjectiveReport {
        name: it.name.clone(),
        state: it.state,
        reason: it.reason.clone(),
        plan_steps: it.plan_steps,
        replans: it.replans,
        permissions: it.permissions.clone(),
    }
}
