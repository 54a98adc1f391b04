//! A thread that writes, so that nobody else waits for a reader.

use std::io::Write;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::sync_channel;
use std::time::Duration;

use regular_file::DiskThread;

/// Lines that wait for a reader; more are dropped, and counted.
const WAITING: usize = 1024;

/// Something that is written.
pub(super) type Job = Box<dyn FnOnce() + Send>;

/// The thread; it ends with the process.
pub(super) struct Background {
    thread: DiskThread<Job>,
    dropped: AtomicU64,
}

impl Background {
    /// # Errors
    /// If the operating system gives no thread.
    pub(super) fn start() -> std::io::Result<Background> {
        let thread = DiskThread::start("output", WAITING, Duration::ZERO, |jobs| {
            jobs.into_iter().for_each(|write: Job| write());
        })?;
        Ok(Background { thread, dropped: AtomicU64::new(0) })
    }

    /// Has it written, or drops it if too much waits. It waits for nothing.
    pub(super) fn put(&self, job: Job) {
        let dropped = self.dropped.swap(0, Ordering::Relaxed);
        let job: Job = match dropped {
            0 => job,
            _ => Box::new(move || {
                let _ = writeln!(std::io::stderr(), "{dropped} lines were dropped: nobody read them");
                job();
            }),
        };
        if self.thread.hand_over(job).is_err() {
            self.dropped.fetch_add(dropped + 1, Ordering::Relaxed);
        }
    }

    /// Waits until everything before has been written, no longer than `limit`.
    pub(super) fn finish(&self, limit: Duration) {
        let (written, wait) = sync_channel(1);
        // With no room for this there is nobody to wait for.
        let tell = move || {
            let _ = written.send(());
        };
        if self.thread.hand_over(Box::new(tell)).is_ok() {
            let _ = wait.recv_timeout(limit);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_speaks_waits_for_no_reader_and_what_is_read_later_is_in_order() {
        let background = Background::start().unwrap();
        let (read, reader) = sync_channel(1);
        let (said, heard) = sync_channel(2 * WAITING);
        // The reader stalls, and has begun to: else it would make room for one more later.
        let (stalls, stalled) = sync_channel(1);
        background.put(Box::new(move || {
            stalls.send(()).unwrap();
            reader.recv().unwrap();
        }));
        stalled.recv().unwrap();
        for number in 0..2 * WAITING {
            let said = said.clone();
            background.put(Box::new(move || said.send(number).unwrap()));
        }
        background.finish(Duration::ZERO);
        assert!(heard.try_recv().is_err(), "nothing is written yet");
        assert!(WAITING as u64 - 1 <= background.dropped.load(Ordering::Relaxed), "more than there is room for");
        read.send(()).unwrap();
        let written: Vec<usize> = heard.iter().take(WAITING - 1).collect();
        assert_eq!(written, (0..WAITING - 1).collect::<Vec<_>>());
    }

    #[test]
    fn who_ends_waits_for_the_last_line() {
        let background = Background::start().unwrap();
        let (said, heard) = sync_channel(1);
        background.put(Box::new(move || said.send("the end").unwrap()));
        background.finish(Duration::from_secs(60));
        assert_eq!(heard.try_recv(), Ok("the end"));
    }
}
