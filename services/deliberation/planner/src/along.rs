//! What an objective asks of the steps to it. Tasks along the leg, the third track beside action and communication: they accompany each flight
//! over ground to the objective; of a survey those from its first line on. And a landing on a target.

use std::sync::Arc;

use domain::plan::Step;
use domain::skill::Goal;
use domain::task::TaskGoal;

use crate::actions::Action;
use crate::communication::SAME_PLACE_M;
use crate::objectives::Objective;
use crate::plan::action;
use crate::rules::Rules;

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
