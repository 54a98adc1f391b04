//! Mission time: monotonic, counted from the start of the process, `speed` times as fast as the wall clock.
//!
//! Timers that belong to the mission (skill deadlines, permission answers, holds) are mission
//! durations without change. Limits of the machine (staleness, acknowledgements)
//! must not shrink with the speed factor below what a busy machine needs; see [`Pace::limit`].

use std::ops::{Add, Sub};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// A moment in mission time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Hash)]
pub struct Time(Duration);

impl Time {
    /// The start of the process.
    pub const ZERO: Time = Time(Duration::ZERO);

    /// The moment `since_start` after the start.
    pub const fn after(since_start: Duration) -> Time {
        Time(since_start)
    }

    /// Mission seconds since the start.
    pub fn as_secs_f64(self) -> f64 {
        self.0.as_secs_f64()
    }

    /// Mission time since the start.
    pub fn since_start(self) -> Duration {
        self.0
    }
}

impl Add<Duration> for Time {
    type Output = Time;
    fn add(self, rhs: Duration) -> Time {
        Time(self.0.saturating_add(rhs))
    }
}

/// How much later; zero if it is not later.
impl Sub for Time {
    type Output = Duration;
    fn sub(self, rhs: Time) -> Duration {
        self.0.saturating_sub(rhs.0)
    }
}

/// The longest flight that is believed. (ENG: 115 days, far beyond any flight, and small enough that sums do not overflow.)
pub const LONGEST_FLIGHT: Duration = Duration::from_secs(10_000_000);

/// The time that a core gets: mission time for every decision, UTC for time windows of areas and for
/// expiry dates that leave the process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Now {
    /// Mission time.
    pub time: Time,
    /// Milliseconds since the Unix epoch, UTC.
    pub utc_ms: i64,
}

/// The least wall time to which a limit of the machine shrinks, so that a pause of the scheduler does not count as a
/// failure at any speed factor. (Measured: 0.3 s on a machine with twice as many busy threads as cores.)
const FLOOR: Duration = Duration::from_secs(1);

/// How many times faster than the wall clock mission time runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    speed: f64,
}

impl Pace {
    /// Real time.
    pub const REAL_TIME: Pace = Pace { speed: 1.0 };

    /// Mission time `speed` times as fast as the wall clock; `None` unless 0.1 <= speed <= 100.
    pub fn new(speed: f64) -> Option<Pace> {
        (0.1..=100.0).contains(&speed).then_some(Pace { speed })
    }

    /// The factor.
    pub fn speed(self) -> f64 {
        self.speed
    }

    /// Wall time as mission time: for periods that keep to the wall clock (ticks, streams, heartbeats).
    pub fn wall(self, wall: Duration) -> Duration {
        wall.mul_f64(self.speed)
    }

    /// Mission time as wall time.
    pub fn to_wall(self, mission: Duration) -> Duration {
        mission.div_f64(self.speed)
    }

    /// A limit of the machine (an acknowledgement, a staleness) in mission time: `limit` itself,
    /// or more where that would be less than one second (or than `limit`) of wall time.
    pub fn limit(self, limit: Duration) -> Duration {
        limit.max(limit.min(FLOOR).mul_f64(self.speed))
    }
}

/// A moment of UTC, in milliseconds since the Unix epoch, as files and reports name it: `2026-01-01T00:00:45Z`. Parts of a second are
/// left out; what lies outside of the years 1970 to 9999 is the nearest moment in them.
pub fn utc_text(utc_ms: i64) -> String {
    humantime::format_rfc3339_seconds(printable(utc_ms)).to_string()
}

/// The same with its milliseconds: `2026-01-01T00:00:45.678Z`.
pub fn utc_text_with_millis(utc_ms: i64) -> String {
    humantime::format_rfc3339_millis(printable(utc_ms)).to_string()
}

fn printable(utc_ms: i64) -> SystemTime {
    /// The end of the year 9999.
    const LAST_MS: u64 = 253_402_300_799_999;
    UNIX_EPOCH + Duration::from_millis((utc_ms.max(0) as u64).min(LAST_MS))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_is_named_as_in_files() {
        assert_eq!(utc_text(1_767_225_645_999), "2026-01-01T00:00:45Z");
        assert_eq!(utc_text(-1), "1970-01-01T00:00:00Z");
        assert_eq!(utc_text(i64::MAX), "9999-12-31T23:59:59Z");
        assert_eq!(utc_text_with_millis(1_767_225_645_678), "2026-01-01T00:00:45.678Z");
        assert_eq!(utc_text_with_millis(i64::MAX), "9999-12-31T23:59:59.999Z");
    }

    #[test]
    fn a_limit_keeps_its_wall_clock_floor() {
        #[track_caller]
        fn check(speed: f64, limit_ms: u64, expected_wall_ms: u64) {
            let pace = Pace::new(speed).unwrap();
            let wall = pace.to_wall(pace.limit(Duration::from_millis(limit_ms)));
            assert_eq!(wall.as_millis() as u64, expected_wall_ms);
        }
        check(1.0, 1000, 1000);
        check(2.0, 1000, 1000);
        check(2.0, 3000, 1500);
        check(20.0, 1000, 1000);
        check(20.0, 100, 100);
        check(20.0, 60_000, 3000);
    }

    #[test]
    fn an_earlier_moment_is_no_time_ago() {
        assert_eq!(Time::ZERO - Time::after(Duration::from_secs(1)), Duration::ZERO);
    }
}
