//! Wakes a running loop from outside the bus, from any thread.

use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Arc, Mutex};

/// Has the node of a [`crate::Process`] act, or ends the wait of another loop. Clones wake the same loop.
#[derive(Clone, Default)]
pub struct Nudge(Arc<Mutex<State>>);

#[derive(Default)]
struct State {
    /// Asked for before there was a loop.
    early: bool,
    wake: Option<Box<dyn Fn() + Send>>,
}

impl Nudge {
    /// Ends the loop's present wait, or its next one. Asking twice before it wakes is asking once.
    pub fn wake(&self) {
        let mut state = self.lock();
        match &state.wake {
            Some(wake) => wake(),
            None => state.early = true,
        }
    }

    /// Receives when a loop other than [`crate::Process`] is woken.
    pub fn waiter(&self) -> Receiver<()> {
        let (sender, waiter) = sync_channel(1);
        self.attach(move || {
            // Fails where the loop is woken already, or has ended.
            let _ = sender.try_send(());
        });
        waiter
    }

    /// From here on it is `wake` that wakes the loop.
    pub(crate) fn attach(&self, wake: impl Fn() + Send + 'static) {
        let mut state = self.lock();
        if std::mem::take(&mut state.early) {
            wake();
        }
        state.wake = Some(Box::new(wake));
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}
