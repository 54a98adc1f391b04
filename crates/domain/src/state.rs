//! The state from which a plan starts, or which it reaches: where the vehicle is, whether it flies, in which mode, and
//! which areas it may enter.

use std::collections::BTreeSet;

use crate::fmu::{FlightMode, Gripper};
use crate::geometry::Ned;
use crate::quantity::Fraction;
use crate::task::Task;

/// A state to start from or to reach.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Where.
    pub position: Ned,
    /// In the air or on the ground.
    pub flying: bool,
    /// The flight mode; `None` where a state to reach has no particular mode.
    pub mode: Option<FlightMode>,
    /// Areas whose permission is held, or needed, there.
    pub permissions: BTreeSet<String>,
    /// The charge of the battery; `None` where it is not known, or of no matter.
    pub charge: Option<Fraction>,
    /// What the gripper does; `None` where that is not known, or a state to reach does not ask for it.
    pub gripper: Option<Gripper>,
    /// The tasks of the objective that are done, or are to be done, in their order.
    pub done: Vec<Task>,
}

/// How far apart two states may be and still count as one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Over ground, in metres.
    pub horizontal_m: f64,
    /// In height while in the air, in metres.
    pub vertical_m: f64,
    /// In height on the ground, in metres.
    pub ground_m: f64,
}

impl State {
    /// A state to reach, in any mode, with or without a load.
    pub fn new(position: Ned, flying: bool) -> State {
        State {
            position,
            flying,
            mode: None,
            permissions: BTreeSet::new(),
            charge: None,
            gripper: None,
            done: Vec::new(),
        }
    }

    /// Whether this state is `goal` within the tolerance.
    pub fn matches(&self, goal: &State, tolerance: Tolerance) -> bool {
        let apart_m = (self.position.height_m() - goal.position.height_m()).abs();
        self.flying == goal.flying
            && self.is_over(goal, tolerance)
            && apart_m <= if self.flying { tolerance.vertical_m } else { tolerance.ground_m }
            && goal.mode.is_none_or(|mode| self.mode == Some(mode))
            && goal.gripper.is_none_or(|gripper| self.gripper == Some(gripper))
            && goal.done.len() <= self.done.len()
    }

    /// Whether both are over the same spot within the tolerance.
    pub fn is_over(&self, other: &State, tolerance: Tolerance) -> bool {
        self.position.horizontal_distance_m(other.position) <= tolerance.horizontal_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_match_within_the_tolerance() {
        #[track_caller]
        fn check(a: (f64, f64, bool), b: (f64, f64, bool), expected: bool) {
            let state = |(east, height, flying): (f64, f64, bool)| State::new(Ned::new(0.0, east, -height), flying);
            let tolerance = Tolerance { horizontal_m: 3.0, vertical_m: 2.0, ground_m: 5.0 };
            assert_eq!(state(a).matches(&state(b), tolerance), expected, "{a:?} {b:?}");
        }
        check((0.0, 10.0, true), (2.9, 11.9, true), true);
        check((0.0, 10.0, true), (3.1, 10.0, true), false);
        check((0.0, 10.0, true), (0.0, 12.1, true), false);
        check((0.0, 0.0, false), (0.0, 0.0, true), false);
        // Ground is not level, but a deck is not the sea.
        check((0.0, 4.0, false), (0.0, 0.0, false), true);
        check((0.0, 0.0, false), (0.0, 30.0, false), false);
    }

    #[test]
    fn a_state_without_a_load_is_matched_only_by_an_open_gripper() {
        #[track_caller]
        fn check(vehicle: Option<Gripper>, goal: Option<Gripper>, expected: bool) {
            let state = |gripper| State { gripper, ..State::new(Ned::default(), true) };
            let tolerance = Tolerance { horizontal_m: 3.0, vertical_m: 2.0, ground_m: 5.0 };
            assert_eq!(state(vehicle).matches(&state(goal), tolerance), expected, "{vehicle:?} {goal:?}");
        }
        let (holding, released) = (Some(Gripper::Holding), Some(Gripper::Released));
        check(released, released, true);
        check(holding, released, false);
        // What is not known does not count as released.
        check(None, released, false);
        check(holding, None, true);
    }
}
