//! What an objective leads through: the turns of its survey, or its goal alone. Each is flown to by the same functions as any
//! goal; what is here is only which of them come next.

use domain::geometry::Ned;
use domain::state::{State, Tolerance};

use crate::objectives::Objective;

/// A state on the way to an objective's goal, which is the last one of them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Via {
    pub state: State,
    /// How many turns have been passed once it is reached; 0 if it is not a turn.
    pub passed: usize,
}

impl Objective {
    /// All that it leads through, from the beginning or from what was passed on.
    pub(crate) fn ahead(&self) -> Vec<Via> {
        let Some(survey) = &self.status.objective.survey else {
            return vec![Via { state: self.goal.clone(), passed: 0 }];
        };
        (survey.passed()..survey.turns().len())
            .map(|index| Via { state: self.turn(index), passed: index + 1 })
            .map(|it| if it.passed == survey.turns().len() { Via { state: self.goal.clone(), ..it } } else { it })
            .collect()
    }

    /// The same for a vehicle that has left the line it was to fly: that one is flown from its beginning.
    pub(crate) fn ahead_from_line_start(&self) -> Vec<Via> {
        let passed = self.passed();
        let begin = passed.checked_sub(1).map(|index| Via { state: self.turn(index), passed });
        begin.into_iter().chain(self.ahead()).collect()
    }

    pub(crate) fn pass(&mut self, passed: usize) {
        let survey = &mut self.status.objective.survey;
        *survey = survey.take().map(|it| it.with_passed(passed));
    }

    /// The vehicle is in `state`: where that is the next turn, it has been passed. The last one is the goal.
    pub(crate) fn pass_turns_at(&mut self, state: &State, tolerance: Tolerance) {
        while let [next, _, ..] = self.ahead().as_slice()
            && state.matches(&next.state, tolerance)
        {
            let passed = next.passed;
            self.pass(passed);
        }
    }

    /// Whether nothing is left to fly for it in `state`.
    pub(crate) fn is_reached_in(&self, state: &State, tolerance: Tolerance) -> bool {
        self.ahead().len() == 1 && state.matches(&self.goal, tolerance)
    }

    /// Whether a vehicle in `state`, which was flying `way` last, is on neither that way nor the line that it is to fly.
    pub(crate) fn is_line_left(&self, state: &State, way: Option<(Ned, Ned)>, tolerance: Tolerance) -> bool {
        let passed = self.passed();
        let next = self.status.objective.survey.as_ref().and_then(|it| it.turns().get(passed));
        if passed == 0 || next.is_none_or(|it| !it.ends_line) {
            return false;
        }
        let line = (self.turn(passed - 1).position, self.turn(passed).position);
        let is_off = |(from, to)| tolerance.horizontal_m < state.position.horizontal_distance_to_line_m(from, to);
        is_off(line) && way.is_none_or(is_off)
    }

    pub(crate) fn passed(&self) -> usize {
        self.status.objective.survey.as_ref().map_or(0, |it| it.passed())
    }

    fn turn(&self, index: usize) -> State {
        let turn = self.status.objective.survey.as_ref().and_then(|it| it.turns().get(index));
        turn.map_or_else(|| self.goal.clone(), |it| State::new(it.at.at_height(self.goal.position.height_m()), true))
    }
}
