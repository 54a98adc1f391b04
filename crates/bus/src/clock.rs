//! The time that nodes get, and the stamps on what they send.
//!
//! No node reads a clock. The rest of this crate reads the monotonic clock itself where it waits: for mail, for answers,
//! for a router. The dates of certificates and the time windows of HTTP are read where they are checked.

#![expect(clippy::disallowed_methods, reason = "the clock that every node gets its time from")]

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use domain::time::{Now, Pace, Time};
use nix::time::{ClockId, clock_gettime};

/// The machine's monotonic clock in nanoseconds: the same for every process on it, so that stamps of
/// different processes can be compared.
pub fn monotonic_ns() -> u64 {
    // Every Linux has this clock; a zero would show in the first measurement.
    let Ok(now) = clock_gettime(ClockId::CLOCK_MONOTONIC) else { return 0 };
    Duration::from(now).as_nanos() as u64
}

/// A process's clock: monotonic, counted from its creation, scaled by the speed factor.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    start: Instant,
    pace: Pace,
}

impl Clock {
    /// Starts at zero.
    pub fn start(pace: Pace) -> Clock {
        Clock { start: Instant::now(), pace }
    }

    /// The present moment.
    pub fn now(&self) -> Now {
        let utc = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Now { time: Time::after(self.pace.wall(self.start.elapsed())), utc_ms: utc.as_millis() as i64 }
    }

    /// When `time` comes, as a moment of the monotonic clock.
    pub(crate) fn instant_of(&self, time: Time) -> Instant {
        self.start + self.pace.to_wall(time.since_start())
    }

    /// Wall time since the start.
    pub fn uptime(&self) -> Duration {
        self.start.elapsed()
    }

    /// Mission time as wall time.
    pub fn to_wall(&self, mission: Duration) -> Duration {
        self.pace.to_wall(mission)
    }
}
