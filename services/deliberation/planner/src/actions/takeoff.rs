//! Straight up from the ground.

use domain::plan::{Condition, Parameters};
use domain::skill::Goal;
use domain::state::{State, Tolerance};

use super::{Action, Waits};
use crate::config::Config;

/// See the module.
#[derive(Debug)]
pub(crate) struct Takeoff;

impl Action for Takeoff {
    fn name(&self) -> &'static str {
        "takeoff"
    }

    /// Only where it is a climb worth the name: the ground may be higher than the goal.
    fn test(&self, goal: &State, start: &State, config: &Config) -> bool {
        goal.flying
            && goal.mode.is_none()
            && goal.gripper.is_none()
            && config.least_climb_m.get() <= goal.position.height_m() - ground_height_m(goal, start, config)
    }

    fn propagate_backwards(&self, goal: &State, start: &State, _tolerance: Tolerance, config: &Config) -> State {
        State::new(goal.position.at_height(ground_height_m(goal, start, config)), false)
    }

    /// No clause about the mode: at the top the autopilot goes over to loiter by itself.
    fn set_parameters(&self, from: &State, goal: &State, _config: &Config) -> Parameters {
        Parameters {
            goal: Goal::Takeoff { climb_m: goal.position.height_m() - from.position.height_m() },
            precondition: Condition { flying: Some(false), ..Condition::default() },
            invariant: Condition::default(),
        }
    }

    fn waits(&self) -> Waits {
        Waits::WhereItStarts
    }
}

/// Where the ground is: known under a vehicle that stands on it.
fn ground_height_m(goal: &State, start: &State, config: &Config) -> f64 {
    if start.flying { goal.position.height_m() - config.takeoff_height_m.get() } else { start.position.height_m() }
}
