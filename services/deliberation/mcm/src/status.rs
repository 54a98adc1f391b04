//! What the manager tells about itself: on every change, and twice a second.

use std::sync::Arc;

use behavior_tree::Tree;
use domain::time::Time;
use kittiwake_proto::v1;

use crate::config::Verdict;
use crate::flags::age_s;
use crate::operator;
use crate::snapshot::snapshot;
use crate::world::World;

/// Publishes the status and the tree.
#[derive(Default)]
pub(crate) struct Reporter {
    last: Option<Essence>,
    next: Time,
}

/// What a change of is told at once; the rest waits for the next turn.
#[derive(Debug, Clone, PartialEq)]
struct Essence {
    phase: v1::MissionPhase,
    step: u64,
    flags: Vec<String>,
    acting: Option<Arc<str>>,
    in_transition: bool,
    reported: bool,
    start_awaited: bool,
    paused: bool,
    proposed: Option<u64>,
    acknowledged: usize,
}

impl Reporter {
    pub(crate) fn next(&self) -> Time {
        self.next
    }

    pub(crate) fn report(&mut self, tree: &Tree<World>, world: &mut World, ended: bool, ticks: u64) {
        let essence = Essence {
            phase: phase(world, ended),
            step: world.planner.step.as_ref().map_or(0, |it| it.id),
            flags: world.flags.iter().map(|(name, _)| name.to_owned()).collect(),
            acting: world.acting.clone(),
            in_transition: world.in_transition,
            reported: world.mission.report.is_some(),
            start_awaited: world.awaits_start(),
            paused: operator::is_paused(world),
            proposed: world.planner.proposal().map(|it| it.plan.revision),
            acknowledged: world.flags.iter().filter(|(_, it)| it.acknowledged_by.is_some()).count(),
        };
        let due = self.next <= world.now.time;
        if !due && self.last.as_ref() == Some(&essence) {
            return;
        }
        if due {
            self.next = world.now.time + world.limits.report_period;
            world.outbox.publish(snapshot(tree, world.now.time.since_start()));
        }
        let status = status(&essence, tree, world, ticks);
        self.last = Some(essence);
        world.outbox.publish(status);
        if due {
            world.timing.recent.turn();
        }
    }
}

fn phase(world: &World, ended: bool) -> v1::MissionPhase {
    if ended {
        v1::MissionPhase::Over
    } else if world.acting.is_some() {
        v1::MissionPhase::Contingency
    } else if world.mission.over.is_some() {
        v1::MissionPhase::Ending
    } else if world.mission.started.is_none() {
        v1::MissionPhase::Starting
    } else if world.planner.step.is_some() {
        v1::MissionPhase::Nominal
    } else {
        v1::MissionPhase::Replanning
    }
}

fn status(essence: &Essence, tree: &Tree<World>, world: &World, ticks: u64) -> v1::McmStatus {
    let (skill, skill_id) =
        world.skills.present().map_or((v1::SkillKind::Unspecified, 0), |(goal, id)| (goal.kind(), id));
    v1::McmStatus {
        phase: essence.phase as i32,
        step: world.planner.step.clone(),
        step_number: world.planner.step.as_ref().map_or(0, |_| world.planner.step_number),
        step_count: world.planner.step.as_ref().map_or(0, |_| world.planner.step_count),
        skill: skill as i32,
        skill_id,
        distance_left_m: world.skills.distance_left_m(),
        contingencies: contingencies(world),
        acting: world.acting.as_deref().unwrap_or_default().to_owned(),
        tree_status: tree.status().word().to_owned(),
        ticks,
        report: world.mission.report.clone(),
        in_transition: world.in_transition,
        start_awaited: essence.start_awaited,
        paused: essence.paused,
        plan_approval: world.planner.proposal().map(|it| v1::PlanApproval {
            plan: Some(it.plan.clone()),
            left_s: (it.until - world.now.time).as_secs_f64(),
            approved_by_default: world.limits.plan_approval_default == Verdict::Approve,
        }),
        tick_time: world.timing.recent.told(),
    }
}

fn contingencies(world: &World) -> Vec<v1::ActiveContingency> {
    let rows = world.table.rows().iter();
    rows.filter_map(|row| {
        let flag = world.flags.get(&row.flag)?;
        Some(v1::ActiveContingency {
            flag: row.flag.clone(),
            priority: row.priority,
            action: row.actions.join(", else "),
            since_s: age_s(flag, world.now.time),
            reason: flag.reason.clone(),
            acknowledged_by: flag.acknowledged_by.clone().unwrap_or_default(),
        })
    })
    .collect()
}
