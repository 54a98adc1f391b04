//! A fixed rate that does not drift.

use std::time::Duration;

use domain::time::Time;

/// Moments one period apart.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Schedule {
    period: Duration,
    next: Time,
}

impl Schedule {
    /// The first moment is time zero.
    pub(crate) fn every(period: Duration) -> Schedule {
        Schedule { period, next: Time::ZERO }
    }

    /// The next moment.
    pub(crate) fn next(&self) -> Time {
        self.next
    }

    /// Whether the next moment has come; if so, advances to the one after it. Moments that were
    /// missed are skipped, since nobody needs the same state twice.
    pub(crate) fn is_due(&mut self, now: Time) -> bool {
        if now < self.next {
            return false;
        }
        let since_moment_ns = (now - self.next).as_nanos() % self.period.as_nanos();
        let until_next = self.period - Duration::from_nanos(since_moment_ns as u64);
        self.next = now + until_next;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_keeps_its_rate_and_never_bursts() {
        let mut schedule = Schedule::every(Duration::from_millis(10));
        #[track_caller]
        fn check(schedule: &mut Schedule, at_ms: u64, expected: bool, next_ms: u64) {
            let time = |ms| Time::after(Duration::from_millis(ms));
            assert_eq!(schedule.is_due(time(at_ms)), expected);
            assert_eq!(schedule.next(), time(next_ms));
        }
        check(&mut schedule, 0, true, 10);
        check(&mut schedule, 9, false, 10);
        check(&mut schedule, 13, true, 20);
        check(&mut schedule, 20, true, 30);
        check(&mut schedule, 57, true, 60);
        check(&mut schedule, 57, false, 60);
    }
}
