//! What a process of the system is made of while it runs: its service on the bus or its router, what ends it, what watches
//! it, and what it leaves behind.

use crate::cli::ProcessCommand;
use crate::outcome::Outcome;

pub mod end;
pub mod first_start;
pub mod inputs;
mod life_lock;
mod notify_socket;
pub mod persisted;
pub mod process;
pub(crate) mod px4_port;
pub mod router;
pub mod run_file;
pub mod state_folder;
pub mod tower_key;
pub mod watchdog;
pub mod writer;

/// Runs a process until it is over or is asked to end.
pub(crate) fn run(process: ProcessCommand) -> Outcome {
    match process {
        ProcessCommand::Router(args) => router::router(&args),
        ProcessCommand::Service(command) => {
            let (service, args) = command.split();
            process::run_service(service, &args)
        }
        ProcessCommand::Onboard(args) => process::run_onboard(&args),
    }
}
