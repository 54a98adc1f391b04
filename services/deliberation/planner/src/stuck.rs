//! Notices a step that fails again and again while the vehicle gets nowhere.
//!
//! A failure that a permission explains does not count: the record of permissions ends those.

use domain::state::State;

use crate::config::Config;
use crate::plan::Step;

/// The last failure, and how often it came in a row.
#[derive(Debug, Default)]
pub struct Stuck {
    last: Option<Failure>,
}

#[derive(Debug)]
struct Failure {
    action: &'static str,
    goal: State,
    vehicle: State,
    count: u32,
}

impl Stuck {
    /// `step` failed with the vehicle in state `vehicle`. Whether it may be tried again.
    pub fn failed(&mut self, step: &Step, vehicle: &State, config: &Config) -> bool {
        let before = self.last.take().filter(|it| {
            it.action == step.action.name
                && it.goal.matches(&step.action.to, config.tolerance())
                && vehicle.matches(&State { mode: None, ..it.vehicle.clone() }, config.tolerance())
        });
        let count = before.map_or(0, |it| it.count) + 1;
        let vehicle = vehicle.clone();
        self.last = Some(Failure { action: step.action.name, goal: step.action.to.clone(), vehicle, count });
        count < config.failures_at_most.get()
    }

    /// A step was flown.
    pub fn got_on(&mut self) {
        self.last = None;
    }
}
