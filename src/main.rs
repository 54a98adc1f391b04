//! `kittiwake`: the whole system in one program, with a subcommand for each process.
//!
//! Which process does what is in [`service`]; `kittiwake up` starts them all, always of this same
//! build, as children of one launcher.

#![expect(unreachable_pub, reason = "no other crate uses a program: here `pub` means outside of the module")]

use std::process::ExitCode;

use clap::Parser;

mod check_inputs;
mod cli;
mod config;
mod health;
mod http_client;
mod inject;
#[expect(clippy::disallowed_methods, reason = "it measures on the wall clock, and keeps all that it hears")]
mod kpi;
mod operate;
mod outcome;
mod output;
mod run;
mod service;
mod settings;
mod setup;
mod status;
mod target;
mod telemetry;
#[expect(
    clippy::disallowed_methods,
    reason = "processes live on the wall clock, and may not wait until their lines are read"
)]
mod up;

fn main() -> ExitCode {
    let cli = cli::Cli::parse();
    // All encryption in the process uses ring; fails only if that is settled already.
    let _ = rustls::crypto::ring::default_provider().install_default();
    let outcome = match cli.command {
        None => up::up(&cli.up),
        Some(cli::Command::Up(args)) => up::up(&args),
        Some(cli::Command::Check(args)) => setup::check::check(&args),
        Some(cli::Command::Router(args)) => run::router::router(&args),
        Some(cli::Command::Certs(args)) => setup::certs::certs(&args),
        Some(cli::Command::Service(command)) => {
            let (service, args) = command.split();
            run::process::run_service(service, &args)
        }
        Some(cli::Command::Inject(args)) => inject::inject(&args),
        Some(cli::Command::Status(args)) => status::status(&args),
        Some(cli::Command::Access(args)) => setup::operator_token::access(&args),
        Some(cli::Command::Health(args)) => health::health(&args),
        Some(cli::Command::Vehicle(args)) => operate::vehicle(&args),
        Some(cli::Command::Mission(args)) => operate::mission(&args),
        Some(cli::Command::Permission(args)) => operate::permission(&args),
        Some(cli::Command::Kpi(args)) => kpi::kpi(&args),
        Some(cli::Command::KpiFloor(args)) => kpi::floor::run(&args),
    };
    ExitCode::from(u8::from(outcome))
}
