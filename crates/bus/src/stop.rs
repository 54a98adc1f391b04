//! Asks a running loop to end, from any thread.

use std::sync::{Arc, Mutex};

/// Ends a [`crate::Process`] or a [`crate::run_router`]. Clones stop the same loop.
#[derive(Clone, Default)]
pub struct Stop(Arc<Mutex<State>>);

#[derive(Default)]
struct State {
    stopped: bool,
    on_stop: Vec<Box<dyn FnOnce() + Send>>,
}

impl Stop {
    /// One that has not been asked for.
    pub fn new() -> Stop {
        Stop::default()
    }

    /// Asks the loop to end. Asking again does nothing.
    pub fn stop(&self) {
        let hooks = {
            let mut state = self.lock();
            state.stopped = true;
            std::mem::take(&mut state.on_stop)
        };
        hooks.into_iter().for_each(|hook| hook());
    }

    /// Calls `hook` once the end is asked for; at once if it already was.
    pub fn on_stop(&self, hook: impl FnOnce() + Send + 'static) {
        let mut state = self.lock();
        if state.stopped {
            drop(state);
            hook();
        } else {
            state.on_stop.push(Box::new(hook));
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}
