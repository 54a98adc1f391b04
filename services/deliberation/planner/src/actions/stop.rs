//! At rest where the vehicle is; on the ground, nothing.
//!
//! No objective asks for it. The communication plan does, where a permission is needed before a
//! takeoff or a landing, and a release does, which begins at rest.

use domain::fmu::FlightMode;
use domain::plan::{Condition, Parameters};
use domain::skill::Goal;
use domain::state::{State, Tolerance};

use super::{Action, Waits};
use crate::config::Config;

/// See the module.
#[derive(Debug)]
pub(crate) struct Stop;

impl Action for Stop {
    fn name(&self) -> &'static str {
        "stop"
    }

    /// All it changes is the mode.
    fn test(&self, goal: &State, _start: &State, _config: &Config) -> bool {
        goal.mode == Some(FlightMode::Loiter) && goal.gripper.is_none()
    }

    fn propagate_backwards(&self, goal: &State, _start: &State, _tolerance: Tolerance, _config: &Config) -> State {
        State { mode: None, ..goal.clone() }
    }

    fn set_parameters(&self, from: &State, _goal: &State, _config: &Config) -> Parameters {
        Parameters {
            goal: Goal::Stop,
            precondition: Condition { flying: Some(from.flying), ..Condition::default() },
            invariant: Condition {
                flying: Some(from.flying),
                mode: from.flying.then_some(FlightMode::Loiter),
                ..Condition::default()
            },
        }
    }

    fn waits(&self) -> Waits {
        Waits::WhereItStarts
    }
}
