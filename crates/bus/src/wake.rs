//! What a loop sleeps on, and what ends its sleep: mail for one of its nodes, a socket that can be read, a time that has come, or the end.

#![expect(clippy::disallowed_methods, reason = "the loop waits here, up to a deadline on the wall clock")]

use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::SeqCst};
use std::time::Instant;

use rustix::event::{EventfdFlags, PollFd, PollFlags, Timespec, eventfd, poll};

use crate::BusError;

/// One for each loop; the mailboxes of its nodes share it.
#[derive(Clone)]
pub(crate) struct Wake(Arc<Shared>);

struct Shared {
    /// Readable once the loop that sleeps is to wake: it also waits for sockets, for which there is no condition variable.
    event: OwnedFd,
    /// The loop waits, and nobody has woken it yet.
    asleep: AtomicBool,
    stopped: AtomicBool,
}

impl Wake {
    /// Of a loop that is awake.
    ///
    /// # Errors
    /// If the operating system has no event counter left.
    pub(crate) fn new() -> Result<Wake, BusError> {
        let event = eventfd(0, EventfdFlags::NONBLOCK | EventfdFlags::CLOEXEC);
        let event = event.map_err(|cause| BusError::NoWake { cause: cause.to_string() })?;
        Ok(Wake(Arc::new(Shared { event, asleep: AtomicBool::new(false), stopped: AtomicBool::new(false) })))
    }

    /// Ends the present [`Wake::wait`]. Called after there is something to do: a loop that is about to sleep looks for that once more, and
    /// one that is awake looks by itself.
    pub(crate) fn wake(&self) {
        if self.0.asleep.swap(false, SeqCst) {
            let _ = rustix::io::write(&self.0.event, &1_u64.to_ne_bytes());
        }
    }

    /// Ends every [`Wake::wait`] for good.
    pub(crate) fn stop(&self) {
        self.0.stopped.store(true, SeqCst);
        self.wake();
    }

    /// Whether the loop is to end.
    pub(crate) fn is_stopped(&self) -> bool {
        self.0.stopped.load(SeqCst)
    }

    /// Waits for [`Wake::wake`], for something to read from one of `others`, or for the moment at which there is something to do by `next`.
    pub(crate) fn wait<'a>(&self, next: impl FnOnce() -> Instant, others: impl Iterator<Item = BorrowedFd<'a>>) {
        self.0.asleep.store(true, SeqCst);
        // Only now: who leaves work from here on wakes the loop.
        let left = next().saturating_duration_since(Instant::now());
        if self.is_stopped() || left.is_zero() {
            self.0.asleep.store(false, SeqCst);
            return;
        }
        let event = PollFd::from_borrowed_fd(self.0.event.as_fd(), PollFlags::IN);
        let others = others.map(|it| PollFd::from_borrowed_fd(it, PollFlags::IN));
        let mut all: Vec<_> = std::iter::once(event).chain(others).collect();
        // Whatever ends it, also a signal: the loop looks at everything.
        let _ = poll(&mut all, Timespec::try_from(left).ok().as_ref());
        let woken = all[0].revents().contains(PollFlags::IN);
        self.0.asleep.store(false, SeqCst);
        if woken {
            let _ = rustix::io::read(&self.0.event, &mut [0; 8]);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::iter::empty;
    use std::time::Duration;

    use super::*;

    fn far() -> Instant {
        Instant::now() + Duration::from_secs(3600)
    }

    #[test]
    fn work_that_is_there_is_not_slept_on() {
        let wake = Wake::new().unwrap();
        wake.wait(Instant::now, empty());
    }

    #[test]
    fn stopping_ends_the_sleep_and_every_later_one() {
        let wake = Wake::new().unwrap();
        let sleeper = wake.clone();
        let sleeping = std::thread::spawn(move || sleeper.wait(far, empty()));
        wake.stop();
        sleeping.join().unwrap();
        wake.wait(far, empty());
        assert!(wake.is_stopped());
    }

    #[test]
    fn work_that_comes_while_the_loop_falls_asleep_wakes_it() {
        let (wake, work) = (Wake::new().unwrap(), Arc::new(AtomicBool::new(false)));
        let looked = || {
            // It comes right after the loop has looked.
            let found = work.swap(true, SeqCst);
            wake.wake();
            if found { Instant::now() } else { far() }
        };
        wake.wait(looked, empty());
        assert!(work.load(SeqCst));
    }
}
