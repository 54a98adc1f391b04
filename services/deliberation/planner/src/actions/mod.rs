//! The actions of the vehicle as back-chaining sees them: each has a state that it reaches and a
//! state that it starts from. A new action is one file here and one line in [`ACTIONS`].

use std::fmt::Debug;

use domain::plan::Parameters;
use domain::state::{State, Tolerance};

use crate::config::Config;

pub(crate) mod land;
pub(crate) mod position;
pub(crate) mod release;
pub(crate) mod stop;
pub(crate) mod takeoff;

/// Every action, in the order that breaks ties between equal scores.
pub(crate) const ACTIONS: [&dyn Action; 5] =
    [&land::Land, &takeoff::Takeoff, &stop::Stop, &position::Position, &release::Release];

/// One action of the table.
pub(crate) trait Action: Debug + Sync {
    /// Its name in plans and logs.
    fn name(&self) -> &'static str;

    /// Whether it can end in `goal`, on the way from `start`.
    fn test(&self, goal: &State, start: &State, config: &Config) -> bool;

    /// The state closest to `start` from which it can reach `goal`, which is reached within the tolerance.
    fn propagate_backwards(&self, goal: &State, start: &State, tolerance: Tolerance, config: &Config) -> State;

    /// How it is flown from `from` to `goal`, and under which conditions. The permissions of the
    /// areas on its way are added later.
    fn set_parameters(&self, from: &State, goal: &State, config: &Config) -> Parameters;

    /// Where the vehicle waits for the permissions this action needs.
    fn waits(&self) -> Waits;
}

/// Where the permissions an action needs are waited for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Waits {
    /// At a stand-off before each border on its way.
    BeforeEachBorder,
    /// In a stop before the action begins.
    WhereItStarts,
}
