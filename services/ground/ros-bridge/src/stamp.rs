//! Times as ROS has them.

use std::time::{SystemTime, UNIX_EPOCH};

/// A time since the Unix epoch, UTC: `builtin_interfaces/msg/Time`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Stamp {
    /// Whole seconds.
    pub sec: i32,
    /// The rest.
    pub nanosec: u32,
}

impl Stamp {
    /// A time of the wall clock. One that ROS cannot write, before 1970 or after 2038, is the epoch.
    pub fn of(time: SystemTime) -> Stamp {
        let since = time.duration_since(UNIX_EPOCH).unwrap_or_default();
        i32::try_from(since.as_secs()).map_or(Stamp::default(), |sec| Stamp { sec, nanosec: since.subsec_nanos() })
    }

    /// A time as the gateway writes it, such as `2026-11-30T21:24:04.082Z`; the epoch if it is invalid.
    pub(crate) fn parse(utc: &str) -> Stamp {
        humantime::parse_rfc3339(utc).map_or(Stamp::default(), Stamp::of)
    }

    pub(crate) fn of_millis(utc_ms: i64) -> Stamp {
        let (sec, rest) = (utc_ms.div_euclid(1000), utc_ms.rem_euclid(1000));
        let nanosec = u32::try_from(rest * 1_000_000).unwrap_or_default();
        i32::try_from(sec).map_or(Stamp::default(), |sec| Stamp { sec, nanosec })
    }

    /// In nanoseconds.
    pub fn nanos(self) -> i64 {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }
}
