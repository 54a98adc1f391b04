//! A wake-up signal for the caller that ticks a tree.

use std::future::poll_fn;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Wake, Waker};

/// Remembers that one of its wakers was called, for a thread or a task that ticks a tree.
///
/// Wake-ups do not add up: any number of them count as one until the signal is taken.
#[derive(Clone, Default)]
pub struct WakeSignal {
    shared: Arc<Shared>,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    set: Condvar,
}

#[derive(Default)]
struct State {
    is_set: bool,
    /// The task that waits for the signal.
    task: Option<Waker>,
}

impl WakeSignal {
    /// A signal that is not set.
    pub fn new() -> Self {
        Self::default()
    }

    /// A waker that sets this signal, for [`Tree::set_waker`](crate::Tree::set_waker).
    pub fn waker(&self) -> Waker {
        Waker::from(self.shared.clone())
    }

    /// Clears the signal. True if it was set.
    pub fn take(&self) -> bool {
        std::mem::take(&mut self.shared.lock().is_set)
    }

    /// Blocks the thread until the signal is set, and clears it.
    pub fn wait(&self) {
        let mut state = self.shared.lock();
        while !state.is_set {
            state = self.shared.set.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        state.is_set = false;
    }

    /// Completes when the signal is set, and clears it.
    pub async fn woken(&self) {
        poll_fn(|task| self.poll_woken(task)).await;
    }

    fn poll_woken(&self, task: &mut Context<'_>) -> Poll<()> {
        let mut state = self.shared.lock();
        if std::mem::take(&mut state.is_set) {
            return Poll::Ready(());
        }
        state.task = Some(task.waker().clone());
        Poll::Pending
    }
}

impl Shared {
    /// A panic in another thread cannot leave a flag and a waker half written, so a poisoned lock is harmless.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Wake for Shared {
    fn wake(self: Arc<Self>) {
        self.wake_by_ref();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        let task = {
            let mut state = self.lock();
            state.is_set = true;
            state.task.take()
        };
        self.set.notify_all();
        if let Some(task) = task {
            task.wake();
        }
    }
}
