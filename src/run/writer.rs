//! A thread that saves the newest state of a service, so that the loop of the service never waits for a disk.
//!
//! States that are replaced before their turn are not written. A state that could not be saved is tried again every second. A saved state that
//! is still the newest is saved into the other file too, so that no order is lost with one of them.

#![expect(clippy::disallowed_methods, reason = "the disk is on the wall clock")]

use std::sync::mpsc::{self, Receiver, SyncSender};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use store::{InUse, Loaded, Medium, Store};

const RETRY: Duration = Duration::from_secs(1);
/// The last state is awaited so long when the service ends.
const END_LIMIT: Duration = Duration::from_secs(1);

/// Saves states in the order in which they are handed over.
pub struct Writer {
    shared: Arc<Shared>,
    /// Disconnected once the thread has ended.
    running: Receiver<()>,
}

/// A state that waits for its turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HandedOver {
    /// Its number, from 1.
    pub number: u64,
    /// The one before it still waited, and is not written.
    pub replaces_one: bool,
}

/// How far the thread has come.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Progress {
    /// The number of the newest state that was saved or could not be; 0 before the first.
    pub done: u64,
    /// The outcome of the newest attempt; `None` before the first.
    pub outcome: Option<Result<(), String>>,
    /// Since when a state waits.
    pub since: Option<Instant>,
}

#[derive(Default)]
struct Shared {
    jobs: Mutex<Jobs>,
    changed: Condvar,
}

#[derive(Default)]
struct Jobs {
    number: u64,
    newest: Option<Vec<u8>>,
    progress: Progress,
    closing: bool,
}

impl Writer {
    /// Starts the thread, which opens the store; what it found comes over the channel. `wake` is called after each attempt.
    ///
    /// # Errors
    /// If the operating system has no thread.
    pub fn start<M: Medium + Send + 'static>(
        open: impl FnOnce() -> Result<(Store<M>, Loaded), InUse> + Send + 'static,
        wake: impl Fn() + Send + 'static,
    ) -> std::io::Result<(Writer, Receiver<Result<Loaded, InUse>>)> {
        let shared = Arc::new(Shared::default());
        let (opened, loaded) = mpsc::sync_channel(1);
        let (end, running) = mpsc::sync_channel(1);
        let thread = shared.clone();
        std::thread::Builder::new().name("memory".into()).spawn(move || {
            let _end: SyncSender<()> = end;
            match open() {
                Ok((store, loaded)) => {
                    // Fails if the service has gone on without it.
                    let _ = opened.send(Ok(loaded));
                    thread.save_all(store, wake);
                }
                Err(in_use) => drop(opened.send(Err(in_use))),
            }
        })?;
        Ok((Writer { shared, running }, loaded))
    }

    /// Has `state` saved, in place of one that still waits.
    pub fn save(&self, state: Vec<u8>) -> HandedOver {
        let mut jobs = self.shared.lock();
        jobs.number += 1;
        let replaces_one = jobs.newest.replace(state).is_some();
        jobs.progress.since.get_or_insert_with(Instant::now);
        self.shared.changed.notify_all();
        HandedOver { number: jobs.number, replaces_one }
    }

    /// How far it has come.
    pub fn progress(&self) -> Progress {
        self.shared.lock().progress.clone()
    }

    /// The same, as soon as the first attempt has been made, or after `limit`.
    pub fn first_progress(&self, limit: Duration) -> Progress {
        let jobs = self.shared.lock();
        let waits = |jobs: &mut Jobs| jobs.progress.outcome.is_none();
        let waited = self.shared.changed.wait_timeout_while(jobs, limit, waits);
        waited.unwrap_or_else(|poisoned| poisoned.into_inner()).0.progress.clone()
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        self.shared.lock().closing = true;
        self.shared.changed.notify_all();
        // A disk that hangs ends with the process.
        let _ = self.running.recv_timeout(END_LIMIT);
    }
}

impl Shared {
    fn save_all<M: Medium>(&self, mut store: Store<M>, wake: impl Fn()) {
        let mut failed = None;
        while let Some((number, state)) = self.next(failed.take()) {
            let outcome = store.save(&state).map_err(|trouble| trouble.to_string());
            let is_saved = outcome.is_ok();
            let mut jobs = self.lock();
            let since = match (is_saved, jobs.number == number) {
                (true, true) => None,
                (true, false) => Some(Instant::now()),
                (false, _) => jobs.progress.since,
            };
            jobs.progress = Progress { done: number, outcome: Some(outcome), since };
            drop(jobs);
            self.changed.notify_all();
            wake();
            if is_saved && self.lock().newest.is_none() {
                store.save_again(&state);
            }
            failed = (!is_saved).then_some((number, state));
        }
    }

    /// The next state to save: the newest, or the one that failed once its pause is over; `None` at the end.
    fn next(&self, failed: Option<(u64, Vec<u8>)>) -> Option<(u64, Vec<u8>)> {
        let jobs = self.lock();
        let waits = |jobs: &mut Jobs| jobs.newest.is_none() && !jobs.closing;
        let mut jobs = match &failed {
            None => self.changed.wait_while(jobs, waits).unwrap_or_else(|poisoned| poisoned.into_inner()),
            Some(_) => {
                let waited = self.changed.wait_timeout_while(jobs, RETRY, waits);
                waited.unwrap_or_else(|poisoned| poisoned.into_inner()).0
            }
        };
        match jobs.newest.take() {
            Some(state) => Some((jobs.number, state)),
            None if jobs.closing => None,
            None => failed,
        }
    }

    fn lock(&self) -> MutexGuard<'_, Jobs> {
        self.jobs.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}
