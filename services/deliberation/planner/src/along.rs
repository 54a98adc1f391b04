//! What an objective asks of the steps to it. Tasks along the leg, the third track beside action and communication: they accompany each flight
//! over ground to the objective; of a survey those from its first line on. And a landing on a target.

use std::sync::Arc;

use domain::geometry::Ned;
use domain::plan::Step;
use domain::skill::Goal;
use domain::state::State;
use domain::task::{Stance, Task, TaskGoal};

use crate::actions::Action;
use crate::communication::SAME_PLACE_M;
use crate::objectives::Objective;
use crate::plan::action;
use crate::rules::Rules;
use crate::survey::Via;

/// The tasks of an objective, and from where on they go on.
#[derive(Debug)]
pub(crate) struct Along {
    tasks: Vec<Arc<TaskGoal>>,
    /// The way to the first line of a survey is ahead.
    is_approach: bool,
    lands_on_target: bool,
}

impl Along {
    /// For steps that are planned for `objective` as far as it has come.
    pub(crate) fn of(objective: &Objective, rules: &Rules) -> Along {
        let goal = |it| Arc::new(rules.skills.goal(it, objective.goal.position));
        let is_approach = objective.status.objective.survey.as_ref().is_some_and(|it| it.passed() == 0);
        let terms = objective.terms();
        Along { tasks: terms.along.iter().map(goal).collect(), is_approach, lands_on_target: terms.land_on_target }
    }

    /// What is flown to from `state`: straight up or down to the height of the objective first, if a task cannot be done at this one.
    pub(crate) fn ahead(&self, state: &State, objective: &Objective, mut ahead: Vec<Via>, rules: &Rules) -> Vec<Via> {
        let height_m = objective.goal.position.height_m();
        let unfit = |task: &Task, height_m| rules.skills.misfit(task, Stance::Flies, height_m).is_some();
        let needs_height =
            |it: &Arc<TaskGoal>| unfit(&it.task, state.position.height_m()) && !unfit(&it.task, height_m);
        if state.flying && objective.goal.flying && !self.is_approach && self.tasks.iter().any(needs_height) {
            let done = state.done.clone();
            let state = State { done, ..State::new(state.position.at_height(height_m), true) };
            ahead.insert(0, Via { state, passed: objective.passed() });
        }
        ahead
    }

    /// Says so in those steps.
    pub(crate) fn set(mut self, steps: &mut [Step]) {
        for step in steps {
            let (from, to) = step.way();
            let goes_over_ground = action(step) == Action::Position && SAME_PLACE_M < from.horizontal_distance_m(to);
            let accompanies = goes_over_ground && !self.is_approach;
            step.along = if accompanies { self.tasks.clone() } else { Vec::new() };
            self.is_approach &= step.passed == 0;
            if self.lands_on_target && step.nominal.goal == Goal::Land {
                step.nominal.goal = Goal::LandOnTarget;
            }
        }
    }
}

/// Why a task along one of these steps cannot be done at the height at which they are flown.
pub(crate) fn unfit(steps: &[Step], rules: &Rules) -> Option<String> {
    let unfit = |step: &Step, it: &TaskGoal| {
        let (from, to) = step.way();
        let heights_m = [from, to].map(Ned::height_m).into_iter();
        heights_m.map(|height_m| rules.skills.misfit(&it.task, Stance::Flies, height_m)).find_map(|it| it)
    };
    let (message, _) = steps.iter().find_map(|step| step.along.iter().find_map(|it| unfit(step, it)))?;
    Some(message)
}
