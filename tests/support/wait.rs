//! Waiting for a condition.

use std::fmt::Display;
use std::time::{Duration, Instant};

/// Waits until `find` finds something: asks for the state again and again, so that nothing is missed.
#[track_caller]
pub fn wait_within<T>(
    limit: Duration,
    pause: Duration,
    what: &(impl Display + ?Sized),
    mut find: impl FnMut() -> Option<T>,
) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = find() {
            return found;
        }
        assert!(start.elapsed() < limit, "waited {limit:?} in vain for {what}");
        std::thread::sleep(pause);
    }
}
