//! `kittiwake-kpi`: see the library of the same name.

use std::process::ExitCode;

use clap::Parser;
use kittiwake_kpi::args::{Cli, Command};

fn main() -> ExitCode {
    let cli = Cli::parse();
    let outcome = match cli.command {
        None => kittiwake_kpi::run(&cli.args),
        Some(Command::Floor(args)) => kittiwake_kpi::floor::run(&args),
    };
    ExitCode::from(u8::from(outcome))
}
