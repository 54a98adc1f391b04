//! The load released where the vehicle hovers.

use domain::fmu::{FlightMode, Gripper};
use domain::geometry::Ned;
use domain::plan::{Condition, Parameters};
use domain::skill::Goal;
use domain::speeds::Speeds;
use domain::state::{State, Tolerance};

use super::{Action, Waits};
use crate::config::Config;

/// For how long the vehicle hovers for a release, in seconds, of its time and its energy. (ENG: a second until a servo has opened,
/// and as much again before and behind it for the command and for the status that shows it.)
const RELEASE_S: f64 = 3.0;

/// See the module.
#[derive(Debug)]
pub(crate) struct Release;

impl Action for Release {
    fn name(&self) -> &'static str {
        "release"
    }

    fn test(&self, goal: &State, _start: &State, _config: &Config) -> bool {
        goal.flying && goal.gripper == Some(Gripper::Released)
    }

    /// At rest there: a load that leaves a moving vehicle falls elsewhere.
    fn propagate_backwards(&self, goal: &State, _start: &State, _tolerance: Tolerance, _config: &Config) -> State {
        State { gripper: None, mode: Some(FlightMode::Loiter), ..goal.clone() }
    }

    fn set_parameters(&self, _from: &State, goal: &State, _config: &Config) -> Parameters {
        Parameters {
            goal: Goal::Release { over: goal.position },
            precondition: Condition { flying: Some(true), ..Condition::default() },
            invariant: Condition { flying: Some(true), mode: Some(FlightMode::Loiter), ..Condition::default() },
        }
    }

    fn waits(&self) -> Waits {
        Waits::WhereItStarts
    }
}

/// How long an action takes besides its way, in seconds.
pub(crate) fn time_s(goal: &Goal) -> f64 {
    match goal {
        Goal::Release { .. } => RELEASE_S,
        Goal::Land | Goal::Takeoff { .. } | Goal::Stop | Goal::Position { .. } | Goal::Velocity { .. } => 0.0,
    }
}

/// The straight way that must be free for an action from `from` to `to`: of a release that of the load, which falls to the height
/// of the take-off point.
pub(crate) fn free_way(goal: &Goal, (from, to): (Ned, Ned)) -> (Ned, Ned) {
    match goal {
        Goal::Release { .. } => (from, from.at_height(from.height_m().min(0.0))),
        Goal::Land | Goal::Takeoff { .. } | Goal::Stop | Goal::Position { .. } | Goal::Velocity { .. } => (from, to),
    }
}

/// How fast what needs that way moves along it: the vehicle with `speeds`, or the load.
pub(crate) fn free_speeds(goal: &Goal, speeds: Speeds) -> Speeds {
    match goal {
        Goal::Release { .. } => Speeds::OF_A_LOAD,
        Goal::Land | Goal::Takeoff { .. } | Goal::Stop | Goal::Position { .. } | Goal::Velocity { .. } => speeds,
    }
}
