//! How recording fares, for health, metrics and the list.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, MutexGuard};

/// Bytes on their way to the disk; what comes on top is dropped. Minutes of a vehicle's messages.
const MOST_WAITING: usize = 8 * 1024 * 1024;

/// Shared by the node's loop, the thread that writes and whoever asks.
#[derive(Debug, Default)]
pub struct Gauges {
    waiting: AtomicUsize,
    dropped: AtomicU64,
    problem: Mutex<Option<String>>,
}

impl Gauges {
    /// Whether there is room for so many bytes more, which then count as waiting.
    pub fn admit(&self, bytes: usize) -> bool {
        let add = |waiting: usize| (waiting + bytes <= MOST_WAITING).then_some(waiting + bytes);
        self.waiting.fetch_update(Relaxed, Relaxed, add).is_ok()
    }

    /// So many bytes do not wait any more.
    pub fn taken(&self, bytes: usize) {
        self.waiting.fetch_sub(bytes, Relaxed);
    }

    /// A message was lost.
    pub fn dropped(&self) {
        self.dropped.fetch_add(1, Relaxed);
    }

    /// Messages lost so far.
    pub fn lost(&self) -> u64 {
        self.dropped.load(Relaxed)
    }

    /// Bytes on their way to the disk.
    pub fn waiting(&self) -> usize {
        self.waiting.load(Relaxed)
    }

    /// Something could not be written; true if that is news.
    pub fn fails(&self, why: &str) -> bool {
        let before = self.lock().replace(why.to_owned());
        before.as_deref() != Some(why)
    }

    /// Something was written.
    pub fn works(&self) {
        *self.lock() = None;
    }

    /// Why nothing is written at the moment.
    pub fn problem(&self) -> Option<String> {
        self.lock().clone()
    }

    /// Plain data: a thread that panicked while it held the lock has left it whole.
    fn lock(&self) -> MutexGuard<'_, Option<String>> {
        self.problem.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}
