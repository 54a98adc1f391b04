//! The state of the writer, for the node's loop, `/healthz`, `/metrics` and the list.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, MutexGuard};

/// Bytes that may wait to be written: minutes of a vehicle's messages. More are dropped.
const MAX_WAITING: usize = 8 * 1024 * 1024;

/// Shared by the node's loop, the writer's thread and HTTP.
#[derive(Debug, Default)]
pub(crate) struct WriterStatus {
    waiting: AtomicUsize,
    dropped: AtomicU64,
    problem: Mutex<Option<String>>,
}

impl WriterStatus {
    /// Whether there is room for these bytes, which then count as waiting.
    pub(crate) fn admit(&self, bytes: usize) -> bool {
        let add = |waiting: usize| (waiting + bytes <= MAX_WAITING).then_some(waiting + bytes);
        self.waiting.fetch_update(Relaxed, Relaxed, add).is_ok()
    }

    /// These bytes do not wait any more.
    pub(crate) fn taken(&self, bytes: usize) {
        self.waiting.fetch_sub(bytes, Relaxed);
    }

    /// Counts a message that could not be recorded.
    pub(crate) fn count_dropped(&self) {
        self.dropped.fetch_add(1, Relaxed);
    }

    /// Messages that could not be recorded.
    pub(crate) fn dropped(&self) -> u64 {
        self.dropped.load(Relaxed)
    }

    /// Bytes that wait to be written.
    pub(crate) fn waiting(&self) -> usize {
        self.waiting.load(Relaxed)
    }

    /// Something could not be written; whether the reason is a new one.
    pub(crate) fn failed(&self, why: &str) -> bool {
        let before = self.lock().replace(why.to_owned());
        before.as_deref() != Some(why)
    }

    /// Something was written.
    pub(crate) fn recovered(&self) {
        *self.lock() = None;
    }

    /// Why nothing is written now.
    pub(crate) fn problem(&self) -> Option<String> {
        self.lock().clone()
    }

    /// The data are whole even if a thread panicked while it held the lock.
    fn lock(&self) -> MutexGuard<'_, Option<String>> {
        self.problem.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}
