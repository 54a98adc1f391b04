//! Whether the autopilot sees the target that it lands on. It tells where that is as long as it does.

use std::time::Duration;

use domain::time::Time;

/// A target whose place the autopilot has not said for this long is not seen. (ENG: sensors see it ten times a second, and a link may lose some.)
const LOST_AFTER: Duration = Duration::from_secs(1);

/// Whether it is seen `now`; `told`: when the autopilot last said where it is.
pub fn is_seen(told: Option<Time>, now: Time) -> bool {
    told.is_some_and(|at| now - at <= LOST_AFTER)
}
