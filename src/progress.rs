//! How far a command is that flies many flights: a bar where somebody watches, else a line a minute.

#![expect(clippy::disallowed_methods, reason = "who waits for a command waits on the wall clock")]

use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::output;

/// Between two lines of a log.
const A_WHILE: Duration = Duration::from_secs(60);

/// Counts what is done, on standard error. Several threads may count.
pub struct Progress {
    bar: ProgressBar,
    /// What is counted, in the plural.
    what: &'static str,
    /// When a line was printed last.
    said: Mutex<Instant>,
}

impl Progress {
    /// Nothing is done yet of `count`, such as `flights`.
    pub fn of(count: u64, what: &'static str) -> Progress {
        let is_seen = std::io::stderr().is_terminal() && 1 < count;
        let target = if is_seen { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let style = ProgressStyle::with_template("{wide_bar} {pos} of {len} {msg}, {eta} left");
        let bar = ProgressBar::with_draw_target(Some(count), target).with_message(what);
        let bar = bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Progress { bar, what, said: Mutex::new(Instant::now()) }
    }

    /// One more is done.
    pub fn done(&self) {
        self.bar.inc(1);
        let mut said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        if self.bar.is_hidden() && A_WHILE <= said.elapsed() {
            *said = Instant::now();
            let (done, all) = (self.bar.position(), self.bar.length().unwrap_or_default());
            output::error_line(format_args!("{done} of {all} {}", self.what));
        }
    }

    /// Prints something meanwhile.
    pub fn print(&self, print: impl FnOnce()) {
        self.bar.suspend(print);
    }

    /// All is done.
    pub fn end(&self) {
        self.bar.finish_and_clear();
    }
}
