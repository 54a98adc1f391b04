//! The care for a vehicle in the air that no skill flies: loiter is commanded, after a moment in
//! which the next skill may come.

use std::time::Duration;

use domain::fmu::FlightMode;
use domain::time::Time;

use crate::vehicle::View;

/// Whether a skill has left the vehicle, and how often loiter was tried since then.
#[derive(Debug)]
pub(crate) struct IdleCare {
    wait: Duration,
    tries: u32,
    idle: Option<Idle>,
}

#[derive(Debug, Clone, Copy)]
struct Idle {
    /// When loiter is to be commanded.
    due: Time,
    tries: u32,
}

impl IdleCare {
    /// Commands loiter `wait` after a skill has left the vehicle, and at most `tries` times.
    pub(crate) fn new(wait: Duration, tries: u32) -> IdleCare {
        IdleCare { wait, tries, idle: None }
    }

    /// A skill has ended and its successor is not there yet.
    pub(crate) fn begin(&mut self, now: Time) {
        self.idle.get_or_insert(Idle { due: now + self.wait, tries: 0 });
    }

    /// The same, where the last setpoint must not be flown for a moment longer.
    pub(crate) fn begin_at_once(&mut self, now: Time) {
        self.idle = Some(Idle { due: now, tries: 0 });
    }

    /// A skill or the autopilot flies the vehicle.
    pub(crate) fn end(&mut self) {
        self.idle = None;
    }

    /// Whether it waits for the next skill, or for loiter.
    pub(crate) fn is_idle(&self) -> bool {
        self.idle.is_some()
    }

    /// When loiter is to be commanded.
    pub(crate) fn loiter_due(&self) -> Option<Time> {
        self.idle.map(|it| it.due)
    }

    /// Loiter was accepted or not; if not, it is tried again a few times.
    pub(crate) fn loiter_answered(&mut self, accepted: bool, now: Time) {
        let tried = self.idle.take().map(|it| it.tries + 1);
        let again = tried.filter(|it| !accepted && *it < self.tries);
        self.idle = again.map(|tries| Idle { due: now + self.wait, tries });
    }
}

/// Whether a vehicle that no skill flies needs a loiter command: not if it is on the ground, loiters,
/// or is flown by a failsafe of the autopilot. Where the data do not show it, it does: the command is
/// rejected at worst.
pub(crate) fn needs_loiter(view: &View) -> bool {
    let loiters = view.status.is_some_and(|it| it.is_in(FlightMode::Loiter));
    let autopilot_flies = view.status.is_some_and(|it| it.is_pre_empted());
    !(view.at_rest_on_ground() == Some(true) || loiters || autopilot_flies)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::FlightStatus;

    #[test]
    fn loiter_is_commanded_unless_the_vehicle_is_safe_without() {
        #[track_caller]
        fn check(flying: Option<bool>, status: Option<FlightStatus>, expected: bool) {
            assert_eq!(needs_loiter(&View { flying, status, ..View::default() }), expected);
        }
        let flies = |intended, actual| {
            let failsafe = intended != actual;
            Some(FlightStatus { intended: Some(intended), actual: Some(actual), failsafe, ..FlightStatus::flying() })
        };
        use FlightMode::{Loiter, Offboard, Return, Takeoff};
        check(Some(true), flies(Offboard, Offboard), true);
        check(Some(true), flies(Takeoff, Takeoff), true);
        check(Some(true), flies(Loiter, Loiter), false);
        check(Some(true), flies(Offboard, Return), false);
        check(Some(false), flies(Loiter, Loiter), false);
        check(Some(false), flies(Takeoff, Takeoff), true);
        check(None, None, true);
    }

    #[test]
    fn loiter_is_tried_a_few_times_and_not_after_it_was_accepted() {
        let (wait, second) = (Duration::from_millis(200), Duration::from_secs(1));
        let mut care = IdleCare::new(wait, 2);
        care.begin(Time::ZERO);
        care.begin(Time::ZERO + second);
        assert_eq!(care.loiter_due(), Some(Time::ZERO + wait), "from the end of the first skill on");
        care.loiter_answered(false, Time::ZERO + second);
        assert_eq!(care.loiter_due(), Some(Time::ZERO + second + wait));
        care.loiter_answered(false, Time::ZERO + second);
        assert_eq!(care.loiter_due(), None);
        care.begin(Time::ZERO);
        care.loiter_answered(true, Time::ZERO + second);
        assert_eq!(care.loiter_due(), None);
    }
}
