//! `kittiwake up`: starts every process, keeps it up, shows the mission and reports it.
//!
//! It decides nothing about the flight: without it the system would fly the same mission.

use std::sync::mpsc::{Receiver, Sender, channel};

use domain::quantity::Positive;
use serde::Deserialize;

use crate::cli::UpArgs;
use crate::outcome::Outcome;
use crate::run::end;
use crate::up::flown_files::FlownFiles;
use crate::up::launcher::Launcher;
use crate::up::supervise::Child;
use crate::{check_inputs, output, telemetry};

mod aircraft;
pub mod children;
mod flown_files;
mod launcher;
mod liveness;
mod progress;
mod report;
mod screen;
pub mod supervise;
mod watch;

/// `[launcher]` in the configuration file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Wall seconds from the start within which every process must have been seen.
    pub start_limit_s: Positive,
    /// Wall seconds without a heartbeat after which a process hangs: it is killed, and started again.
    pub hung_after_s: Positive,
    /// When a process that died is started again.
    pub restart: supervise::Policy,
}

/// Something the launcher hears of.
pub enum Happening {
    /// A child printed a line on standard output.
    Line {
        /// Which child.
        child: Child,
        /// The line, without its end.
        text: String,
    },
    /// A child logged a line on standard error.
    Log {
        /// Which child.
        child: Child,
        /// The line, without its end.
        text: String,
    },
    /// A child ended.
    Ended(Child),
    /// A message from the bus.
    Event(Box<node::Event>),
    /// The launcher's own connection to the bus has ended.
    BusEnded(Result<(), bus::BusError>),
    /// Ctrl-C, SIGTERM or a terminal that is closed.
    Interrupted,
}

/// Runs the system until the mission is over, if the arguments say so, or until it is interrupted.
pub fn up(args: &UpArgs) -> Outcome {
    output::in_background();
    let (backend, settings) = args.flown();
    let inputs = match check_inputs::read_or_tell(&settings) {
        Ok(inputs) => inputs,
        Err(outcome) => return outcome,
    };
    if let Err(mistakes) = inputs.suits(backend) {
        return check_inputs::tell(&mistakes);
    }
    if let Err(mistakes) = check_inputs::check_access(inputs.access.as_deref()) {
        return check_inputs::tell(&mistakes);
    }
    if let Some(Err(why)) = args.onboard.map(|it| it.suits(backend)) {
        output::error_line(format_args!("--onboard: {why}"));
        return Outcome::BadInput;
    }
    if let Err(outcome) = check_inputs::read_tls(&inputs.config) {
        return outcome;
    }
    for note in inputs.notes() {
        output::error_line(note);
    }
    let (sender, happenings): (Sender<Happening>, Receiver<Happening>) = channel();
    let interrupt = sender.clone();
    let on_signal = move || {
        // Fails only while the launcher ends.
        let _ = interrupt.send(Happening::Interrupted);
    };
    let (files, config) = match FlownFiles::copy(&settings, &inputs.config) {
        Ok(copy) => copy,
        Err(cause) => {
            output::error_line(cause);
            return Outcome::BadInput;
        }
    };
    let telemetry = telemetry::start("launcher", config.vehicle.as_str(), &config.telemetry);
    let outcome = match end::on_signal(on_signal)
        .and_then(|()| Launcher::new(args, backend, config, files, sender, happenings))
    {
        Ok(launcher) => launcher.run(),
        Err(cause) => {
            output::error_line(format_args!("the launcher cannot start: {cause}"));
            Outcome::NotKeptUp
        }
    };
    telemetry.end();
    outcome
}
