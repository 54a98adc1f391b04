//! When this process did not run, because it was stopped or its machine slept: messages nobody listened to are not a
//! silence.
//!
//! When it goes on, what was said meanwhile may still be under way, and every source looks silent for all that time.

use std::collections::VecDeque;
use std::time::Duration;

use domain::time::{Pace, Time};

/// It runs a hundred times a second; a gap that is longer, in wall time, is not a delay of a busy machine. (ENG)
const AWAY_AFTER: Duration = Duration::from_secs(1);
/// As many as are remembered. (ENG)
const MOST: usize = 64;

/// The recent times for which it was away.
#[derive(Debug, Clone, Default)]
pub(crate) struct Away {
    ran_at: Option<Time>,
    /// When each ended, and how long it was.
    times: VecDeque<(Time, Duration)>,
}

impl Away {
    /// It runs.
    pub(crate) fn runs(&mut self, now: Time, pace: Pace) {
        let gap = self.ran_at.replace(now).map_or(Duration::ZERO, |before| now - before);
        if pace.wall(AWAY_AFTER) < gap {
            self.times.truncate(MOST - 1);
            self.times.push_front((now, gap));
        }
    }

    /// For how long it was away at a time since then. Only the longest counts: a machine that never lets it run for long would otherwise
    /// hide the silence of a source for good.
    pub(crate) fn longest_since(&self, time: Time) -> Duration {
        self.times.iter().take_while(|(end, _)| time < *end).map(|(_, gap)| *gap).max().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For how many seconds it was away at a time since `since`, if it runs at these seconds.
    #[track_caller]
    fn check(runs_at_s: &[u64], since_s: u64, expected_s: u64) {
        let at = |s: u64| Time::after(Duration::from_secs(s));
        let mut away = Away::default();
        runs_at_s.iter().for_each(|s| away.runs(at(*s), Pace::REAL_TIME));
        assert_eq!(away.longest_since(at(since_s)), Duration::from_secs(expected_s), "{runs_at_s:?} since {since_s}");
    }

    #[test]
    fn the_longest_gap_counts_that_ends_after_a_time() {
        check(&[], 0, 0);
        check(&[5], 0, 0);
        check(&[5, 6, 7], 5, 0);
        check(&[5, 6, 24, 25], 6, 18);
        check(&[5, 6, 24, 25], 24, 0);
        check(&[5, 6, 24, 25, 30], 6, 18);
        // A machine with far too much to do.
        check(&[5, 7, 9, 11, 13, 15], 5, 2);
        check(&[5, 6, 24, 25, 30], 25, 5);
    }
}
