//! `kittiwake up`: starts every process, keeps it up, shows the mission and reports it.
//!
//! It decides nothing about the flight: without it the system would fly the same mission.

use std::io::ErrorKind;
use std::net::{SocketAddr, TcpListener};
use std::sync::mpsc::{Receiver, Sender, channel};

use domain::quantity::Seconds;
use gateway::audit::in_use;
use gateway::tls::Demand;
use serde::Deserialize;

use crate::backend::Backend;
use crate::cli::UpArgs;
use crate::outcome::Outcome;
use crate::run::{end, state_folder};
use crate::settings::Settings;
use crate::up::flown_files::FlownFiles;
use crate::up::launcher::Launcher;
use crate::up::supervise::Child;
use crate::{check_inputs, output, telemetry};

mod aircraft;
pub mod children;
mod flown_files;
mod launcher;
mod liveness;
mod own_time;
mod progress;
mod report;
mod screen;
pub mod supervise;
mod watch;

/// `[launcher]` in the configuration file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Wall seconds from the start within which every process must have been seen. One that hangs before it is seen is killed after half
    /// of them.
    pub start_limit_s: Seconds<1000, 600_000>,
    /// Wall seconds without a heartbeat after which a process hangs: it is killed, and started again. No less than four heartbeats, which
    /// somebody on a busy machine may need, and the second for which the launcher itself may be held up and not notice.
    pub hung_after_s: Seconds<2000, 60_000>,
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
    // A real aircraft may be in the air when its launcher is started again: a certificate that has run out since is
    // only reported.
    let demand = if backend == Backend::Sim { Demand::Valid } else { Demand::Usable };
    if let Err(outcome) = check_inputs::read_tls(&inputs.config, demand) {
        return outcome;
    }
    if let Err(why) = is_free(&settings, inputs.config.vehicle.as_str()) {
        output::error_line(why);
        return Outcome::BadInput;
    }
    if let Err(why) = port_is_free(backend, inputs.config.http) {
        output::error_line(why);
        return Outcome::BadInput;
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

/// Whether no other run uses the folders of this one; if not, why.
fn is_free(settings: &Settings, vehicle: &str) -> Result<(), String> {
    let access = settings.access.as_deref().map_or(Ok(()), in_use::check_free);
    access.map_err(|it| it.to_string())?;
    let state = settings.state.as_deref().map_or(Ok(()), |it| state_folder::check_free(it, vehicle));
    state.map_err(|it| it.to_string())
}

/// Whether nobody listens where the gateway will; if somebody does, the operator would have no page, and learns that
/// before the simulated vehicle is in the air. A real one may be there already, and is kept up without its gateway.
fn port_is_free(backend: Backend, http: SocketAddr) -> Result<(), String> {
    if backend != Backend::Sim {
        return Ok(());
    }
    match TcpListener::bind(http) {
        Err(cause) if cause.kind() == ErrorKind::AddrInUse => {
            Err(format!("the gateway cannot listen on {http}, which is in use: name another port with `--http`"))
        }
        // Whatever else is wrong with it, the gateway says.
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use domain::file::{Mistakes, Source};
    use domain::testing::check_mistake;

    #[test]
    fn a_port_in_use_is_refused_only_where_nothing_can_fly_yet() {
        #[track_caller]
        fn check(backend: Backend, port: u16, is_free: bool) {
            assert_eq!(port_is_free(backend, ([127, 0, 0, 1], port).into()).is_ok(), is_free, "{backend}");
        }
        let other = TcpListener::bind("127.0.0.1:0").unwrap();
        let taken = other.local_addr().unwrap().port();
        check(Backend::Sim, taken, false);
        check(Backend::Px4, taken, true);
        check(Backend::Mavlink, taken, true);
        check(Backend::Sim, 0, true);
    }

    #[test]
    fn no_delay_or_limit_leaves_a_dead_process_dead_or_kills_one_that_lives() {
        let shipped = "start_limit_s = 30.0\nhung_after_s = 3.0\n[restart]\nfirst_delay_s = 0.2\nlongest_delay_s = 3.0\n\
                       deaths = 5\nwindow_s = 30.0\n";
        fn parse(text: &str) -> Result<Config, Mistakes> {
            Source { path: "kittiwake.toml".into(), text: text.into() }.parse()
        }
        let check = |find: &str, replace: &str, expected: &str| check_mistake(shipped, find, replace, parse, expected);
        check("hung_after_s = 3.0", "hung_after_s = 1.9", "kittiwake.toml:2:16: found 1.9 s, expected 2 s to 60 s");
        check("hung_after_s = 3.0", "hung_after_s = 1e6", "kittiwake.toml:2:16: found 1000000 s, expected 2 s to 60 s");
        check(
            "start_limit_s = 30.0",
            "start_limit_s = 1e-6",
            "kittiwake.toml:1:17: found 0.000001 s, expected 1 s to 600 s",
        );
        check("start_limit_s = 30.0", "start_limit_s = 601", "kittiwake.toml:1:17: found 601 s, expected 1 s to 600 s");
        check(
            "longest_delay_s = 3.0",
            "longest_delay_s = 61.0",
            "kittiwake.toml:5:19: found 61 s, expected 0 s to 60 s",
        );
        check(
            "first_delay_s = 0.2",
            "first_delay_s = 1e6",
            "kittiwake.toml:4:17: found 1000000 s, expected 0 s to 60 s",
        );
        let contradiction =
            "found a first delay of 4 s and a longest of 3 s, expected the first to be at most the longest";
        check("first_delay_s = 0.2", "first_delay_s = 4.0", &format!("kittiwake.toml:3:1: {contradiction}"));
    }
}
