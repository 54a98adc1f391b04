//! Notices that nothing comes of what is tried: a step that fails again and again while the vehicle gets nowhere, takeoffs
//! that fail, landings that fail, and plans that end beside their objective.
//!
//! A failure that a permission explains does not count: the record of permissions ends those.

use domain::plan::Step;
use domain::skill::Goal;
use domain::state::{State, Tolerance};

use crate::actions::Action;
use crate::permissions::colon;
use crate::plan::action;
use crate::rules::Rules;

/// What was tried in vain.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Stuck {
    pub(crate) last: Option<Failure>,
    /// Takeoffs that failed since a step was flown in the air.
    pub(crate) takeoffs: u32,
    /// Landings that failed for the present objective.
    pub(crate) landings: u32,
    /// Plans that were flown to their end for the present objective, and did not reach it.
    pub(crate) misses: u32,
}

/// The failure of a step, and how often it has failed like that in a row.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Failure {
    pub(crate) action: String,
    pub(crate) goal: State,
    pub(crate) vehicle: State,
    pub(crate) count: u32,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// It may be tried again.
    TryAgain,
    /// The objective is given up, for this reason.
    GiveUpObjective(String),
    /// Nothing more is flown, for this reason.
    GiveUpMission(String),
}

impl Stuck {
    /// `step` failed with the vehicle in state `vehicle`, for the reason `failure`.
    pub(crate) fn failed(
        &mut self,
        step: &Step,
        vehicle: &State,
        failure: &str,
        tolerance: Tolerance,
        rules: &Rules,
    ) -> Verdict {
        let name = match &step.nominal.goal {
            Goal::Task(it) => it.task.skill.as_str(),
            _ => action(step).name(),
        };
        let give_up = |times: u32| format!("{name} failed {times} times in a row{}", colon(failure));
        match action(step) {
            Action::Takeoff => {
                self.takeoffs += 1;
                let is_enough = rules.config.takeoffs_at_most.get() <= self.takeoffs;
                if is_enough { Verdict::GiveUpMission(give_up(self.takeoffs)) } else { Verdict::TryAgain }
            }
            Action::Land => {
                self.landings += 1;
                let is_enough = rules.config.landings_at_most.get() <= self.landings;
                if is_enough { Verdict::GiveUpObjective(give_up(self.landings)) } else { Verdict::TryAgain }
            }
            Action::Stop | Action::Position | Action::Release | Action::Task => {
                let before = self.last.take().filter(|last| {
                    last.action == name
                        && last.goal.matches(&step.reaches, tolerance)
                        && vehicle.matches(&State { mode: None, ..last.vehicle.clone() }, tolerance)
                });
                let count = before.map_or(0, |last| last.count) + 1;
                let (goal, vehicle) = (step.reaches.clone(), vehicle.clone());
                self.last = Some(Failure { action: name.to_owned(), goal, vehicle, count });
                let most = match &step.nominal.goal {
                    Goal::Task(it) => rules.skills.get(&it.task.skill).map_or(1, |it| it.tries),
                    _ => rules.config.failures_at_most.get(),
                };
                let is_enough = most <= count;
                if is_enough { Verdict::GiveUpObjective(give_up(count)) } else { Verdict::TryAgain }
            }
        }
    }

    pub(crate) fn flown(&mut self, step: &Step) {
        // To come to rest is not progress: a release that fails is tried after a stop each time.
        if action(step) != Action::Stop {
            self.last = None;
        }
        if step.reaches.flying {
            self.takeoffs = 0;
        }
    }

    /// A plan was flown to its end and `vehicle` is not at `goal`; why the objective is given up, if it is.
    pub(crate) fn missed(
        &mut self,
        vehicle: &State,
        goal: &State,
        tolerance: Tolerance,
        rules: &Rules,
    ) -> Option<String> {
        self.misses += 1;
        let higher_m = vehicle.position.height_m() - goal.position.height_m();
        let has_landed_over_it = !vehicle.flying && !goal.flying && vehicle.is_over(goal, tolerance);
        if has_landed_over_it {
            // Another landing would find the same ground.
            let word = if higher_m < 0.0 { "below" } else { "above" };
            return Some(format!("the vehicle has landed {:.0} m {word} it", higher_m.abs()));
        }
        let apart_m = vehicle.position.horizontal_distance_m(goal.position);
        let times = self.misses;
        (rules.config.failures_at_most.get() <= times)
            .then(|| format!("{times} plans in a row have not reached it; the last one ended {apart_m:.1} m from it"))
    }

    /// Another objective is attempted.
    pub(crate) fn next_objective(&mut self) {
        *self = Stuck { takeoffs: self.takeoffs, ..Stuck::default() };
    }
}
