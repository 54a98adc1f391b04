//! A thread that saves the newest state of a service, so that the loop of the service never waits for a disk.
//!
//! States that are replaced before their turn are not written. A state that could not be saved is tried again every second. A saved state that
//! is still the newest is saved into the other file too, so that no order is lost with one of them.

#![expect(clippy::disallowed_methods, reason = "the disk is on the wall clock")]

use std::sync::mpsc::{self, Receiver, RecvTimeoutError, SyncSender};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use regular_file::DiskThread;
use store::{InUse, Loaded, Medium, Store};

const RETRY: Duration = Duration::from_secs(1);
/// The last state is awaited this long when the service ends.
const END_LIMIT: Duration = Duration::from_secs(1);

/// Saves states in the order in which they are handed over.
pub struct Writer {
    states: Arc<Mutex<States>>,
    /// Gets at most one notice of a newer state: the state itself is not queued, since a newer one replaces it.
    thread: DiskThread<()>,
    /// Of the first attempt.
    attempted: Receiver<()>,
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
struct States {
    /// The number of the newest.
    number: u64,
    /// The newest, while it waits.
    newest: Option<Vec<u8>>,
    progress: Progress,
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
        let states: Arc<Mutex<States>> = Arc::default();
        let (opened, loaded) = mpsc::sync_channel(1);
        let (attempt, attempted) = mpsc::sync_channel(1);
        let of_thread = states.clone();
        let thread = DiskThread::start("memory", 1, END_LIMIT, move |news| match open() {
            Ok((store, loaded)) => {
                // Fails if the service has gone on without it.
                let _ = opened.send(Ok(loaded));
                save_all(&of_thread, store, &news, &attempt, wake);
            }
            Err(in_use) => drop(opened.send(Err(in_use))),
        })?;
        Ok((Writer { states, thread, attempted }, loaded))
    }

    /// Has `state` saved, in place of one that still waits.
    pub fn save(&self, state: Vec<u8>) -> HandedOver {
        let mut states = lock(&self.states);
        states.number += 1;
        let replaces_one = states.newest.replace(state).is_some();
        states.progress.since.get_or_insert_with(Instant::now);
        // Full if it has a notice already.
        let _ = self.thread.hand_over(());
        HandedOver { number: states.number, replaces_one }
    }

    /// How far it has come.
    pub fn progress(&self) -> Progress {
        lock(&self.states).progress.clone()
    }

    /// The same, as soon as the first attempt has been made, or after `limit`.
    pub fn first_progress(&self, limit: Duration) -> Progress {
        let _ = self.attempted.recv_timeout(limit);
        self.progress()
    }
}

fn save_all<M: Medium>(
    states: &Mutex<States>,
    mut store: Store<M>,
    news: &Receiver<()>,
    attempted: &SyncSender<()>,
    wake: impl Fn(),
) {
    let mut failed = None;
    while let Some((number, state)) = next(states, news, failed.take()) {
        let outcome = store.save(&state).map_err(|trouble| trouble.to_string());
        let is_saved = outcome.is_ok();
        let mut now = lock(states);
        let since = match (is_saved, now.number == number) {
            (true, true) => None,
            (true, false) => Some(Instant::now()),
            (false, _) => now.progress.since,
        };
        now.progress = Progress { done: number, outcome: Some(outcome), since };
        drop(now);
        // Full after the first.
        let _ = attempted.try_send(());
        wake();
        if is_saved && lock(states).newest.is_none() {
            store.save_again(&state);
        }
        failed = (!is_saved).then_some((number, state));
    }
}

/// The next state to save: the newest, or the one that failed once its pause is over; `None` at the end.
fn next(states: &Mutex<States>, news: &Receiver<()>, failed: Option<(u64, Vec<u8>)>) -> Option<(u64, Vec<u8>)> {
    let newest = || {
        let mut states = lock(states);
        states.newest.take().map(|state| (states.number, state))
    };
    loop {
        if let Some(newest) = newest() {
            return Some(newest);
        }
        let told = match failed {
            None => news.recv().map_err(RecvTimeoutError::from),
            Some(_) => news.recv_timeout(RETRY),
        };
        match told {
            Ok(()) => {}
            Err(RecvTimeoutError::Timeout) => return failed,
            Err(RecvTimeoutError::Disconnected) => return newest(),
        }
    }
}

fn lock(states: &Mutex<States>) -> MutexGuard<'_, States> {
    states.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}
