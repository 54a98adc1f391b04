//! The output for the operator: lines, and on a terminal a progress bar below them.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::output;
use crate::up::progress::{Progress, Stage};

/// Without a terminal, the longest time between two lines about the progress.
const QUIET: Duration = Duration::from_secs(5);
/// Units of the bar.
const LENGTH: u64 = 1000;

/// Where lines go.
pub struct Screen {
    to_stderr: bool,
    bar: Option<ProgressBar>,
    told: Option<(Stage, Duration)>,
}

impl Screen {
    /// On standard output, or on standard error where that carries the report alone.
    pub fn new(to_stderr: bool) -> Screen {
        let terminal = if to_stderr { std::io::stderr().is_terminal() } else { std::io::stdout().is_terminal() };
        let target = if to_stderr { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::stdout() };
        let bar = terminal.then(|| ProgressBar::with_draw_target(Some(LENGTH), target).with_style(style()));
        Screen { to_stderr, bar, told: None }
    }

    /// Prints a line, above the bar if there is one.
    pub fn line(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| print(self.to_stderr, text)),
            None => print(self.to_stderr, text),
        }
    }

    /// Prints a line of a process's log, on standard error.
    pub fn log(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| print(true, text)),
            None => print(true, text),
        }
    }

    /// Shows the progress of the mission.
    pub fn progress(&mut self, progress: &Progress, now: Duration) {
        if let Some(bar) = &self.bar {
            bar.set_position((progress.fraction() * LENGTH as f64) as u64);
            bar.set_message(progress.line());
            return;
        }
        let stage = progress.stage();
        let known = self.told.as_ref().is_some_and(|(told, at)| *told == stage && now < *at + QUIET);
        if !known {
            self.told = Some((stage, now));
            self.line(&progress.line());
        }
    }

    /// Removes the progress bar.
    pub fn end_progress(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}

fn print(to_stderr: bool, text: &str) {
    if to_stderr { output::error_line(text) } else { output::line(text) }
}

fn style() -> ProgressStyle {
    ProgressStyle::with_template("{wide_msg}\n{wide_bar}").unwrap_or_else(|_| ProgressStyle::default_bar())
}
