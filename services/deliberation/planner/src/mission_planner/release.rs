//! What an open gripper says about an objective that asks for a release: reached, failed, or nothing yet.
//!
//! The load is released once. So what the vehicle reports counts for more than which steps were reported as flown, and
//! that a release was planned is kept with the mission: a manager or a planner that is started again neither drops a second time nor calls a
//! drop by nobody a success.

use domain::fmu::Gripper;
use domain::mission::{Progress, ReleaseProgress};
use domain::plan::Step;
use domain::state::State;
use domain::time::Now;

use super::MissionPlanner;

const NO_LOAD: &str = "there is no load to release: the gripper is open already";
const LOST: &str = "the load was lost before the place was reached";

impl MissionPlanner {
    /// Takes in the gripper of `state`; returns whether the current objective is settled by it. `was_due`: its release was the step
    /// to be flown.
    pub(super) fn judge_release(&mut self, state: &State, was_due: bool, now: Now) -> bool {
        let tolerance = self.tolerance();
        let Some(objective) = self.objectives.current() else { return false };
        if !objective.terms().drop || state.gripper != Some(Gripper::Released) {
            return false;
        }
        let is_there = was_due || state.is_over(&objective.goal, tolerance);
        let failure = match objective.status.release {
            ReleaseProgress::NotPlanned => NO_LOAD,
            ReleaseProgress::Planned if !is_there => LOST,
            ReleaseProgress::Planned | ReleaseProgress::Seen => {
                objective.release_seen();
                // Only a stay or a task leads back there.
                let is_settled = objective.terms().dwell.is_zero() && objective.has_done_its_tasks();
                if is_settled {
                    self.arrived(now);
                }
                return is_settled;
            }
        };
        self.conclude(Progress::Failure(failure.into()));
        true
    }

    /// `step` was flown and left the vehicle in `state`; returns whether the load is gone that was to be released later.
    pub(super) fn has_lost_load(&mut self, step: &Step, state: &State) -> bool {
        let Some(objective) = self.objectives.current() else { return false };
        let is_lost = objective.terms().drop
            && objective.status.release != ReleaseProgress::Seen
            && !step.releases()
            && state.gripper == Some(Gripper::Released);
        if is_lost {
            self.conclude(Progress::Failure(LOST.into()));
            self.rest.clear();
        }
        is_lost
    }
}
