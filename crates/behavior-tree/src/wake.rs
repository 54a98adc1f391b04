//! A wake-up signal for whoever ticks a tree.

use std::future::poll_fn;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Wake, Waker};

/// Remembers that somebody called one of its wakers, for a thread or a task that ticks a tree.
///
/// Wake-ups do not pile up: any number of them before the next look count as one.
#[derive(Clone, Default)]
pub struct WakeSignal {
    shared: Arc<Shared>,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    raised: Condvar,
}

#[derive(Default)]
struct State {
    is_raised: bool,
    /// The task that waits, if one does.
    task: Option<Waker>,
}

impl WakeSignal {
    /// A signal that nobody has raised yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// A waker that raises this signal; for [`Tree::set_waker`](crate::Tree::set_waker).
    pub fn waker(&self) -> Waker {
        Waker::from(self.shared.clone())
    }

    /// True if the signal was raised since the last look.
    pub fn take(&self) -> bool {
        std::mem::take(&mut self.shared.lock().is_raised)
    }

    /// Blocks the thread until the signal is raised.
    pub fn wait(&self) {
        let mut state = self.shared.lock();
        while !state.is_raised {
            state = self.shared.raised.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        state.is_raised = false;
    }

    /// Completes when the signal is raised.
    pub async fn woken(&self) {
        poll_fn(|task| self.poll_woken(task)).await;
    }

    /// [`WakeSignal::woken`] for hand-written futures.
    pub fn poll_woken(&self, task: &mut Context<'_>) -> Poll<()> {
        let mut state = self.shared.lock();
        if std::mem::take(&mut state.is_raised) {
            return Poll::Ready(());
        }
        state.task = Some(task.waker().clone());
        Poll::Pending
    }
}

impl Shared {
    /// The state is a flag and a waker, so a panic elsewhere cannot have left it half written.
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
            state.is_raised = true;
            state.task.take()
        };
        self.raised.notify_all();
        if let Some(task) = task {
            task.wake();
        }
    }
}
