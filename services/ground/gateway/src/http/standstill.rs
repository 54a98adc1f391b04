//! Whether this process stood still, as one that is stopped by a signal or whose machine sleeps does, so that an order may
//! have waited in a socket meanwhile.
//!
//! Its client has given up by then, and perhaps ordered something else: an order that is carried out so late is one that
//! nobody expects. How long a request waited cannot be seen from the request. What can be seen is that a clock that should
//! tick all the time did not.

use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use nix::time::{ClockId, clock_gettime};

/// How often the clock ticks.
pub(crate) const TICK: Duration = Duration::from_millis(100);
/// What a busy machine may delay a tick, and the longest time in which what waited is read afterwards. (ENG: on two cores with six systems and
/// eight busy loops a process waits for a second now and then; `kittiwake vehicle` waits five seconds for an answer.)
const TOLERANCE: Duration = Duration::from_secs(2);

/// The times at which this process did not run, counted from the start of the machine. Without a tick it knows of none.
#[derive(Debug, Default)]
struct Gaps {
    last_tick: Option<Duration>,
    newest: Option<Gap>,
}

/// A time between two ticks that is longer than it may be.
#[derive(Debug, Clone, Copy)]
struct Gap {
    end: Duration,
    length: Duration,
}

impl Gaps {
    /// The process runs.
    fn tick(&mut self, now: Duration) {
        self.newest = self.under_way(now).or(self.newest);
        self.last_tick = Some(now);
    }

    /// How long the process stood still, if a request that was begun at `begun` and is read whole now may have waited meanwhile.
    fn may_have_waited(&self, begun: Duration, now: Duration) -> Option<Duration> {
        let ended_late = |gap: &Gap| begun < gap.end + TOLERANCE;
        self.under_way(now).or(self.newest.filter(ended_late)).map(|it| it.length)
    }

    /// The gap that ends with the tick that is due: what waited may be read before the clock ticks again.
    fn under_way(&self, now: Duration) -> Option<Gap> {
        let length = now.saturating_sub(self.last_tick?);
        (TOLERANCE < length).then_some(Gap { end: now, length })
    }
}

/// The gaps, shared by the clock and every request.
#[derive(Debug, Clone, Default)]
pub(crate) struct Standstill(Arc<Mutex<Gaps>>);

impl Standstill {
    /// The process runs.
    pub(crate) fn tick(&self, now: Duration) {
        self.lock().tick(now);
    }

    /// How long the process stood still, if a request that was begun at `begun` and is read whole now may have waited meanwhile.
    pub(crate) fn may_have_waited(&self, begun: Duration, now: Duration) -> Option<Duration> {
        self.lock().may_have_waited(begun, now)
    }

    /// The data are whole even if a thread panicked while it held the lock.
    fn lock(&self) -> MutexGuard<'_, Gaps> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

/// The time since the machine was started. Unlike that of an `Instant` it goes on while the machine sleeps.
pub(crate) fn since_boot() -> Duration {
    // Linux has this clock.
    clock_gettime(ClockId::CLOCK_BOOTTIME).map(Duration::from).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ticks at these milliseconds; of a request that was begun and is read then, the milliseconds of standing still for
    /// which it is refused.
    #[track_caller]
    fn check(ticks: &[u64], begun: u64, read: u64, expected: Option<u64>) {
        let at = Duration::from_millis;
        let mut gaps = Gaps::default();
        ticks.iter().for_each(|ms| gaps.tick(at(*ms)));
        assert_eq!(gaps.may_have_waited(at(begun), at(read)), expected.map(Duration::from_millis));
    }

    #[test]
    fn an_order_that_may_have_waited_is_known_by_the_gap_before_it() {
        // Nobody ticks, or all is well; a busy machine is late.
        check(&[], 0, 18_000, None);
        check(&[0], 1000, 2000, None);
        check(&[0, 200, 400], 500, 500, None);
        check(&[0, 2000, 4000], 5000, 5000, None);
        // Read before the clock has ticked again.
        check(&[0], 2002, 2002, Some(2002));
        check(&[0, 200], 6600, 6600, Some(6400));
        // Read after it, which takes some time where many waited.
        check(&[0, 6400], 6402, 6402, Some(6400));
        check(&[0, 6400, 6600, 8200], 8398, 8398, Some(6400));
        check(&[0, 6400, 6600, 8200, 8400], 8400, 8400, None);
        // Begun before the gap or soon after, and read whole long after it.
        check(&[0, 6400, 8000, 10_000, 12_000], 0, 12_000, Some(6400));
        check(&[0, 6400, 8000, 10_000, 12_000], 8200, 12_000, Some(6400));
        check(&[0, 6400, 8000, 10_000, 12_000], 8400, 12_000, None);
        // Of several gaps the newest is said, whichever was longer.
        check(&[0, 40_000, 43_000], 43_200, 43_200, Some(3000));
        check(&[0, 40_000, 43_000], 48_000, 48_000, Some(5000));
    }
}
