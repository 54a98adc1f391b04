//! The output for the operator: lines, and on a terminal a progress bar below them.

use std::io::{self, IsTerminal, Write};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::output;
use crate::output::visible;
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
        let terminal = if to_stderr { io::stderr().is_terminal() } else { io::stdout().is_terminal() };
        let target = if to_stderr { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::stdout() };
        let bar = terminal.then(|| ProgressBar::with_draw_target(Some(LENGTH), target).with_style(style()));
        Screen { to_stderr, bar, told: None }
    }

    /// Prints a line, above the bar if there is one.
    pub fn line(&self, text: &str) {
        match &self.bar {
            Some(bar) => above(bar, self.to_stderr, text),
            None if self.to_stderr => output::error_line(text),
            None => output::line(text),
        }
    }

    /// Prints a line of a process's log, on standard error.
    pub fn log(&self, text: &str) {
        match &self.bar {
            Some(bar) => above(bar, true, text),
            None => output::error_line(text),
        }
    }

    /// Shows the progress of the mission.
    pub fn progress(&mut self, progress: &Progress, now: Duration) {
        if let Some(bar) = &self.bar {
            let (bar, position, line) = (bar.clone(), (progress.fraction() * LENGTH as f64) as u64, progress.line());
            output::show(move || {
                bar.set_position(position);
                bar.set_message(line);
            });
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
            output::show(move || bar.finish_and_clear());
        }
    }
}

/// Prints a line above the bar.
fn above(bar: &ProgressBar, to_stderr: bool, text: &str) {
    let (bar, text) = (bar.clone(), format!("{}\n", visible::lines(text)));
    output::show(move || {
        // Nobody may read it any more.
        bar.suspend(|| {
            let _ = if to_stderr {
                io::stderr().write_all(text.as_bytes())
            } else {
                io::stdout().write_all(text.as_bytes())
            };
        });
    });
}

fn style() -> ProgressStyle {
    ProgressStyle::with_template("{wide_msg}\n{wide_bar}").unwrap_or_else(|_| ProgressStyle::default_bar())
}
