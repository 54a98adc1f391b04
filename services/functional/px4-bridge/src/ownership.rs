//! Who chose the mode that PX4 flies: Kittiwake, or somebody else with a remote control or another ground station.
//!
//! PX4 does not say who. A mode that it intends and that nobody here has commanded just now is somebody else's, except where PX4
//! changes it by itself: a takeoff that is at its height becomes Hold, and with the disarming after a landing the mode from before
//! comes back. Once it is somebody else's, it stays so until a command from here takes effect.

use std::time::Duration;

use domain::time::Time;

use crate::modes::NavState;

/// A command shows in the mode within this time. (Measured: within 60 ms of an acknowledgement that took at most 390 ms.)
const TAKES_EFFECT: Duration = Duration::from_secs(3);
/// As many commands may be on their way.
const MOST: usize = 8;

/// What the newest status shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Seen {
    /// Whether the motors may turn.
    pub(crate) armed: bool,
    /// The mode that was asked for, by whomever.
    pub(crate) intended: NavState,
    /// Height above the origin, if it is known.
    pub(crate) height_m: Option<f64>,
}

/// Whose mode it is.
#[derive(Debug, Clone)]
pub(crate) struct Ownership {
    short_m: f64,
    commanded: Vec<(NavState, Time)>,
    armed_at: Option<Time>,
    /// How high the newest takeoff of ours is to end.
    takeoff_m: Option<f64>,
    last: Option<Seen>,
    by_other: bool,
}

impl Ownership {
    /// Nothing is known yet. A takeoff that ends `short_m` below its height was ended by somebody.
    pub(crate) fn new(short_m: f64) -> Ownership {
        Ownership { short_m, commanded: Vec::new(), armed_at: None, takeoff_m: None, last: None, by_other: false }
    }

    /// Whether somebody else has chosen the mode.
    pub(crate) fn is_by_other(&self) -> bool {
        self.by_other
    }

    /// A command that sets this mode was sent; for a takeoff with its height.
    pub(crate) fn commanded(&mut self, mode: NavState, takeoff_m: Option<f64>, now: Time) {
        self.takeoff_m = takeoff_m.or(self.takeoff_m);
        if self.commanded.len() == MOST {
            self.commanded.remove(0);
        }
        self.commanded.push((mode, now));
    }

    /// A command to arm was sent.
    pub(crate) fn arming(&mut self, now: Time) {
        self.armed_at = Some(now);
    }

    /// PX4 took a command that sets this mode: where that is the mode already, no change will show it. While another one of ours is not
    /// seen yet, it is the mode from before: answers come sooner than statuses. (Measured: 1 to 12 ms and 12 to 40 ms; a stop of a real
    /// flight, replaced 10 ms later, looked like somebody else's.)
    pub(crate) fn accepted(&mut self, mode: NavState) {
        let is_last = self.commanded.iter().all(|(it, _)| *it == mode);
        if is_last && self.last.is_some_and(|it| it.intended == mode) {
            self.commanded.retain(|(it, _)| *it != mode);
            self.by_other = false;
        }
    }

    /// PX4 did not take it.
    pub(crate) fn refused(&mut self, mode: NavState) {
        self.commanded.retain(|(it, _)| *it != mode);
    }

    /// PX4 was started again: its next status is compared with none.
    pub(crate) fn restarted(&mut self) {
        self.commanded.clear();
        self.last = None;
    }

    /// A status has arrived.
    pub(crate) fn seen(&mut self, seen: Seen, now: Time) {
        let recent = |at: Time| now - at <= TAKES_EFFECT;
        self.commanded.retain(|(_, at)| recent(*at));
        let previous = self.last.replace(seen);
        if seen.armed && !seen.intended.is_commandable() {
            self.by_other = true;
        }
        let Some(previous) = previous else { return };
        if seen.intended != previous.intended {
            if let Some(index) = self.commanded.iter().rposition(|(it, _)| *it == seen.intended) {
                self.commanded.drain(..=index);
                self.by_other = false;
            } else if seen.armed && !self.changes_by_itself(previous, seen) {
                self.by_other = true;
            }
        }
        if seen.armed && !previous.armed && !self.armed_at.is_some_and(recent) {
            self.by_other = true;
        }
    }

    /// Whether PX4 does this without anybody: it ends a takeoff. (The change back after a landing comes with the disarming.)
    fn changes_by_itself(&self, from: Seen, to: Seen) -> bool {
        let is_short = self.takeoff_m.zip(to.height_m).is_some_and(|(wanted, is)| is < wanted - self.short_m);
        (from.intended, to.intended) == (NavState::TAKEOFF, NavState::LOITER) && !is_short
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64) -> Time {
        Time::after(Duration::from_millis(ms))
    }

    fn seen(armed: bool, intended: NavState, height_m: f64) -> Seen {
        Seen { armed, intended, height_m: Some(height_m) }
    }

    /// Armed by us, with `mode` commanded and flown.
    fn flown(mode: NavState) -> Ownership {
        let mut ownership = Ownership::new(2.0);
        ownership.seen(seen(false, NavState::LOITER, 0.0), at(0));
        ownership.arming(at(0));
        ownership.commanded(mode, (mode == NavState::TAKEOFF).then_some(10.0), at(0));
        ownership.seen(seen(true, mode, 0.0), at(100));
        assert!(!ownership.is_by_other());
        ownership
    }

    #[test]
    fn what_was_commanded_is_ours_and_everything_else_is_not() {
        #[track_caller]
        fn check(from: NavState, to: NavState, height_m: f64, by_other: bool) {
            let mut ownership = flown(from);
            ownership.seen(seen(true, to, height_m), at(20_000));
            assert_eq!(ownership.is_by_other(), by_other, "{} to {}", from.name(), to.name());
        }
        check(NavState::OFFBOARD, NavState::OFFBOARD, 10.0, false);
        check(NavState::OFFBOARD, NavState::LOITER, 10.0, true);
        check(NavState::OFFBOARD, NavState(2), 10.0, true);
        check(NavState::OFFBOARD, NavState::RETURN, 10.0, true);
        // PX4 ends a takeoff by itself, a little short of its height.
        check(NavState::TAKEOFF, NavState::LOITER, 9.3, false);
        check(NavState::TAKEOFF, NavState::LOITER, 4.0, true);
        check(NavState::TAKEOFF, NavState::LAND, 9.3, true);
    }

    #[test]
    fn after_a_landing_the_mode_from_before_comes_back_and_is_nobodys() {
        let mut ownership = flown(NavState::LAND);
        ownership.seen(seen(false, NavState::OFFBOARD, 0.4), at(20_000));
        assert!(!ownership.is_by_other());
    }

    #[test]
    fn it_is_ours_again_once_a_command_takes_effect() {
        let taken_over = || {
            let mut ownership = flown(NavState::OFFBOARD);
            ownership.seen(seen(true, NavState(2), 10.0), at(20_000));
            ownership.seen(seen(true, NavState::LOITER, 10.0), at(21_000));
            assert!(ownership.is_by_other(), "another change by somebody else");
            ownership
        };
        let mut ownership = taken_over();
        ownership.commanded(NavState::OFFBOARD, None, at(30_000));
        assert!(ownership.is_by_other(), "nothing has taken effect");
        ownership.seen(seen(true, NavState::OFFBOARD, 10.0), at(30_050));
        assert!(!ownership.is_by_other());
        // The mode is the same as before: only the acknowledgement shows it.
        let mut ownership = taken_over();
        ownership.commanded(NavState::LOITER, None, at(30_000));
        ownership.accepted(NavState::LOITER);
        assert!(!ownership.is_by_other());
        // What PX4 refuses takes no effect, and neither does what is long past.
        let mut ownership = taken_over();
        ownership.commanded(NavState::OFFBOARD, None, at(30_000));
        ownership.refused(NavState::OFFBOARD);
        ownership.seen(seen(true, NavState::OFFBOARD, 10.0), at(30_050));
        assert!(ownership.is_by_other());
        let mut ownership = taken_over();
        ownership.commanded(NavState::OFFBOARD, None, at(30_000));
        ownership.seen(seen(true, NavState::OFFBOARD, 10.0), at(34_000));
        assert!(ownership.is_by_other());
    }

    #[test]
    fn a_command_that_is_replaced_before_it_shows_is_ours_too() {
        let mut ownership = flown(NavState::OFFBOARD);
        ownership.commanded(NavState::LOITER, None, at(30_000));
        ownership.accepted(NavState::LOITER);
        ownership.commanded(NavState::OFFBOARD, None, at(30_005));
        ownership.accepted(NavState::OFFBOARD);
        ownership.seen(seen(true, NavState::LOITER, 10.0), at(30_020));
        ownership.seen(seen(true, NavState::OFFBOARD, 10.0), at(30_030));
        assert!(!ownership.is_by_other());
    }

    #[test]
    fn whoever_arms_flies() {
        let mut ownership = Ownership::new(2.0);
        ownership.seen(seen(false, NavState::LOITER, 0.0), at(0));
        ownership.seen(seen(true, NavState::LOITER, 0.0), at(1000));
        assert!(ownership.is_by_other());
    }

    #[test]
    fn a_bridge_that_starts_in_flight_takes_a_mode_of_ours_for_ours_and_a_pilots_for_the_pilots() {
        #[track_caller]
        fn check(armed: bool, mode: NavState, by_other: bool) {
            let mut ownership = Ownership::new(2.0);
            ownership.seen(seen(armed, mode, 10.0), at(0));
            assert_eq!(ownership.is_by_other(), by_other, "{}", mode.name());
        }
        check(true, NavState::OFFBOARD, false);
        check(true, NavState(2), true);
        check(true, NavState::RETURN, true);
        check(false, NavState(2), false);
    }

    #[test]
    fn on_the_ground_a_mode_may_be_chosen_without_flying() {
        let mut ownership = Ownership::new(2.0);
        ownership.seen(seen(false, NavState::LOITER, 0.0), at(0));
        ownership.seen(seen(false, NavState(2), 0.0), at(1000));
        assert!(!ownership.is_by_other());
    }
}
