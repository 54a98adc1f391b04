//! The order of a mission whose order is free, chosen by straight ways: no way is known before the areas on it are asked for.

use domain::state::State;

use crate::objectives::{Objective, Objectives};
use crate::ordering::{EXACT_TO, Ordering, Problem, solve};
use crate::rules::Rules;

/// An order that was chosen.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Choice {
    /// By the indices of the objectives.
    pub ordering: Ordering,
    /// It keeps every deadline.
    is_in_time: bool,
}

impl Choice {
    /// How it was chosen, in words.
    pub(crate) fn in_words(&self) -> String {
        let Ordering { order, time_s, least_s } = &self.ordering;
        let count = order.len();
        let how = if count <= EXACT_TO {
            format!(
                "of all orders of {count} objectives that keep what is asked, flown straight, none takes less than {time_s:.0} s"
            )
        } else {
            format!(
                "the order of {count} objectives, flown straight, takes {time_s:.0} s; no order takes less than {least_s:.0} s"
            )
        };
        match self.is_in_time {
            true => how,
            false => format!("{how}; deadlines do not count in it, since no order was found that keeps all of them"),
        }
    }
}

/// The order of the objectives that wait, by their indices, for a vehicle in `state`. `time_left_s`: until when each must be arrived
/// at. If no order keeps the deadlines, they do not count: what comes too late fails in its turn. `None` if the precedences
/// lead in a circle.
pub(crate) fn choose(
    objectives: &Objectives,
    state: &State,
    rules: &Rules,
    time_left_s: impl Fn(&Objective) -> Option<f64>,
) -> Option<Choice> {
    let waiting = objectives.waiting();
    let all: Vec<&Objective> = waiting.iter().map(|it| &objectives.all()[*it]).collect();
    let time_s = |from: &State, to: &Objective| rules.visit(from, to).time_s;
    let problem = Problem {
        from_start_s: all.iter().map(|to| time_s(state, to)).collect(),
        between_s: all.iter().map(|from| all.iter().map(|to| time_s(&from.goal, to)).collect()).collect(),
        // A mission that ends in the air is followed by the way home.
        to_end_s: all.iter().map(|it| if it.goal.flying { rules.home(&it.goal).time_s } else { 0.0 }).collect(),
        stay_s: all.iter().map(|it| it.terms().dwell.as_secs_f64()).collect(),
        after: all.iter().map(|it| places(&it.terms().after, &all)).collect(),
        deadline_s: all.iter().map(|it| time_left_s(it)).collect(),
    };
    let without_deadlines = || Problem { deadline_s: vec![None; all.len()], ..problem.clone() };
    let (ordering, is_in_time) = match solve(&problem) {
        Some(ordering) => (ordering, true),
        None => (solve(&without_deadlines())?, false),
    };
    let order = ordering.order.iter().map(|it| waiting[*it]).collect();
    Some(Choice { ordering: Ordering { order, ..ordering }, is_in_time })
}

/// Where the objectives with these names are; those that are settled have no place.
fn places(names: &[String], all: &[&Objective]) -> Vec<usize> {
    names.iter().filter_map(|name| all.iter().position(|it| it.status.objective.name == *name)).collect()
}
