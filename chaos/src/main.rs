//! `kittiwake-chaos`: see the library of the same name.

use std::process::ExitCode;

use clap::Parser;
use kittiwake_chaos::args::Args;
use kittiwake_chaos::disk;

fn main() -> ExitCode {
    let args = Args::parse();
    if !args.own_mounts {
        // Returns only where this is impossible; then no disk is filled, and a message says so.
        disk::enter_own_mounts();
    }
    ExitCode::from(kittiwake_chaos::run(&args))
}
