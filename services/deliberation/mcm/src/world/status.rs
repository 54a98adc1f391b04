//! What the manager publishes about itself: on every change, and twice a second.

use std::collections::BTreeSet;

use behavior_tree::Tree;
use domain::mission::{MissionReport, ObjectiveReport, ObjectiveStatus, Progress};
use domain::time::Time;
use kittiwake_proto::v1;

use super::World;
use super::alternates::MOST_TOLD;
use crate::clients::planner::News;
use crate::config::Verdict;
use crate::decide::{Activity, Wait};
use crate::flags::age_s;
use crate::snapshot::snapshot;
use crate::tick_time::TickTimes;

/// Publishes the status and the tree.
#[derive(Default)]
pub(crate) struct Reporter {
    last: Option<Headline>,
    /// When the next period begins.
    pub(crate) next: Time,
    last_mission: Option<News>,
    next_mission: Time,
    pub(crate) tick_times: TickTimes,
    /// As they were told last: between two periods a change of the status does not wait for them.
    tick_time: Option<v1::TickTime>,
    pub(crate) leaves_out_tree: bool,
}

/// The part of the status whose changes are published at once; other changes wait for the next period.
#[derive(Debug, Clone, PartialEq)]
struct Headline {
    activity: Activity,
    step: u64,
    flags: Vec<usize>,
    in_transition: bool,
    reported: bool,
    start_awaited: bool,
    paused: bool,
    proposed: Option<u64>,
    acknowledged: usize,
    uninspected_crash: String,
    entered: Vec<String>,
}

impl Reporter {
    /// Publishes what is due. `ticks`: how often the tree was ticked.
    pub(crate) fn report(&mut self, tree: &Tree<World>, world: &mut World, ticks: u64) {
        self.report_mission(world);
        let headline = world.headline();
        let due = self.next <= world.now.time;
        if !due && self.last.as_ref() == Some(&headline) {
            return;
        }
        if due {
            self.next = world.now.time + world.setup.limits.report_period;
            self.tick_time = self.tick_times.told();
            self.tick_times.turn();
            if !self.leaves_out_tree {
                world.out.outbox.publish(snapshot(tree, world.now.time.since_start()));
            }
        }
        let status = v1::McmStatus { ticks, tick_time: self.tick_time, ..world.status(&headline, tree) };
        self.last = Some(headline);
        world.out.outbox.publish(status);
    }

    /// The mission may be megabytes: half as often as the rest, and on every change.
    fn report_mission(&mut self, world: &mut World) {
        let news = world.planner.news();
        if world.now.time < self.next_mission && self.last_mission == Some(news) {
            return;
        }
        (self.last_mission, self.next_mission) = (Some(news), world.now.time + world.setup.limits.report_period * 2);
        let told = world.planner.told();
        world.out.outbox.publish(v1::MissionStatus::from(told));
    }
}

impl World {
    pub(crate) fn make_report(&mut self) {
        let Some(over) = &mut self.mission.over else { return };
        if over.report.is_some() {
            return;
        }
        let now_s = self.mission.clock.seconds(self.now.time.as_secs_f64());
        let objectives = self.planner.mission.status.objectives.iter();
        over.report = Some(MissionReport {
            outcome: over.outcome,
            reason: over.reason.clone(),
            vehicle: self.mission.vehicle_name.clone(),
            mission: self.planner.mission.status.mission.clone(),
            duration_s: self.mission.started_s.map_or(0.0, |it| (now_s - it).max(0.0)),
            objectives: objectives.map(objective).collect(),
        });
    }

    fn headline(&self) -> Headline {
        let decision = self.decision_now();
        Headline {
            activity: decision.activity,
            step: self.planner.flight.step().map_or(0, |(step, ..)| step.id.0),
            flags: self.flags.rows_up().collect(),
            in_transition: self.answer.in_transition,
            reported: self.report().is_some(),
            start_awaited: decision.wait.is_some_and(Wait::is_for_start),
            paused: self.is_paused(),
            proposed: self.planner.request.proposal().map(|(plan, _)| plan.revision),
            acknowledged: self.flags.iter().filter(|(_, flag)| flag.acknowledged_by.is_some()).count(),
            uninspected_crash: self.uninspected_crash().unwrap_or_default().to_owned(),
            entered: self.entered_without_permission(),
        }
    }

    fn status(&self, headline: &Headline, tree: &Tree<World>) -> v1::McmStatus {
        let (skill, skill_id) =
            self.skills.present().map_or((v1::SkillKind::Unspecified, 0), |(goal, id)| (goal.skill().into(), id));
        let (step, step_number, step_count) = match self.planner.flight.step() {
            Some((step, number, count)) => (Some((**step).clone().into()), number, count),
            None => (None, 0, 0),
        };
        let plan_approval = self.planner.request.proposal().map(|(plan, until)| v1::PlanApproval {
            plan: Some(plan.clone().into()),
            left_s: (until - self.now.time).as_secs_f64(),
            approved_by_default: self.setup.limits.config.plan_approval_default == Verdict::Approve,
        });
        v1::McmStatus {
            phase: v1::MissionPhase::from(headline.activity) as i32,
            step,
            step_number,
            step_count,
            skill: skill as i32,
            skill_id,
            distance_left_m: self.skills.distance_left_m(),
            contingencies: self.active_contingencies(),
            acting: self.acting(headline.activity),
            tree_status: tree.status().word().to_owned(),
            report: self.report().cloned().map(Into::into),
            in_transition: headline.in_transition,
            start_awaited: headline.start_awaited,
            paused: headline.paused,
            plan_approval,
            memory: Some(self.memory.health.clone().into()),
            ends: self.ending().unwrap_or_default(),
            response_way: self.told_response_way(),
            alternates: self.seen_alternates().iter().take(MOST_TOLD).map(Into::into).collect(),
            energy: self.told_energy(),
            progress: self.told_progress(),
            mission_time_s: Some(self.mission.clock.seconds(self.now.time.as_secs_f64())),
            began_utc_ms: self.mission.clock.began_utc_ms(),
            awaited: self.permissions.awaited(self.now.time),
            told: Some(self.monitor.told.to_wire(self.now.time)),
            uninspected_crash: headline.uninspected_crash.clone(),
            entered_without_permission: headline.entered.clone(),
            skills_needed: self.skills_needed(),
            ..v1::McmStatus::default()
        }
    }

    /// The declared skills that the rest of the mission uses.
    pub(super) fn skills_needed(&self) -> Vec<String> {
        let waiting = self.planner.mission.status.objectives.iter().filter(|it| it.progress == Progress::Waiting);
        let tasks = waiting.flat_map(|it| {
            let terms = &it.objective.terms;
            terms.tasks.iter().skip(it.tasks_done).chain(&terms.along)
        });
        let names: BTreeSet<&String> = tasks.map(|it| &it.skill).collect();
        names.into_iter().cloned().collect()
    }

    /// The flag that is responded to.
    fn acting(&self, activity: Activity) -> String {
        if let Activity::Respond(row) = activity { self.flags.name(row).to_string() } else { String::new() }
    }

    fn active_contingencies(&self) -> Vec<v1::ActiveContingency> {
        let up = self.flags.up().map(|(row, flag)| (&self.setup.table.rows()[row], flag));
        up.map(|(row, flag)| v1::ActiveContingency {
            flag: row.flag.clone(),
            priority: row.priority,
            action: row.response(),
            since_s: age_s(flag, self.now.time),
            reason: flag.reason.clone(),
            acknowledged_by: flag.acknowledged_by.clone().unwrap_or_default(),
            alarm: v1::Alarm::from(row.alarm_beside(|it| self.flags.is_up(it))).into(),
        })
        .collect()
    }
}

impl From<Activity> for v1::MissionPhase {
    fn from(activity: Activity) -> v1::MissionPhase {
        match activity {
            Activity::Respond(_) => v1::MissionPhase::Contingency,
            Activity::Begin => v1::MissionPhase::Starting,
            Activity::Fly => v1::MissionPhase::Nominal,
            Activity::Bridge => v1::MissionPhase::Replanning,
            Activity::End => v1::MissionPhase::Ending,
            Activity::Over => v1::MissionPhase::Over,
        }
    }
}

fn objective(status: &ObjectiveStatus) -> ObjectiveReport {
    ObjectiveReport {
        name: status.objective.name.clone(),
        progress: status.progress.clone(),
        plan_steps: status.plan_steps,
        replans: status.replans,
        permissions: status.permissions.clone(),
    }
}
