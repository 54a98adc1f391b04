//! Asks the planner for a plan, beside the tree, until there is one or none is needed any more.

use behavior_tree::{Leaf, LeafResult, Ports, Status};
use kittiwake_proto::v1::{MissionOutcome, ObjectiveState};

use crate::clients::planner::Replanning;
use crate::operator;
use crate::world::World;

pub(super) struct Replan;

impl Leaf<World> for Replan {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        world.planner.replanning = Replanning::Idle;
        self.tick(world, ports)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        if world.awaits_start() {
            return Ok(Status::Running);
        }
        match world.planner.replanning.clone() {
            Replanning::Proposed(proposal) if proposal.until <= world.now.time => {
                let verdict = world.limits.plan_approval_default;
                operator::decide_plan(world, verdict, "nobody has decided in time");
                ports.tick_again();
            }
            Replanning::Proposed(proposal) => ports.tick_at(proposal.until.since_start()),
            Replanning::Idle if world.now.time < world.planner.ask_from => {
                ports.tick_at(world.planner.ask_from.since_start());
            }
            Replanning::Idle => ask(world),
            Replanning::Late(at) if at <= world.now.time => ask(world),
            Replanning::Hold { until, revision, held }
                if until <= world.now.time || revision != world.permissions.revision || held != world.held() =>
            {
                ask(world);
            }
            Replanning::Late(at) | Replanning::Hold { until: at, .. } => ports.tick_at(at.since_start()),
            Replanning::Asked(_) => {}
            Replanning::Planned => {
                ports.tick_again();
                return Ok(Status::Success);
            }
            // The planner's own account may arrive a little after its answer.
            Replanning::Finished if !world.planner.all_settled() => {}
            Replanning::Finished => {
                finish(world);
                ports.because_of("an objective is left");
                return Ok(Status::Failure);
            }
        }
        Ok(Status::Running)
    }

    fn halt(&mut self, world: &mut World, _: &mut Ports<'_>) {
        // A plan that has just come, or is still on its way, was made for a state that no longer is.
        if world.planner.replanning == Replanning::Planned {
            world.planner.drop_step();
        }
        world.planner.replanning = Replanning::Idle;
    }
}

fn ask(world: &mut World) {
    // Steps that were flown come first, or the planner would plan them again.
    if let Some(state) = world.planning_state().filter(|_| world.planner.is_up_to_date()) {
        world.mission.started.get_or_insert(world.now.time);
        world.planner.replan(state, world.limits.request_timeout, &mut world.outbox);
    }
}

fn finish(world: &mut World) {
    let objectives = world.planner.status.iter().flat_map(|it| &it.objectives);
    let failed: Vec<_> = objectives
        .filter(|it| it.state() != ObjectiveState::Success)
        .map(|it| format!("objective `{}` failed: {}", it.name, it.reason))
        .collect();
    if failed.is_empty() {
        world.end_mission(MissionOutcome::Success, "every objective was achieved");
    } else {
        world.end_mission(MissionOutcome::Failure, failed.join("; "));
    }
}
