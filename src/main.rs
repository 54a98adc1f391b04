//! `kittiwake`: the whole system in one program, every process of it a subcommand.
//!
//! Which process does what is in [`service`]; `kittiwake up` starts them all, always of this same
//! build, as children of one launcher.

use std::process::ExitCode;

use clap::Parser;

mod access;
mod check_inputs;
mod cli;
mod config;
mod end;
mod inject;
mod kpi;
mod outcome;
mod output;
mod process;
mod run_file;
mod service;
mod settings;
mod status;
mod target;
mod telemetry;
mod up;

fn main() -> ExitCode {
    let cli = cli::Cli::parse();
    let outcome = match cli.command {
        None => up::up(&cli.up),
        Some(cli::Command::Up(args)) => up::up(&args),
        Some(cli::Command::Router(args)) => process::run_router(&args),
        Some(cli::Command::Service(command)) => {
            let (service, args) = command.split();
            process::run_service(service, &args)
        }
        Some(cli::Command::Inject(args)) => inject::inject(&args),
        Some(cli::Command::Status(args)) => status::status(&args),
        Some(cli::Command::Kpi(args)) => kpi::kpi(&args),
        Some(cli::Command::KpiFloor(args)) => kpi::floor::run(&args),
    };
    ExitCode::from(u8::from(outcome))
}
