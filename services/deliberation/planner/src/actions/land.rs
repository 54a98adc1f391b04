//! Straight down to the ground.

use domain::fmu::FlightMode;
use domain::plan::{Condition, Parameters};
use domain::skill::Goal;
use domain::state::{State, Tolerance};

use super::{Action, Waits};
use crate::config::Config;

/// See the module.
#[derive(Debug)]
pub(crate) struct Land;

impl Action for Land {
    fn name(&self) -> &'static str {
        "land"
    }

    fn test(&self, goal: &State, _start: &State, _config: &Config) -> bool {
        !goal.flying
    }

    /// Airborne at the default height over the spot, or at the present height by a vehicle that is
    /// over the spot already: one that sinks need not climb again.
    fn propagate_backwards(&self, goal: &State, start: &State, tolerance: Tolerance, config: &Config) -> State {
        if start.flying && start.is_over(goal, tolerance) {
            return State::new(start.position, true);
        }
        State::new(goal.position.at_height(goal.position.height_m() + config.takeoff_height_m.get()), true)
    }

    /// The invariant does not ask for flying, which ends with success.
    fn set_parameters(&self, _from: &State, _goal: &State, _config: &Config) -> Parameters {
        Parameters {
            goal: Goal::Land,
            precondition: Condition { flying: Some(true), ..Condition::default() },
            invariant: Condition { mode: Some(FlightMode::Land), ..Condition::default() },
        }
    }

    fn waits(&self) -> Waits {
        Waits::WhereItStarts
    }
}
