//! Ids that are not repeated after a restart of the process.

use domain::time::Now;

/// A sequence of ids. The first one counts from the date: a process that was restarted does not use
/// the ids of its predecessor again, and does not take late answers to it for its own.
#[derive(Debug, Default)]
pub(crate) struct IdSequence {
    last: u64,
}

impl IdSequence {
    /// The next id; never 0.
    pub(crate) fn next(&mut self, now: Now) -> u64 {
        if self.last == 0 {
            self.last = u64::try_from(now.utc_ms).unwrap_or(0);
        }
        self.last += 1;
        self.last
    }
}
