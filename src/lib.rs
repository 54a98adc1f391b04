//! The whole system in one program, `kittiwake`, every process a subcommand.
//!
//! Which process does what is in [`service`]; `kittiwake up` starts them all, always of this same build, as children of
//! one launcher. The modules that are public are for `kittiwake-kpi` and `kittiwake-chaos`, which start the same
//! processes to measure or to trouble them: settings, children, exit codes and logs.

#![expect(
    unreachable_pub,
    reason = "only `kittiwake-kpi` and `kittiwake-chaos` use this library: here `pub` means outside of the module"
)]

use std::process::ExitCode;
use std::sync::Arc;

use crate::companion::Companion;

mod airspace;
pub mod backend;
pub mod check_inputs;
mod cli;
mod companion;
pub mod composition;
pub mod config;
mod configuration;
pub mod flood;
mod health;
mod http_client;
pub mod inject;
mod manual;
mod operate;
pub mod outcome;
pub mod output;
mod plan;
mod progress;
mod ros_bridge;
pub mod run;
pub mod service;
pub mod settings;
pub mod setup;
pub mod signing_key;
mod simulate;
mod skill;
mod status;
mod target;
pub mod telemetry;
#[expect(
    clippy::disallowed_methods,
    reason = "processes live on the wall clock, and may not wait until their lines are read"
)]
pub mod up;

/// Does what the command line says, and returns the exit code.
pub fn main() -> ExitCode {
    let cli = cli::read();
    // A child of the launcher is started as `/proc/self/exe`, and would be called `exe` in lists of processes. The name is for
    // humans only.
    let _ = nix::sys::prctl::set_name(c"kittiwake");
    // Beyond a limit on the size of files (`ulimit -f`) a write is to fail, as on a full disk: by default this signal ends the process. It fails
    // only for signals that nobody may handle.
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
    // A parent that starts programs in the background may leave this signal ignored; then nobody hears how a child has
    // ended.
    let _ = signal_hook::flag::register(signal_hook::consts::SIGCHLD, Arc::default());
    // Every TLS connection encrypts with ring. This fails only where a provider is installed already.
    let _ = rustls::crypto::ring::default_provider().install_default();
    let outcome = match cli.command {
        None => up::up(&cli.up),
        Some(cli::Command::Up(args)) => up::up(&args),
        Some(cli::Command::Demo(args)) => up::up(&args.up()),
        Some(cli::Command::Doctor(args)) => setup::doctor::doctor(&args),
        Some(cli::Command::Config(args)) => configuration::config(&args),
        Some(cli::Command::Check(args)) => setup::check::check(&args),
        Some(cli::Command::Px4Check(args)) => setup::px4_check::px4_check(&args),
        Some(cli::Command::AutopilotCheck(args)) => setup::autopilot_check::autopilot_check(&args),
        Some(cli::Command::Plan(args)) => plan::plan(&args),
        Some(cli::Command::Simulate(args)) => simulate::simulate(&args),
        Some(cli::Command::Replay(args)) => simulate::replay::replay(&args),
        Some(cli::Command::Skill(args)) => skill::skill(&args),
        Some(cli::Command::Certs(args)) => setup::certs::certs(&args),
        Some(cli::Command::Run(args)) => run::run(args.process),
        Some(cli::Command::Inject(args)) => inject::inject(&args),
        Some(cli::Command::Status(args)) => status::status(&args),
        Some(cli::Command::Access(args)) => setup::operator_token::access(&args),
        Some(cli::Command::Health(args)) => health::health(&args),
        Some(cli::Command::Vehicle(args)) => operate::vehicle(&args),
        Some(cli::Command::Mission(args)) => operate::mission(&args),
        Some(cli::Command::Airspace(args)) => airspace::airspace(&args),
        Some(cli::Command::Permission(args)) => operate::permission(&args),
        Some(cli::Command::Site(args)) => operate::site(&args),
        Some(cli::Command::RosBridge(args)) => ros_bridge::ros_bridge(&args),
        Some(cli::Command::Audit(args)) => operate::audit::audit(&args),
        Some(cli::Command::Why(args)) => operate::why::why(&args),
        Some(cli::Command::Pictures(args)) => operate::pictures::pictures(&args),
        Some(cli::Command::Completions(args)) => manual::completions(args.shell),
        Some(cli::Command::Man(args)) => manual::write(&args.folder),
        Some(cli::Command::Kpi(args)) => companion::become_companion(Companion::Kpi, &args),
        Some(cli::Command::Chaos(args)) => companion::become_companion(Companion::Chaos, &args),
    };
    output::finish();
    ExitCode::from(u8::from(outcome))
}
