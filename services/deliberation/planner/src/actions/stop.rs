//! At rest where the vehicle is; on the ground, nothing.
//!
//! No objective asks for it. The communication plan does, where a permission is needed before a
//! takeoff or a landing.

use domain::skill::Goal;
use kittiwake_proto::v1::FlightMode;

use super::{Action, Clauses, Parameters, Waits};
use crate::config::Config;
use crate::state::State;

/// See the module.
#[derive(Debug)]
pub struct Stop;

impl Action for Stop {
    fn name(&self) -> &'static str {
        "stop"
    }

    /// All it changes is the mode.
    fn test(&self, goal: &State, _start: &State, _config: &Config) -> bool {
        goal.mode == Some(FlightMode::Loiter)
    }

    fn propagate_backwards(&self, goal: &State, _start: &State, _config: &Config) -> State {
        State { mode: None, ..goal.clone() }
    }

    fn set_parameters(&self, from: &State, _goal: &State, _config: &Config) -> Parameters {
        Parameters {
            goal: Goal::Stop,
            precondition: Clauses { flying: Some(from.flying), ..Clauses::default() },
            invariant: Clauses {
                flying: Some(from.flying),
                mode: from.flying.then_some(FlightMode::Loiter),
                ..Clauses::default()
            },
        }
    }

    fn waits(&self) -> Waits {
        Waits::WhereItStarts
    }
}
