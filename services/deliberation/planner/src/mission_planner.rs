//! Answers the mission manager: what to fly next, until every objective is reached or given up.
//!
//! It knows neither messages nor topics, and the same requests at the same times get the same answers.

use std::time::Duration;

use domain::area::Area;
use domain::mission::{Mission, Progress};
use domain::plan::{self, FailedStep, PlanRequest, PlannerStatus, StepId};
use domain::state::State;
use domain::time::{Now, Pace, Time};

use crate::airspace::{Airspace, Asked};
use crate::config::Config;
use crate::drafting::{Unreachable, draft};
use crate::forecast::{self, Forecast};
use crate::hold::{Hold, TooEarly, too_early, without_asking_at};
use crate::objectives::Objectives;
use crate::permissions::{Permissions, colon};
use crate::plan::{Plan, Step};
use crate::repair::repair;
use crate::stuck::Stuck;

/// The planner's state.
#[derive(Debug)]
pub struct MissionPlanner {
    config: Config,
    pace: Pace,
    mission: Mission,
    objectives: Objectives,
    permissions: Permissions,
    plan: Plan,
    revision: u64,
    epoch: u64,
    last_step_id: u64,
    /// The step flown last of the present plan.
    last_done: Option<StepId>,
    stuck: Stuck,
    hold: Option<Hold>,
}

/// What there is to fly.
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    /// These steps, first to fly first.
    Plan(Vec<Step>),
    /// Nothing now; ask again after the wait.
    Hold {
        /// Mission time.
        wait: Duration,
        /// For the operator.
        reason: String,
    },
    /// Nothing any more: every objective is terminal.
    Finished,
}

/// A step id that was never given out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("step {0} is not of any plan made here")]
pub struct UnknownStep(pub StepId);

/// A step that failed, and the steps that were to follow it.
struct Failed {
    step: Step,
    rest: Vec<Step>,
}

impl MissionPlanner {
    /// A planner that has not planned anything yet.
    pub fn new(config: &Config, mission: Mission, pace: Pace) -> MissionPlanner {
        MissionPlanner {
            config: config.clone(),
            pace,
            objectives: Objectives::new(&mission.objectives),
            mission,
            permissions: Permissions::default(),
            plan: Plan::default(),
            revision: 0,
            epoch: 0,
            last_step_id: 0,
            last_done: None,
            stuck: Stuck::default(),
            hold: None,
        }
    }

    /// Replans: from the failed step's goal as long as what comes after it is still valid, else
    /// from the objective; objectives without a plan fail, and the next one is planned.
    pub fn replan(&mut self, request: PlanRequest, now: Now) -> Answer {
        let PlanRequest { state, failed: failed_step, denials, .. } = request;
        self.end_hold(now.time);
        self.note_granted(&state);
        for denial in denials.iter().filter(|it| self.mission.areas.iter().any(|area| area.name == it.area)) {
            self.permissions.denied(denial, now.time, &self.config);
        }
        let mut failed = self.take_failed(failed_step.as_ref().map(|step| step.id));
        if let Some((Failed { step, .. }, FailedStep { reason: failure, .. })) = failed.as_ref().zip(failed_step)
            && denials.is_empty()
            && !self.stuck.failed(step, &state, &self.config)
        {
            let times = self.config.failures_at_most;
            let reason = format!("{} failed {times} times in a row{}", step.action.name, colon(&failure));
            self.conclude(Progress::Failure(reason));
            failed = None;
        }
        loop {
            let Some(objective) = self.objectives.current() else { return Answer::Finished };
            let goal = objective.goal.clone();
            if state.matches(&goal, self.config.tolerance()) {
                self.conclude(Progress::Success);
                continue;
            }
            let airspace = self.airspace(&state, now);
            let steps = match steps_to(&state, &goal, failed.take(), &airspace, &self.config) {
                Ok(steps) => steps,
                Err(unreachable) => {
                    self.conclude(Progress::Failure(unreachable.to_string()));
                    continue;
                }
            };
            let early = too_early(&steps, &self.permissions, now.time, &self.config);
            let Some(TooEarly { position, hold }) = early else { return self.adopt(steps) };
            let is_trespassing = state.flying && !airspace.trespassed(state.position, &Asked::new()).is_empty();
            if is_trespassing && steps.first().is_some_and(|it| it.flight_time_s(&self.config) > 0.0) {
                // Not to be waited for in here: out first, and the rest once there.
                return self.adopt(without_asking_at(steps, position));
            }
            if self.permissions.may_hold(&hold.area, hold.wait, &self.config) {
                let Hold { wait, reason, .. } = hold.clone();
                self.hold = Some(hold);
                return Answer::Hold { wait, reason };
            }
        }
    }

    /// The step to fly after step `id`, whether that one was flown already or not; the first one for `None`.
    pub fn next_after(&self, id: Option<StepId>) -> Option<Step> {
        match id {
            Some(id) if self.last_done != Some(id) => self.plan.after(id),
            _ => self.plan.steps().into_iter().next(),
        }
    }

    /// Step `id` was flown and left the vehicle in `state`. Said again, it changes nothing.
    pub fn step_done(&mut self, id: StepId, state: &State) -> Result<(), UnknownStep> {
        if self.last_step_id < id.0 {
            return Err(UnknownStep(id));
        }
        self.note_granted(state);
        if self.plan.drop_through(id).is_none() {
            return Ok(());
        }
        self.last_done = Some(id);
        self.stuck.got_on();
        let is_there = self.objectives.current().is_some_and(|it| state.matches(&it.goal, self.config.tolerance()));
        if self.plan.is_empty() && is_there {
            self.conclude(Progress::Success);
        }
        Ok(())
    }

    /// The objectives and what became of them.
    pub fn objectives(&self) -> &Objectives {
        &self.objectives
    }

    /// The mission's name and areas.
    pub fn mission(&self) -> &Mission {
        &self.mission
    }

    /// Of the steps given out so far.
    pub fn last_step_id(&self) -> u64 {
        self.last_step_id
    }

    /// What is left of the present plan.
    pub fn plan(&self) -> plan::Plan {
        plan::Plan {
            objective: self.objectives.current_index() as u32,
            steps: self.flyable_steps(),
            revision: self.revision,
            epoch: self.epoch,
        }
    }

    /// The planner's status.
    pub fn status(&self) -> PlannerStatus {
        PlannerStatus {
            mission: self.mission.name.clone(),
            objectives: self.objectives.all().iter().map(|objective| objective.status()).collect(),
            areas: self.mission.areas.clone(),
            steps: self.flyable_steps(),
            revision: self.revision,
            current_objective: self.objectives.current_index() as u32,
            hold: self.hold.as_ref().map(|hold| hold.reason.clone()).unwrap_or_default(),
            epoch: self.epoch,
        }
    }

    /// `step` of the current objective's plan, as it is flown; `None` if it has no id yet.
    pub fn flyable(&self, step: &Step) -> Option<plan::Step> {
        Some(plan::Step {
            id: step.id?,
            objective: self.objectives.current_index() as u32,
            reaches: step.action.to.clone(),
            nominal: step.action.nominal.clone(),
            ask: step.communication.ask.iter().map(|area| need(area)).collect(),
            auxiliary: step.communication.auxiliary,
            text: step.to_string(),
        })
    }

    fn flyable_steps(&self) -> Vec<plan::Step> {
        self.plan.steps().iter().filter_map(|step| self.flyable(step)).collect()
    }

    /// Another planner has flown `mission` so far; no plan of its own is left.
    pub fn go_on(&mut self, mission: Mission, objectives: Objectives, epoch: u64, revision: u64, last_step_id: u64) {
        (self.mission, self.objectives) = (mission, objectives);
        (self.epoch, self.revision, self.last_step_id) = (epoch, revision, last_step_id);
    }

    /// What `mission` would need from `state` on, if it were the mission now; nothing changes.
    pub fn forecast(&self, mission: Mission, state: &State, now: Now) -> Vec<Forecast> {
        let mut scratch = MissionPlanner::new(&self.config, mission, self.pace);
        scratch.permissions = self.permissions.clone();
        forecast::fly_through(scratch, state.clone(), now, &self.config)
    }

    /// Replaces the present mission by another one, of which nothing was attempted. Denials by the
    /// tower are remembered.
    pub fn take_over(&mut self, mission: Mission) {
        self.objectives = Objectives::new(&mission.objectives);
        self.mission = mission;
        self.withdraw_plan();
    }

    /// Puts an objective in at `index`; see [`Objectives::insert`].
    pub fn insert(&mut self, index: usize, objective: domain::mission::Objective) {
        let is_next = index == self.objectives.current_index();
        self.objectives.insert(index, &objective);
        if is_next {
            self.withdraw_plan();
        }
    }

    /// Takes out the objective at `index`, which is not settled.
    pub fn remove(&mut self, index: usize) {
        let was_current = index == self.objectives.current_index();
        self.objectives.remove(index);
        if was_current {
            self.withdraw_plan();
        }
    }

    /// Gives up the objective at `index`, which is not settled.
    pub fn skip(&mut self, index: usize, reason: String) {
        let was_current = index == self.objectives.current_index();
        self.objectives.give_up(index, reason);
        if was_current {
            self.withdraw_plan();
        }
    }

    /// The mission as it would be put into a file now, with only what is still to be attempted.
    pub fn rest_of_mission(&self) -> Mission {
        let waiting = self.objectives.all().iter().filter(|it| it.progress == Progress::Waiting);
        Mission { objectives: waiting.map(|it| it.objective()).collect(), ..self.mission.clone() }
    }

    /// The plan becomes void; the mission manager learns it by the epoch.
    fn withdraw_plan(&mut self) {
        self.plan = Plan::default();
        self.last_done = None;
        self.stuck = Stuck::default();
        self.hold = None;
        self.epoch += 1;
    }

    fn airspace(&self, state: &State, now: Now) -> Airspace<'_> {
        let areas: &[Area] = &self.mission.areas;
        Airspace::new(areas, &state.permissions, &self.permissions, now, self.pace, &self.config)
    }

    fn note_granted(&mut self, state: &State) {
        for area in &state.permissions {
            self.permissions.granted(area);
        }
    }

    fn end_hold(&mut self, now: Time) {
        if let Some(hold) = self.hold.take() {
            self.permissions.has_held(&hold.area, now - hold.since);
        }
    }

    /// The old plan ends here.
    fn take_failed(&mut self, id: Option<StepId>) -> Option<Failed> {
        let mut plan = std::mem::take(&mut self.plan);
        self.last_done = None;
        let step = plan.drop_through(id?)?;
        Some(Failed { step, rest: plan.steps() })
    }

    fn conclude(&mut self, progress: Progress) {
        if let Some(objective) = self.objectives.current() {
            objective.progress = progress;
        }
        self.stuck.got_on();
    }

    /// Makes `steps` the plan. Those without an id are new.
    fn adopt(&mut self, mut steps: Vec<Step>) -> Answer {
        let new = steps.iter().take_while(|step| step.id.is_none()).count();
        for step in &mut steps[..new] {
            self.last_step_id += 1;
            step.id = Some(StepId(self.last_step_id));
        }
        if let Some(objective) = self.objectives.current() {
            objective.planned(&steps[..new]);
        }
        self.revision += 1;
        self.plan = Plan::new(steps.clone());
        Answer::Plan(steps)
    }
}

/// From `state` to the failed step's goal and on with what was to follow it, if that is still valid;
/// else, or if none failed, to `goal` itself.
fn steps_to(
    state: &State,
    goal: &State,
    failed: Option<Failed>,
    airspace: &Airspace,
    config: &Config,
) -> Result<Vec<Step>, Unreachable> {
    match failed.and_then(|it| repair(state, it.step, it.rest, airspace, config)) {
        Some(steps) if !steps.is_empty() => Ok(steps),
        _ => draft(state, goal, airspace, config),
    }
}

fn need(area: &str) -> plan::PermissionNeed {
    plan::PermissionNeed { area: area.to_owned(), lasts: Duration::ZERO }
}
