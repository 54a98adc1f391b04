//! The plan that is asked for, approved, and adopted.

use domain::mission::{MissionOutcome, Progress};
use domain::time::Time;

use super::World;
use crate::clients::planner::PlanRequest;
use crate::config::Verdict;

/// The progress of the request for a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PlanProgress {
    /// Nothing changes before this time, unless something arrives.
    Awaited(Option<Time>),
    /// Something was decided at this moment: ask again.
    Changed,
    /// A plan was adopted.
    Adopted,
    /// Every objective has reached its final state.
    Finished,
}

impl World {
    /// A plan is wanted from now on.
    pub(crate) fn begin_asking_for_plan(&mut self) {
        self.planner.begin_asking_for_plan();
    }

    /// Asks for a plan when that is due.
    pub(crate) fn pursue_plan(&mut self) -> PlanProgress {
        if self.awaits_start() {
            return PlanProgress::Awaited(self.await_go_ahead());
        }
        let now = self.now.time;
        let due = match self.planner.request() {
            PlanRequest::Proposed(_, until) if *until <= now => {
                self.decide_plan(self.limits.plan_approval_default, "nobody has decided in time");
                return PlanProgress::Changed;
            }
            PlanRequest::Proposed(_, until) => return PlanProgress::Awaited(Some(*until)),
            PlanRequest::Asked(_) => return PlanProgress::Awaited(None),
            PlanRequest::Planned => return PlanProgress::Adopted,
            // The planner's status may arrive a little after its answer.
            PlanRequest::Finished if !self.planner.all_settled() => return PlanProgress::Awaited(None),
            PlanRequest::Finished => {
                self.end_with_objectives();
                return PlanProgress::Finished;
            }
            PlanRequest::Idle => self.planner.ask_from(),
            PlanRequest::Retry(at) => *at,
            PlanRequest::Hold(_, basis)
                if basis.revision != self.permissions.revision() || basis.held != self.held() =>
            {
                now
            }
            PlanRequest::Hold(until, _) => *until,
        };
        if now < due {
            return PlanProgress::Awaited(Some(due));
        }
        let grants = self.permissions.grants(now);
        if let Some(state) = self.planning_state()
            && self.planner.ask_for_plan(
                state,
                grants,
                self.memory.accepted_loss(),
                self.limits.request_timeout,
                &mut self.outbox,
            )
        {
            self.mission.started.get_or_insert(now);
        }
        PlanProgress::Awaited(None)
    }

    /// No plan is wanted any more.
    pub(crate) fn stop_asking_for_plan(&mut self) {
        self.planner.stop_asking_for_plan();
    }

    /// Flies the plan that waits for approval, or holds.
    pub(super) fn decide_plan(&mut self, verdict: Verdict, why: &str) {
        let Some((plan, _)) = self.planner.request().proposal() else { return };
        let (plan, revision) = (plan.clone(), plan.revision);
        match verdict {
            Verdict::Approve => {
                self.say("plan", format!("plan {revision} approved: {why}"));
                self.planner.adopt(plan);
            }
            Verdict::Refuse => {
                self.say("plan", format!("plan {revision} refused: {why}"));
                self.planner.discard_proposal();
                self.pause_for(format!("plan {revision} refused: {why}"));
            }
        }
    }

    fn end_with_objectives(&mut self) {
        let objectives = self.planner.status().into_iter().flat_map(|it| &it.objectives);
        let failed: Vec<String> = objectives
            .filter_map(|it| match &it.progress {
                Progress::Success => None,
                Progress::Failure(reason) => Some(format!("objective `{}` failed: {reason}", it.objective.name)),
                Progress::Waiting => Some(format!("objective `{}` failed: ", it.objective.name)),
            })
            .collect();
        if failed.is_empty() {
            self.end_mission(MissionOutcome::Success, "every objective was achieved");
        } else {
            self.end_mission(MissionOutcome::Failure, failed.join("; "));
        }
    }
}
