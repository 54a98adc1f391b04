//! The time since the mission was begun, which goes on over a restart of the process.
//!
//! While a process runs, its monotonic clock counts, so that a step of the wall clock moves no deadline. The time before its start is the
//! difference in UTC to the beginning of the mission, corrected by how much the wall clock was set since; both are persisted. Plans count by it.

use std::time::Duration;

use crate::time::{Now, Pace, Time};

/// A wall clock that differs by more from the monotonic one has stepped; less is not worth a write to the disk. (ENG)
const STEP_MS: u64 = 1000;

/// Counts the time of one mission.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct MissionClock {
    /// In milliseconds since the Unix epoch, by the wall clock as it was then; 0 before the first moment. It tells one mission from another.
    began_utc_ms: i64,
    /// By how much the wall clock was set since.
    set_by_ms: i64,
    /// Seconds that had passed at the zero of this process's clock, negative for a mission that was begun later; `None` before the
    /// first moment.
    before_s: Option<f64>,
}

impl MissionClock {
    /// Goes on with a mission that another process began then; 0: its start is unknown. Until the end of that process
    /// the wall clock was set by `set_by_ms`.
    pub fn resumed(utc_ms: i64, set_by_ms: i64) -> MissionClock {
        MissionClock { began_utc_ms: utc_ms, set_by_ms, before_s: None }
    }

    /// Notices the process's first moment, and a step of the wall clock, so that it counts for no process after this one either.
    pub fn pass(&mut self, now: Now, pace: Pace) {
        if self.before_s.is_some() {
            let passed = self.passed(now);
            let passed_ms = i64::try_from(pace.to_wall(passed).as_millis()).unwrap_or(i64::MAX);
            let set_by_ms = now.utc_ms.saturating_sub(passed_ms).saturating_sub(self.began_utc_ms);
            if STEP_MS < set_by_ms.abs_diff(self.set_by_ms) {
                self.set_by_ms = set_by_ms;
            }
            return;
        }
        if self.began_utc_ms == 0 {
            self.began_utc_ms = now.utc_ms;
        }
        // A clock that was set back since does not make this time negative.
        let begun_utc_ms = self.began_utc_ms.saturating_add(self.set_by_ms);
        let since_ms = u64::try_from(now.utc_ms.saturating_sub(begun_utc_ms)).unwrap_or(0);
        let before = pace.wall(Duration::from_millis(since_ms)).saturating_sub(now.time.since_start());
        self.before_s = Some(before.as_secs_f64());
    }

    /// Another mission is begun now.
    pub fn begin(&mut self, now: Now) {
        let before_s = Some(-now.time.as_secs_f64());
        *self = MissionClock { began_utc_ms: now.utc_ms, set_by_ms: 0, before_s };
    }

    /// When the mission was begun, in milliseconds since the Unix epoch, by the wall clock as it was then.
    pub fn began_utc_ms(self) -> i64 {
        self.began_utc_ms
    }

    /// By how many milliseconds the wall clock was set since.
    pub fn set_by_ms(self) -> i64 {
        self.set_by_ms
    }

    /// The time since then at `time` of this process.
    pub fn mission_time(self, time: Time) -> Time {
        let before = Duration::from_secs_f64(self.before_s.unwrap_or_default().abs());
        let process = time.since_start();
        Time::after(match self.before_s.is_some_and(|it| it < 0.0) {
            true => process.saturating_sub(before),
            false => process.saturating_add(before),
        })
    }

    /// Seconds since then, of seconds since the start of this process.
    pub fn seconds(self, process_s: f64) -> f64 {
        self.before_s.unwrap_or_default() + process_s
    }

    /// The mission time that has passed since then.
    pub fn passed(self, now: Now) -> Duration {
        Duration::try_from_secs_f64(self.seconds(now.time.as_secs_f64())).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn now(s: u64, utc_ms: i64) -> Now {
        Now { time: Time::after(Duration::from_secs(s)), utc_ms }
    }

    /// A process that starts with `began` and is `s` seconds old at its first moment: the mission's seconds then and 5 s later.
    #[track_caller]
    fn check(began: i64, first: Now, speed: f64, expected: (f64, f64)) {
        let mut clock = MissionClock::resumed(began, 0);
        let pace = Pace::new(speed).unwrap();
        clock.pass(first, pace);
        // A step of the wall clock while it runs changes nothing.
        clock.pass(now(99, 1), pace);
        let first_s = first.time.as_secs_f64();
        assert_eq!((clock.seconds(first_s), clock.seconds(first_s + 5.0)), expected);
    }

    #[test]
    fn time_goes_on_over_a_restart_and_never_backwards_before_the_start() {
        check(0, now(0, 70_000), 1.0, (0.0, 5.0));
        check(0, now(2, 70_000), 1.0, (2.0, 7.0));
        check(70_000, now(0, 100_000), 1.0, (30.0, 35.0));
        check(70_000, now(3, 100_000), 1.0, (30.0, 35.0));
        check(70_000, now(0, 100_000), 10.0, (300.0, 305.0));
        check(70_000, now(0, 60_000), 1.0, (0.0, 5.0));
    }

    #[test]
    fn the_first_manager_of_a_mission_says_when_it_began() {
        let mut clock = MissionClock::default();
        clock.pass(now(1, 70_000), Pace::REAL_TIME);
        assert_eq!(clock.began_utc_ms(), 70_000);
    }

    #[test]
    fn a_clock_that_was_set_counts_for_no_process_after_this_one() {
        const NOON: i64 = 1_800_000_000_000;
        for step_ms in [-3_600_000, 0, 3_600_000] {
            let mut clock = MissionClock::resumed(NOON, 0);
            clock.pass(now(0, NOON + 30_000), Pace::REAL_TIME);
            clock.pass(now(10, NOON + 40_000 + step_ms), Pace::REAL_TIME);
            assert_eq!(clock.began_utc_ms(), NOON, "it is the same mission");
            let mut next = MissionClock::resumed(NOON, clock.set_by_ms());
            next.pass(now(0, NOON + 45_000 + step_ms), Pace::REAL_TIME);
            assert_eq!(next.seconds(0.0), 45.0, "after a step by {step_ms} ms");
        }
    }

    #[test]
    fn another_mission_begins_at_zero() {
        let mut clock = MissionClock::default();
        clock.pass(now(1, 70_000), Pace::REAL_TIME);
        clock.begin(now(400, 470_000));
        assert_eq!((clock.began_utc_ms(), clock.seconds(400.0), clock.seconds(410.0)), (470_000, 0.0, 10.0));
    }
}
