//! When a tree wants to be ticked next.

use std::time::Duration;

/// When a tree wants to be ticked next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NextTick {
    /// At once: a node asked for it.
    AtOnce,
    /// At this time, or earlier when the waker is called.
    At(Duration),
    /// When the waker is called, or something changes that the leaves read.
    WhenWoken,
}

/// What the nodes asked for during the latest tick.
pub(crate) struct Schedule {
    again: bool,
    deadline: u64,
}

/// No node has asked for a time.
const NEVER: u64 = u64::MAX;

impl Schedule {
    pub(crate) const EMPTY: Schedule = Schedule { again: false, deadline: NEVER };

    #[inline]
    pub(crate) fn tick_again(&mut self) {
        self.again = true;
    }

    /// Asks for a tick at `time`, in nanoseconds. The earliest time counts.
    #[inline]
    pub(crate) fn tick_at(&mut self, time: u64) {
        self.deadline = self.deadline.min(time);
    }

    pub(crate) fn wants_tick_again(&self) -> bool {
        self.again
    }

    pub(crate) fn next_tick(&self) -> NextTick {
        match (self.again, self.deadline) {
            (true, _) => NextTick::AtOnce,
            (false, NEVER) => NextTick::WhenWoken,
            (false, deadline) => NextTick::At(Duration::from_nanos(deadline)),
        }
    }
}

/// A time in nanoseconds. A time that does not fit, after 584 years, becomes the largest number.
pub(crate) fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}
