//! A thread that writes, so that nobody else waits for a disk or for a reader.

use std::fmt;
use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// The thread. Handing a job over never waits; the end does, for a limited time.
pub struct DiskThread<J> {
    /// Absent once it takes no more jobs.
    jobs: Option<SyncSender<J>>,
    /// Disconnected once the thread has ended, also by a panic.
    running: Mutex<Receiver<()>>,
    end_limit: Duration,
}

/// Why a job was not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NotTaken {
    /// As many jobs as there is room for wait already.
    Full,
    /// The thread has ended, or takes no more.
    Ended,
}

impl<J: Send + 'static> DiskThread<J> {
    /// Starts a thread of this name, which does `work` with the jobs; at most `room` of them wait. A disk that hangs delays the end of the
    /// value by no more than `end_limit`, and ends with the process.
    ///
    /// # Errors
    /// If the operating system gives no thread.
    pub fn start(
        name: &str,
        room: usize,
        end_limit: Duration,
        work: impl FnOnce(Receiver<J>) + Send + 'static,
    ) -> io::Result<DiskThread<J>> {
        let (jobs, waiting) = sync_channel(room);
        let (alive, running) = sync_channel(0);
        std::thread::Builder::new().name(name.into()).spawn(move || {
            let _alive: SyncSender<()> = alive;
            work(waiting);
        })?;
        Ok(DiskThread { jobs: Some(jobs), running: Mutex::new(running), end_limit })
    }

    /// Hands a job over.
    ///
    /// # Errors
    /// If it is not taken; it is dropped.
    pub fn hand_over(&self, job: J) -> Result<(), NotTaken> {
        let jobs = self.jobs.as_ref().ok_or(NotTaken::Ended)?;
        jobs.try_send(job).map_err(|refused| match refused {
            TrySendError::Full(_) => NotTaken::Full,
            TrySendError::Disconnected(_) => NotTaken::Ended,
        })
    }
}

impl<J> DiskThread<J> {
    /// Takes no more jobs. Those that wait are still done.
    pub fn close(&mut self) {
        self.jobs = None;
    }

    /// Takes no more jobs, waits for the others no longer than `limit`, and returns whether they are done. The end of the value does not wait
    /// again.
    pub fn end_within(&mut self, limit: Duration) -> bool {
        self.close();
        self.end_limit = Duration::ZERO;
        let running = self.running.get_mut().unwrap_or_else(PoisonError::into_inner);
        running.recv_timeout(limit) == Err(RecvTimeoutError::Disconnected)
    }
}

impl<J> Drop for DiskThread<J> {
    fn drop(&mut self) {
        self.end_within(self.end_limit);
    }
}

impl<J> fmt::Debug for DiskThread<J> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DiskThread").field("end_limit", &self.end_limit).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Far longer than any machine takes, and not waited for.
    const LONG: Duration = Duration::from_secs(600);

    #[test]
    fn jobs_are_done_in_order_and_the_end_waits_for_them() {
        let (done, seen) = sync_channel(4);
        let work = move |jobs: Receiver<u32>| jobs.into_iter().for_each(|job| done.send(job).unwrap());
        let mut thread = DiskThread::start("test", 4, Duration::ZERO, work).unwrap();
        for job in 0..3 {
            thread.hand_over(job).unwrap();
        }
        assert!(thread.end_within(LONG));
        assert_eq!(seen.iter().collect::<Vec<_>>(), [0, 1, 2]);
        assert_eq!(thread.hand_over(3), Err(NotTaken::Ended));
    }

    #[test]
    fn a_disk_that_hangs_holds_up_neither_a_job_nor_the_end() {
        let (_disk, answers) = sync_channel::<()>(0);
        let work = move |jobs: Receiver<u32>| {
            let _ = answers.recv();
            jobs.into_iter().for_each(drop);
        };
        let mut thread = DiskThread::start("test", 2, Duration::ZERO, work).unwrap();
        assert_eq!([0, 1, 2].map(|job| thread.hand_over(job)), [Ok(()), Ok(()), Err(NotTaken::Full)]);
        assert!(!thread.end_within(Duration::ZERO));
    }

    #[test]
    fn a_thread_that_has_panicked_takes_nothing_and_keeps_nobody_waiting() {
        let work = |jobs: Receiver<u32>| {
            let _ = jobs.recv();
            drop(jobs);
            panic!("as a defect would");
        };
        let mut thread = DiskThread::start("test", 2, LONG, work).unwrap();
        thread.hand_over(0).unwrap();
        while thread.hand_over(1) != Err(NotTaken::Ended) {
            std::thread::yield_now();
        }
        assert!(thread.end_within(LONG));
    }
}
