//! Whether the autopilot sees the target that it lands on. It tells where that is as long as it does.

use std::time::Duration;

use domain::time::Time;

/// One that was not told of for this long is not seen. (ENG: sensors see it ten times a second, and a link may lose some.)
const LOST_AFTER: Duration = Duration::from_secs(1);

/// Whether it is seen, if it was told of then.
pub fn is_seen(told: Option<Time>, now: Time) -> bool {
    told.is_some_and(|at| now - at <= LOST_AFTER)
}
