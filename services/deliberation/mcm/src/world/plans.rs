//! The plan that is asked for, approved, and adopted.

use domain::contingency::OPERATOR_PAUSE;
use domain::decision::DecisionKind;
use domain::geodesy::Origin;
use domain::mission::{MissionOutcome, ObjectiveStatus, Progress};
use domain::state::State;
use domain::time::Now;

use super::World;
use super::orders::SOURCE;
use crate::clients::planner::{ALL_SETTLED, Basis, Viewpoint};
use crate::config::Verdict;
use crate::decide::{Awaited, Wait};
use crate::journal::Said;

impl World {
    /// A plan is wanted from now on.
    pub(crate) fn begin_asking_for_plan(&mut self) {
        self.planner.begin_asking_for_plan();
    }

    /// Does what follows once a wait on the way to a plan is over.
    pub(crate) fn go_on_after(&mut self, wait: Wait) {
        let is_over = wait.is_over(self.now.time);
        match wait.what {
            Awaited::Approval if is_over => {
                self.decide_plan(self.setup.limits.config.plan_approval_default, "nobody has decided in time");
            }
            // The planner said to hold by what was known then.
            Awaited::Retry | Awaited::Stay if is_over || self.planner.request.holds_by_other(&self.basis()) => {
                self.ask_for_plan();
            }
            _ => {}
        }
    }

    fn ask_for_plan(&mut self) {
        let Some(viewpoint) = self.planning_state().map(|it| self.viewpoint_in(it)) else { return };
        let known = (self.basis(), self.permits().to_enter());
        let (moved_m, timeout) = (self.setup.limits.config.arrival_radius_m.get(), self.setup.limits.request_timeout);
        self.planner.ask_for_plan(viewpoint, known, moved_m, timeout, &mut self.out.outbox);
        self.mission.started_s.get_or_insert(self.mission.clock.seconds(self.now.time.as_secs_f64()));
    }

    /// What the planner is to know of permissions and areas now.
    pub(super) fn basis(&self) -> Basis {
        let areas_id = self.planner.mission.areas().id().to_owned();
        Basis { revision: self.permissions.revision(), held: self.enterable(), areas_id }
    }

    /// No plan is wanted any more.
    pub(crate) fn stop_asking_for_plan(&mut self) {
        self.planner.stop_asking_for_plan();
    }

    pub(super) fn decide_plan(&mut self, verdict: Verdict, why: &str) {
        let Some((plan, _)) = self.planner.request.proposal() else { return };
        let (plan, revision) = (plan.clone(), plan.revision);
        match verdict {
            Verdict::Approve => {
                let text = format!("plan {revision} approved: {why}");
                self.record(Said::new("plan", DecisionKind::PlanAdopted, text));
                self.planner.adopt(plan);
            }
            Verdict::Refuse => {
                let text = format!("plan {revision} refused: {why}");
                self.record(Said::new("plan", DecisionKind::PlanRejected, text.clone()));
                self.planner.discard_proposal();
                self.raise(OPERATOR_PAUSE, SOURCE, text);
            }
        }
    }

    /// Every objective is settled, and the vehicle stands on the ground: the mission is over, also while a response keeps a plan from
    /// being asked for. It could prevent nothing but a takeoff, and none follows.
    pub(super) fn end_where_nothing_is_left(&mut self) {
        let goes_on = self.mission.over.is_some() || self.awaits_start() || self.next_responder().is_none();
        if goes_on || !self.planner.mission.is_settled() {
            return;
        }
        let said = Said::new("plan", DecisionKind::PlanFinished, ALL_SETTLED);
        self.record(said.ending_mission(true));
        self.end_with_objectives();
    }

    /// The mission is over, since every objective is settled.
    pub(crate) fn end_with_objectives(&mut self) {
        let objectives = self.planner.mission.status.objectives.iter();
        let (required, optional): (Vec<_>, Vec<_>) = objectives.partition(|it| it.objective.terms.worth.is_none());
        match (failures(&required), failures(&optional)) {
            (None, None) => self.end_mission(MissionOutcome::Success, "every objective was achieved"),
            (None, Some(optional)) => {
                self.end_mission(MissionOutcome::Success, format!("every required objective was achieved; {optional}"));
            }
            (Some(required), optional) => {
                let reasons: Vec<String> = [Some(required), optional].into_iter().flatten().collect();
                self.end_mission(MissionOutcome::Failure, reasons.join("; "));
            }
        }
    }

    pub(super) fn planning_state(&self) -> Option<State> {
        let vehicle = self.plans_from()?;
        Some(State {
            position: vehicle.position,
            flying: vehicle.flying,
            mode: vehicle.mode,
            permissions: self.enterable().into_iter().collect(),
            charge: vehicle.charge,
            gripper: vehicle.gripper,
            // The planner knows them.
            done: Vec::new(),
        })
    }

    pub(super) fn viewpoint_in(&self, state: State) -> Viewpoint {
        let wind = self.seen.vehicle.and_then(|it| it.wind);
        Viewpoint { at: self.mission_now(), state, origin: self.origin(), wind }
    }

    pub(super) fn mission_now(&self) -> Now {
        Now { time: self.mission.clock.mission_time(self.now.time), utc_ms: self.now.utc_ms }
    }

    /// Where the vehicle's local frame has its origin. An estimator keeps it in flight, so a vehicle that is armed and says nothing has not
    /// lost it.
    pub(super) fn origin(&self) -> Option<Origin> {
        let vehicle = self.seen.vehicle?;
        vehicle.origin.or_else(|| self.planner.planned_from.filter(|_| vehicle.armed))
    }
}

/// The objectives that were not reached and why, if there are any.
fn failures(objectives: &[&ObjectiveStatus]) -> Option<String> {
    let failed = objectives.iter().filter_map(|it| match &it.progress {
        Progress::Success => None,
        Progress::Failure(reason) => Some(format!("objective `{}` failed: {reason}", it.objective.name)),
        Progress::Waiting => Some(format!("objective `{}` failed: ", it.objective.name)),
    });
    let failed: Vec<String> = failed.collect();
    (!failed.is_empty()).then(|| failed.join("; "))
}
