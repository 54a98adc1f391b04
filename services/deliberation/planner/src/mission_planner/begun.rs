//! Since when the mission is flown: since its first plan.
//!
//! While a process runs, its monotonic clock counts, so that a step of the wall clock moves no deadline. What passed before its start
//! is the difference in UTC, which is persisted: the beginning as the wall clock tells it now, so that a step counts for no process
//! after this one either.

use std::time::Duration;

use domain::time::{Now, Pace, Time};

/// A wall clock that differs by more from the monotonic one has stepped; less is not worth a write to the disk. (ENG)
const STEP_MS: u64 = 1000;

/// The beginning of a mission.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Begun {
    /// In milliseconds since the Unix epoch, by the wall clock as it is now.
    utc_ms: i64,
    /// A moment of this process, and the mission time that had passed by then; `None` before the first moment.
    counted: Option<(Time, Duration)>,
}

impl Begun {
    /// It begins.
    pub(crate) fn at(now: Now) -> Begun {
        Begun { utc_ms: now.utc_ms, counted: Some((now.time, Duration::ZERO)) }
    }

    /// Another process has begun it then.
    pub(crate) fn before(utc_ms: i64) -> Begun {
        Begun { utc_ms, counted: None }
    }

    /// In milliseconds since the Unix epoch.
    pub(crate) fn utc_ms(self) -> i64 {
        self.utc_ms
    }

    /// Notices the process's first moment, and a step of the wall clock.
    pub(crate) fn pass(&mut self, now: Now, pace: Pace) {
        self.counted.get_or_insert((now.time, passed_by_utc(self.utc_ms, now, pace)));
        let passed_ms = i64::try_from(pace.to_wall(self.passed(now, pace)).as_millis()).unwrap_or(i64::MAX);
        let utc_ms = now.utc_ms.saturating_sub(passed_ms);
        if STEP_MS < utc_ms.abs_diff(self.utc_ms) {
            self.utc_ms = utc_ms;
        }
    }

    /// The mission time that has passed since.
    pub(crate) fn passed(self, now: Now, pace: Pace) -> Duration {
        match self.counted {
            Some((at, passed)) => passed.saturating_add(now.time - at),
            None => passed_by_utc(self.utc_ms, now, pace),
        }
    }
}

/// A machine whose clock was set back since tells no negative time.
fn passed_by_utc(begun_utc_ms: i64, now: Now, pace: Pace) -> Duration {
    pace.wall(Duration::from_millis(u64::try_from(now.utc_ms.saturating_sub(begun_utc_ms)).unwrap_or(0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn now(s: u64, utc_s: i64) -> Now {
        Now { time: Time::after(Duration::from_secs(s)), utc_ms: utc_s * 1000 }
    }

    #[test]
    fn only_what_passed_before_the_process_is_told_by_the_wall_clock() {
        #[track_caller]
        fn check(mut begun: Begun, first: Now, later: Now, speed: f64, expected_s: [u64; 2]) {
            let pace = Pace::new(speed).unwrap();
            begun.pass(first, pace);
            assert_eq!([first, later].map(|it| begun.passed(it, pace).as_secs()), expected_s);
        }
        // The clock steps on and back.
        check(Begun::at(now(5, 1000)), now(5, 1000), now(15, 4610), 1.0, [0, 10]);
        check(Begun::at(now(5, 1000)), now(5, 1000), now(15, 0), 1.0, [0, 10]);
        check(Begun::before(1_000_000), now(0, 1030), now(10, 0), 1.0, [30, 40]);
        check(Begun::before(1_000_000), now(3, 1030), now(13, 9000), 1.0, [30, 40]);
        check(Begun::before(1_000_000), now(0, 1030), now(10, 1031), 10.0, [300, 310]);
        check(Begun::before(1_000_000), now(0, 900), now(10, 900), 1.0, [0, 10]);
    }

    #[test]
    fn a_process_after_a_step_of_the_wall_clock_counts_on() {
        /// The clock stands at this UTC after 30 s of mission time, and the next process starts at once.
        #[track_caller]
        fn check(utc_s: i64, speed: f64, expected_utc_ms: i64) {
            let pace = Pace::new(speed).unwrap();
            let mut begun = Begun::at(now(5, 1000));
            begun.pass(now(35, utc_s), pace);
            assert_eq!(begun.utc_ms(), expected_utc_ms, "{utc_s}");
            let mut after = Begun::before(begun.utc_ms());
            after.pass(now(0, utc_s), pace);
            let passed = after.passed(now(10, utc_s), pace);
            assert!(passed.abs_diff(Duration::from_secs(40)) <= Duration::from_secs(1), "{passed:?}");
        }
        check(4630, 1.0, 4_600_000);
        check(0, 1.0, -30_000);
        check(4603, 10.0, 4_600_000);
        // What the clocks differ by in any case is not written down each time.
        check(1030, 1.0, 1_000_000);
        check(1031, 1.0, 1_000_000);
    }
}
