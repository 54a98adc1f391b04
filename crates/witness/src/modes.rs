//! Whether the vehicle's mode is commanded more often than there are reasons to: a system that goes to and fro between two
//! responses breaks no rule of the airspace, and flies nowhere.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use domain::time::Time;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;

/// Changes of the commanded mode for each cause. A step or a response takes five at most (takeoff, loiter, offboard, loiter,
/// land); the rest is for a response that comes before it is flown to its end.
pub const CHANGES_PER_CAUSE: u32 = 8;

/// Time in which a response may try its action again, or the planner make another plan, without a cause from outside. Shorter than the
/// limits of the tries in the shipped table.
pub const RETRY: Duration = Duration::from_secs(30);

/// The commanded mode has changed more often than the causes explain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModeStorm {
    /// When there was the first change too many.
    pub at: Time,
    /// Changes until then.
    pub changes: u32,
    /// Causes until then.
    pub causes: u32,
}

/// Counts changes of the commanded mode, and what may cause them: the start, each step of a plan the first time, each flag that rises
/// or falls, each permission that changes, what comes from outside, and [`RETRY`] of time.
#[derive(Debug, Default)]
pub struct Modes {
    mode: Option<v1::FlightMode>,
    changes: u32,
    causes: u32,
    permissions: BTreeMap<String, v1::PermissionState>,
    /// Flags that are up, each with the number of its rise.
    up: BTreeMap<String, u64>,
    /// Objective and number of the step.
    steps: BTreeSet<(u32, u32)>,
    armed_from: Option<Time>,
    storm: Option<ModeStorm>,
}

impl Modes {
    /// Something happens from outside: an order, a fault, a process that hangs.
    pub fn troubled(&mut self) {
        self.causes += 1;
    }

    /// A message passes by at this time.
    pub fn take_in(&mut self, at: Time, message: &Message) {
        match message {
            Message::Introspection(it) => {
                let up: BTreeMap<_, _> = it.flags.iter().map(|it| (it.name.clone(), it.rise)).collect();
                let changed = |of: &BTreeMap<String, u64>, other: &BTreeMap<String, u64>| {
                    of.iter().filter(|(name, rise)| other.get(*name) != Some(*rise)).count()
                };
                self.causes += (changed(&up, &self.up) + changed(&self.up, &up)) as u32;
                self.up = up;
            }
            Message::PermissionLedger(it) => {
                for permission in &it.permissions {
                    let before = self.permissions.insert(permission.area.clone(), permission.state());
                    self.causes += u32::from(before != Some(permission.state()));
                }
            }
            Message::McmStatus(it) => {
                let step = it.step.as_ref().map(|step| (step.objective, it.step_number));
                self.causes += u32::from(step.is_some_and(|step| self.steps.insert(step)));
            }
            Message::VehicleStatus(it) => {
                self.armed_from = self.armed_from.or(it.armed.then_some(at));
                let before = self.mode.replace(it.intended_mode());
                if before.is_some_and(|before| before != it.intended_mode()) {
                    self.changed(at);
                }
            }
            _ => {}
        }
    }

    /// The first change too many, if there was one.
    pub fn storm(&self) -> Option<ModeStorm> {
        self.storm
    }

    fn changed(&mut self, at: Time) {
        self.changes += 1;
        let armed_for = self.armed_from.map_or(Duration::ZERO, |from| at - from);
        let retries = u32::try_from(armed_for.as_secs() / RETRY.as_secs()).unwrap_or(u32::MAX);
        // The start is one.
        let causes = self.causes.saturating_add(retries).saturating_add(1);
        if causes.saturating_mul(CHANGES_PER_CAUSE) < self.changes {
            let storm = ModeStorm { at, changes: self.changes, causes };
            self.storm.get_or_insert(storm);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v1::FlightMode::{Land, Loiter};

    fn status(mode: v1::FlightMode) -> Message {
        v1::VehicleStatus { armed: true, intended_mode: mode.into(), ..Default::default() }.into()
    }

    /// The mode goes to and fro that often, once every `every`, after `causes` from outside; when that is too much.
    fn storm(changes: u64, every: Duration, causes: u32) -> Option<ModeStorm> {
        let mut modes = Modes::default();
        (0..causes).for_each(|_| modes.troubled());
        for number in 0..=changes {
            let at = Time::after(every * u32::try_from(number).unwrap());
            modes.take_in(at, &status(if number.is_multiple_of(2) { Loiter } else { Land }));
        }
        modes.storm()
    }

    #[test]
    fn a_mode_that_goes_to_and_fro_is_a_storm_unless_there_are_causes() {
        let quick = Duration::from_millis(100);
        assert_eq!(storm(8, quick, 0), None, "the start is a cause");
        let at = Time::after(Duration::from_millis(900));
        assert_eq!(storm(100, quick, 0), Some(ModeStorm { at, changes: 9, causes: 1 }), "the first that is too many");
        assert_eq!(storm(24, quick, 2), None);
        assert_eq!(storm(25, quick, 2).map(|it| it.causes), Some(3));
        assert_eq!(storm(1000, Duration::from_secs(4), 0), None, "as a response tries again and again");
    }

    #[test]
    fn a_step_and_a_permission_are_causes_once() {
        let mut modes = Modes::default();
        let step = Some(v1::PlanStep { objective: 1, ..Default::default() });
        let permission =
            v1::Permission { area: "A".into(), state: v1::PermissionState::Granted.into(), ..Default::default() };
        for _ in 0..5 {
            let step = v1::McmStatus { step: step.clone(), step_number: 2, ..Default::default() };
            modes.take_in(Time::ZERO, &step.into());
            let ledger = v1::PermissionLedger { permissions: vec![permission.clone()], ..Default::default() };
            modes.take_in(Time::ZERO, &ledger.into());
        }
        assert_eq!(modes.causes, 2);
    }
}
