//! Straight through the air to a position.

use domain::fmu::FlightMode;
use domain::plan::{Condition, Parameters};
use domain::skill::Goal;
use domain::state::{State, Tolerance};

use super::{Action, Waits};
use crate::config::Config;

/// See the module.
#[derive(Debug)]
pub(crate) struct Position;

impl Action for Position {
    fn name(&self) -> &'static str {
        "position"
    }

    fn test(&self, goal: &State, _start: &State, _config: &Config) -> bool {
        goal.flying && goal.mode.is_none() && goal.gripper.is_none()
    }

    /// The start itself if it flies, else over it at the goal's height; at the default height where
    /// the goal's is no climb from the ground the start stands on.
    fn propagate_backwards(&self, goal: &State, start: &State, _tolerance: Tolerance, config: &Config) -> State {
        if start.flying {
            return State::new(start.position, true);
        }
        let ground_m = start.position.height_m();
        let is_climb = config.least_climb_m.get() <= goal.position.height_m() - ground_m;
        let height_m = if is_climb { goal.position.height_m() } else { ground_m + config.takeoff_height_m.get() };
        State::new(start.position.at_height(height_m), true)
    }

    /// The conditions are silent about the place: from wherever the vehicle is it flies to the goal.
    fn set_parameters(&self, _from: &State, goal: &State, config: &Config) -> Parameters {
        Parameters {
            goal: Goal::Position {
                target: goal.position,
                speed_limit_m_s: config.cruise_speed_m_s.get(),
                yaw_rad: None,
                hold_at_target: false,
            },
            precondition: Condition { flying: Some(true), ..Condition::default() },
            invariant: Condition { flying: Some(true), mode: Some(FlightMode::Offboard), ..Condition::default() },
        }
    }

    fn waits(&self) -> Waits {
        Waits::BeforeEachBorder
    }
}
