//! The mode on the ground: whether the vehicle can be armed it says truly only in the mode in which it is flown.
//!
//! That mode is selected once after a start and once after a landing, when the mode has been the same for a while: an autopilot that
//! starts may still take the mode that a switch of its remote control names. A pilot who changes it afterwards is not
//! fought; it is selected again before each arming.

use std::time::Duration;

use domain::time::Time;

/// A mode that is the same for this long is not about to change by itself. (A real ArduPilot takes that of its switch
/// 0.2 s after it is ready.)
const STEADY: Duration = Duration::from_secs(1);
/// A mode that was asked for and is not seen is asked for again after this time.
const PERIOD: Duration = Duration::from_secs(1);

/// Selects the mode.
#[derive(Debug)]
pub(crate) struct Grooming {
    /// It has not been seen since the start or the landing.
    wanted: bool,
    seen: Option<(Time, u32)>,
    next: Time,
}

impl Grooming {
    /// It is to be selected.
    pub(crate) fn new() -> Grooming {
        Grooming { wanted: true, seen: None, next: Time::ZERO }
    }

    /// Whether to select the mode `ground` now. `stands_in` is the mode of a vehicle that has started and stands on the ground with
    /// its motors off and that nobody else has taken; otherwise `None`.
    pub(crate) fn is_due(&mut self, stands_in: Option<u32>, ground: u32, now: Time) -> bool {
        let Some(mode) = stands_in else {
            self.seen = None;
            return false;
        };
        if self.seen.map(|(_, seen)| seen) != Some(mode) {
            self.seen = Some((now, mode));
        }
        let is_steady = self.seen.is_some_and(|(since, _)| STEADY <= now - since);
        self.wanted &= !(is_steady && mode == ground);
        let is_due = self.wanted && is_steady && self.next <= now;
        if is_due {
            self.next = now + PERIOD;
        }
        is_due
    }

    /// When it may be due.
    pub(crate) fn deadline(&self) -> Option<Time> {
        let (since, _) = self.seen.filter(|_| self.wanted)?;
        Some(self.next.max(since + STEADY))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GROUND: u32 = 4;
    const SWITCH: u32 = 5;

    /// At these ms the vehicle stands in this mode, and the mode is to be selected or not.
    #[track_caller]
    fn check(seen: &[(u64, Option<u32>, bool)]) {
        let mut grooming = Grooming::new();
        for (ms, stands_in, expected) in seen {
            let now = Time::after(Duration::from_millis(*ms));
            assert_eq!(grooming.is_due(*stands_in, GROUND, now), *expected, "{ms} ms: {seen:?}");
        }
    }

    #[test]
    fn the_mode_of_a_switch_is_waited_for_and_left() {
        let switched = [(0, Some(0), false), (200, Some(SWITCH), false), (1_100, Some(SWITCH), false)];
        check(&[&switched[..], &[(1_200, Some(SWITCH), true), (1_300, Some(SWITCH), false)]].concat());
        // The command was lost.
        check(&[&switched[..], &[(1_200, Some(SWITCH), true), (2_200, Some(SWITCH), true)]].concat());
    }

    #[test]
    fn whoever_changes_it_afterwards_is_not_fought() {
        check(&[(0, Some(GROUND), false), (1_000, Some(GROUND), false), (9_000, Some(SWITCH), false)]);
        check(&[
            (0, Some(GROUND), false),
            (1_000, Some(GROUND), false),
            (9_000, Some(SWITCH), false),
            (20_000, Some(SWITCH), false),
        ]);
    }

    #[test]
    fn a_mode_that_is_undone_at_the_end_of_a_start_is_selected_again() {
        check(&[(0, Some(GROUND), false), (900, Some(0), false), (1_900, Some(0), true)]);
    }

    #[test]
    fn nothing_is_selected_where_it_does_not_stand() {
        check(&[
            (0, Some(SWITCH), false),
            (500, None, false),
            (1_000, Some(SWITCH), false),
            (2_000, Some(SWITCH), true),
        ]);
    }
}
