//! Answers the mission manager: what to fly next, until every objective is reached or given up.
//!
//! It is made for one question, from the mission as far as it has come, and what has become of that is a part of the answer. It knows
//! neither messages nor topics, and the same questions get the same answers.

mod course;
mod edits;
mod feasibility;
mod holding;
mod no_way_yet;
pub(crate) mod origin;
mod release;
mod state;

use std::time::Duration;

use domain::fmu::Gripper;
use domain::geodesy::Origin;
use domain::known_ground::KnownGround;
use domain::mission::{Mission, Progress};
use domain::plan::{Denial, DenialKind, Failure, MissionStatus, Plan, Step, StepId};
use domain::skill::Goal;
use domain::state::{State, Tolerance};
use domain::time::{Now, Pace, Time};

use domain::airspace::Grants;

use crate::airspace::{self, Airspace, Around, Closures};
use crate::along::Along;
use crate::asking_ahead;
use crate::coming_back;
use crate::drafting::draft;
use crate::free_order::Choice;
use crate::grant_lengths;
use crate::hold::{Hold, too_early, without_asking_at};
use crate::objectives::Objectives;
use crate::permissions::Permissions;
use crate::plan::{NEW, flight_time_s, in_words};
use crate::repair::repair;
use crate::routing::NoWay;
use crate::rules::Rules;
use crate::stuck::{Stuck, Verdict};
use crate::survey::Via;

pub(crate) use course::Brought;
use edits::Edited;
use holding::PlanNow;

/// An area counts as over this long after its end.
const OVER: Duration = Duration::from_secs(1);

/// A mission as far as it has come, and all that is needed to plan it.
#[derive(Debug)]
pub(crate) struct MissionPlanner {
    rules: Rules,
    pace: Pace,
    mission: Mission,
    /// With the mission's areas.
    around: Around,
    objectives: Objectives,
    permissions: Permissions,
    /// What is left of the present plan, first to fly first.
    rest: Vec<Step>,
    /// Plans and steps given out so far.
    revision: u64,
    last_step_id: u64,
    stuck: Stuck,
    hold: Option<Hold>,
    /// Where the vehicle's local frame has its origin; `None` as long as that is not known.
    vehicle_origin: Option<Origin>,
    /// When the mission's first plan was made.
    begun: Option<Time>,
    /// What an operator has changed.
    pub(crate) edited: Option<Edited>,
    /// It only tells what would be flown: what is left out for want of energy is decided from its whole forecast.
    forecast: Option<AsForecast>,
}

/// A forecast in the making.
#[derive(Debug, Default)]
struct AsForecast {
    /// The order that was chosen, where it is free.
    chosen_order: Option<Choice>,
}

/// What a plan is made for.
#[derive(Debug, Clone)]
pub(crate) struct Question {
    /// Where the vehicle is and what it may enter.
    pub(crate) state: State,
    /// For how long each permission holds from now on.
    pub(crate) grants: Grants,
    /// How the first step of the rest has failed, if it has.
    pub(crate) failed: Option<Failure>,
    /// Areas whose permission was denied during it.
    pub(crate) denials: Vec<Denial>,
}

/// What there is to fly.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Answer {
    /// These steps, first to fly first.
    Plan(Vec<Step>),
    /// Nothing now; ask again after the wait.
    Hold {
        /// Mission time.
        wait: Duration,
        /// For the operator.
        reason: String,
        /// The vehicle stays at the objective, as the mission has it.
        planned: bool,
    },
    /// Nothing any more: every objective is terminal.
    Finished,
}

/// A step that failed, and the steps that were to follow it.
struct Failed {
    step: Step,
    rest: Vec<Step>,
}

impl Failed {
    /// Whether the load was to be released by it, or after it.
    fn releases(&self) -> bool {
        std::iter::once(&self.step).chain(&self.rest).any(Step::releases)
    }
}

impl MissionPlanner {
    /// A planner of a mission of which nothing was attempted.
    pub(crate) fn new(rules: &Rules, mission: Mission, pace: Pace) -> MissionPlanner {
        MissionPlanner {
            rules: rules.clone(),
            pace,
            objectives: Objectives::new(&mission.objectives),
            mission,
            around: Around::default(),
            permissions: Permissions::default(),
            rest: Vec::new(),
            revision: 0,
            last_step_id: 0,
            stuck: Stuck::default(),
            hold: None,
            vehicle_origin: None,
            begun: None,
            edited: None,
            forecast: None,
        }
    }

    /// Replans: from the failed step's goal as long as what comes after it is still valid, else
    /// from the objective; objectives without a plan fail, and the next one is planned.
    pub(crate) fn replan(&mut self, question: Question, now: Now) -> Answer {
        let Question { state, grants: known, failed: failure, denials } = question;
        self.end_hold(now.time);
        self.note_granted(&state);
        if let Some(answer) = self.answer_to_misfit().or_else(|| self.answer_to_wind()) {
            return answer;
        }
        if let Some(refusal) = self.begin(&state, now) {
            self.objectives.give_up_rest(&refusal);
            return Answer::Finished;
        }
        self.permissions.held(&known);
        for denial in denials.iter().filter(|it| self.mission.areas.iter().any(|area| area.name == it.area)) {
            match (denial.kind, known.get(&denial.area)) {
                (DenialKind::TooShort, Some(granted)) => self.permissions.too_short(&denial.area, *granted, now.time),
                _ => self.permissions.denied(denial, now.time, &self.rules),
            }
        }
        let releases_next = self.rest.first().is_some_and(Step::releases);
        let mut failed = self.take_failed(failure.is_some());
        let release_was_due = releases_next || failed.as_ref().is_some_and(|it| it.step.releases());
        let is_released = state.gripper == Some(Gripper::Released) && failed.as_ref().is_some_and(Failed::releases);
        if self.judge_release(&state, release_was_due, now) || is_released {
            // What was planned for a load that is gone is not mended.
            failed = None;
        }
        if let Some((Failed { step, .. }, Failure { reason, .. })) =
            failed.as_ref().zip(failure.filter(|it| !it.interrupted))
            && denials.is_empty()
        {
            match self.stuck.failed(step, &state, &reason, self.tolerance(), &self.rules) {
                Verdict::TryAgain => {}
                Verdict::GiveUpObjective(reason) => {
                    self.conclude(Progress::Failure(reason));
                    failed = None;
                }
                Verdict::GiveUpMission(reason) => {
                    self.objectives.give_up_rest(&reason);
                    return Answer::Finished;
                }
            }
        }
        if denials.iter().any(|denial| denial.kind == DenialKind::TooShort) {
            // The step that asked would only ask for the same again.
            failed = None;
        }
        self.around.map.update(&self.mission.areas);
        self.around.ground = KnownGround::of(&self.mission.sites, self.objectives.on_ground());
        if !state.flying {
            self.around.ground.measure(state.position);
        }
        let grants = airspace::grants(&state, &known);
        let mut closures = Closures::new();
        loop {
            if self.judge_release(&state, false, now) {
                failed = None;
                closures.clear();
                continue;
            }
            let tolerance = self.tolerance();
            let Some(objective) = self.objectives.current() else { return Answer::Finished };
            let state = objective.as_begun(&state);
            objective.pass_turns_at(&state, tolerance);
            if objective.is_reached_in(&state, tolerance) {
                let wait = objective.stays_for(now.time);
                if wait.is_zero() {
                    self.arrived(now);
                    continue;
                }
                return Answer::Hold { wait, reason: feasibility::stays(objective, wait), planned: true };
            }
            objective.dwells_since = None;
            let ahead = if objective.is_line_left(&state, failed.as_ref().map(|it| it.step.way()), tolerance) {
                failed = None;
                objective.ahead_from_line_start()
            } else {
                objective.ahead()
            };
            let along = Along::of(objective, &self.rules);
            let ahead = along.ahead(&state, objective, ahead, &self.rules);
            let airspace = self.airspace(&grants, &closures, now);
            let mut steps = match steps_to(&state, &ahead, failed.take(), tolerance, &airspace, &self.rules) {
                Ok(steps) => steps,
                Err(unreachable) => {
                    let hold = self
                        .hold_until_over(&airspace, &state, &ahead, &grants, now)
                        .or_else(|| self.hold_until_new_grant(&state, &ahead, &grants, &closures, now));
                    if let Some(hold) = hold {
                        return self.holds(hold);
                    }
                    self.conclude(Progress::Failure(unreachable.to_string()));
                    closures.clear();
                    continue;
                }
            };
            along.set(&mut steps);
            let plan_now = PlanNow {
                steps: &steps,
                ahead: &ahead,
                state: &state,
                airspace: &airspace,
                grants: &grants,
                closures: &closures,
                now,
            };
            if let Some(hold) = self.worth_waiting(plan_now) {
                return self.holds(hold);
            }
            if let Some((index, reason)) = self.infeasible(&steps, &state, now) {
                if index == self.objectives.current_index() {
                    self.conclude(Progress::Failure(reason));
                    closures.clear();
                } else {
                    self.objectives.give_up(index, reason);
                }
                continue;
            }
            grant_lengths::set(&mut steps, &airspace, &self.rules);
            if let Some((area, reason)) = grant_lengths::too_short(&steps, &airspace) {
                closures.insert(area, reason);
                continue;
            }
            if let Err(reason) = coming_back::ask_for(
                &mut steps,
                &state,
                (&self.objectives, &self.mission.sites),
                &airspace,
                &self.rules,
            ) {
                self.objectives.give_up_rest(&reason);
                return Answer::Finished;
            }
            asking_ahead::set(&mut steps, &airspace, &self.rules);
            let early = too_early(&steps, &self.permissions, now.time, &self.rules);
            let Some((position, hold)) = early else { return self.adopt(steps) };
            let is_trespassing = state.flying && airspace.is_trespassed(state.position);
            if is_trespassing && steps.first().is_some_and(|it| flight_time_s(it, &self.rules) > 0.0) {
                // Not to be waited for in here: out first, and the rest once there.
                return self.adopt(without_asking_at(steps, position));
            }
            if self.permissions.may_hold(&hold.area, hold.wait, &self.rules) {
                return self.holds(hold);
            }
        }
    }

    /// The vehicle waits.
    fn holds(&mut self, hold: Hold) -> Answer {
        let Hold { wait, reason, .. } = self.hold.insert(hold).clone();
        Answer::Hold { wait, reason, planned: false }
    }

    /// A task along the leg that is flown has failed, for this reason. The flight goes on; at its end the objective has failed.
    pub(crate) fn along_failed(&mut self, reason: String) {
        if let Some(objective) = self.objectives.current() {
            objective.status.along_failure.get_or_insert(reason);
        }
    }

    /// `step` was flown and left the vehicle in `state`; `is_end`: nothing is left of its plan.
    pub(crate) fn flown(&mut self, step: &Step, is_end: bool, state: &State, now: Now) {
        self.note_granted(state);
        self.pass_turns_of([step]);
        self.stuck.flown(step);
        match (&step.nominal.goal, self.objectives.current()) {
            (Goal::Task(_), Some(objective)) => objective.status.tasks_done = step.reaches.done.len(),
            (Goal::Release { .. }, Some(objective)) if state.gripper == Some(Gripper::Released) => {
                objective.release_seen()
            }
            (Goal::LandOnTarget, Some(objective)) if !state.flying => objective.landed_on_target(state.position),
            _ => {}
        }
        if self.has_lost_load(step, state) || !is_end {
            return;
        }
        let tolerance = self.tolerance();
        let Some(objective) = self.objectives.current() else { return };
        let state = &objective.as_begun(state);
        let goal = objective.goal.clone();
        if objective.is_reached_in(state, tolerance) {
            if self.objectives.current().is_some_and(|it| it.stays_for(now.time).is_zero()) {
                self.arrived(now);
            }
        } else if step.reaches.matches(&goal, tolerance)
            && let Some(reason) = self.stuck.missed(state, &goal, tolerance, &self.rules)
        {
            self.conclude(Progress::Failure(reason));
        }
    }

    pub(crate) fn pace(&self) -> Pace {
        self.pace
    }

    pub(crate) fn objectives(&self) -> &Objectives {
        &self.objectives
    }

    /// The mission's name, areas and sites.
    pub(crate) fn mission(&self) -> &Mission {
        &self.mission
    }

    /// What is left of the present plan.
    pub(crate) fn plan(&self) -> Plan {
        let objective = self.objectives.current_index() as u32;
        let flyable = |step: &Step| Step { objective, text: in_words(step), ..step.clone() };
        Plan { objective, steps: self.rest.iter().map(flyable).collect(), revision: self.revision }
    }

    /// The mission as far as it has come, without its areas, feeds and steps.
    pub(crate) fn status(&self) -> MissionStatus {
        let hold = self.hold.as_ref().map(|hold| hold.reason.clone());
        MissionStatus {
            mission: self.mission.name.clone(),
            objectives: self.objectives.all().iter().map(|it| it.status.clone()).collect(),
            revision: self.revision,
            current_objective: self.objectives.current_index() as u32,
            hold: hold.or_else(|| self.waits_for_origin()).unwrap_or_default(),
            order: self.mission.order,
            sites: self.mission.sites.clone(),
            origin: self.mission.origin,
            ..MissionStatus::default()
        }
    }

    pub(crate) fn chosen_order(&self) -> Option<&Choice> {
        self.forecast.as_ref()?.chosen_order.as_ref()
    }

    /// `text`, and the places of `mission` that wind brings too near to a border.
    pub(crate) fn with_wind(&self, text: String, mission: &Mission) -> String {
        let near = mission.too_near_in_wind(self.rules.config.wind_m_s.get());
        std::iter::once(text).chain(near).collect::<Vec<_>>().join("; ")
    }

    fn note_granted(&mut self, state: &State) {
        for area in &state.permissions {
            self.permissions.granted(area);
        }
    }

    /// The old plan ends here; `has_failed`: by its first step.
    fn take_failed(&mut self, has_failed: bool) -> Option<Failed> {
        let mut steps = std::mem::take(&mut self.rest).into_iter();
        let step = steps.next().filter(|_| has_failed)?;
        Some(Failed { step, rest: steps.collect() })
    }

    /// These steps of the current objective were flown.
    pub(crate) fn pass_turns_of<'a>(&mut self, steps: impl IntoIterator<Item = &'a Step>) {
        let passed = steps.into_iter().map(|it| it.passed).max();
        if let (Some(objective), Some(passed)) = (self.objectives.current(), passed) {
            objective.pass(passed as usize);
        }
    }

    /// Makes `steps` the plan. Those without an id are new.
    fn adopt(&mut self, mut steps: Vec<Step>) -> Answer {
        let new = steps.iter().take_while(|step| step.id == NEW).count();
        for step in &mut steps[..new] {
            self.last_step_id += 1;
            step.id = StepId(self.last_step_id);
        }
        if let Some(objective) = self.objectives.current() {
            objective.planned(&steps[..new]);
        }
        self.revision += 1;
        self.rest.clone_from(&steps);
        Answer::Plan(steps)
    }
}

/// From `state` to the failed step's goal and on with what was to follow it, if that is still valid;
/// else, or if none failed, through all that is `ahead`.
fn steps_to(
    state: &State,
    ahead: &[Via],
    failed: Option<Failed>,
    tolerance: Tolerance,
    airspace: &Airspace,
    rules: &Rules,
) -> Result<Vec<Step>, NoWay> {
    match failed.and_then(|it| repair(state, it.step, it.rest, tolerance, airspace, rules)) {
        Some(steps) if !steps.is_empty() => Ok(steps),
        _ => draft(state, ahead, tolerance, airspace, rules),
    }
}
