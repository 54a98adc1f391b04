//! Steps of the machine's wall clock.
//!
//! Mission time is monotonic, so that a step changes nothing that flies; windows of areas and expiry dates go by the wall clock, and
//! after a step they are not where they were.

use std::time::Duration;

use domain::time::{Now, Pace, Time};

use crate::recent::Greatest;

/// The greatest step of this and of the window before it counts.
const WINDOW: Duration = Duration::from_secs(30);

/// Compares the wall clock with mission time.
#[derive(Debug, Clone)]
pub(crate) struct Clock {
    last: Option<Now>,
    /// In seconds.
    steps: Greatest,
}

impl Default for Clock {
    /// Neither clock was read yet.
    fn default() -> Clock {
        Clock { last: None, steps: Greatest::within(WINDOW) }
    }
}

impl Clock {
    /// Both clocks were read.
    pub(crate) fn read(&mut self, now: Now, pace: Pace) {
        if let Some(last) = self.last.replace(now) {
            let passed_s = pace.to_wall(now.time - last.time).as_secs_f64();
            let shown_s = now.utc_ms.saturating_sub(last.utc_ms) as f64 / 1000.0;
            self.steps.see(now.time, (shown_s - passed_s).abs());
        }
    }

    /// The greatest recent step, in seconds.
    pub(crate) fn step_s(&self, now: Time) -> f64 {
        self.steps.at(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_shows_for_a_while_either_way_at_any_speed() {
        /// Reads the clocks every half second of mission time; after ten seconds the wall clock steps.
        #[track_caller]
        fn check(speed: f64, step_ms: i64, until_s: f64, expected_s: f64) {
            let (mut clock, pace) = (Clock::default(), Pace::new(speed).unwrap());
            for half in 0..(until_s * 2.0) as u32 {
                let time = Time::after(Duration::from_millis(500) * half);
                let wall_ms = pace.to_wall(time.since_start()).as_millis() as i64;
                let stepped_ms = if half < 20 { 0 } else { step_ms };
                clock.read(Now { time, utc_ms: 1_700_000_000_000 + wall_ms + stepped_ms }, pace);
            }
            let found_s = clock.step_s(Time::after(Duration::from_secs_f64(until_s)));
            assert!((found_s - expected_s).abs() < 0.002, "{found_s}");
        }
        check(1.0, 0, 20.0, 0.0);
        check(1.0, 3_600_000, 9.5, 0.0);
        check(1.0, 3_600_000, 20.0, 3600.0);
        check(1.0, -2_500, 20.0, 2.5);
        check(20.0, -2_500, 20.0, 2.5);
        check(1.0, -2_500, 45.0, 2.5);
        check(1.0, -2_500, 120.0, 0.0);
    }

    #[test]
    fn a_process_that_pauses_sees_no_step() {
        let mut clock = Clock::default();
        for s in [0, 1, 500] {
            clock.read(Now { time: Time::after(Duration::from_secs(s)), utc_ms: 1000 * s as i64 }, Pace::REAL_TIME);
        }
        assert_eq!(clock.step_s(Time::after(Duration::from_secs(500))), 0.0);
    }
}
