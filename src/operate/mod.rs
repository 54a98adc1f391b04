//! `kittiwake vehicle`, `mission` and `permission`: the gateway's routes as words of a command line,
//! for a hand in a hurry and, with `--json`, for scripts.
//!
//! Nothing is decided here: what the gateway answers is told as it is, and the exit code says who is
//! to blame when nothing was done.

use serde_json::Value;

use crate::operate::args::{GatewayArgs, MissionArgs, PermissionArgs, VehicleArgs};
use crate::operate::failure::Failure;
use crate::operate::gateway::Gateway;
use crate::outcome::Outcome;
use crate::output;

pub mod args;
mod events;
mod failure;
mod gateway;
mod mission;
mod permission;
mod show;
mod vehicle;
mod words;

/// What came of a command.
struct Done {
    /// As the gateway has it.
    document: Value,
    /// For a human.
    text: String,
}

impl Done {
    /// An answer with its outcome in words.
    fn of(document: Value) -> Done {
        let text = document["text"].as_str().unwrap_or("done").to_owned();
        Done { document, text }
    }
}

/// `kittiwake vehicle`.
pub fn vehicle(args: &VehicleArgs) -> Outcome {
    let is_stream = matches!(args.what, args::VehicleCommand::Events { .. });
    let result = Gateway::find(&args.gateway).and_then(|gateway| match args.what {
        args::VehicleCommand::Events { count, status } => {
            events::follow(&gateway, count, status, args.gateway.json).map(|()| None)
        }
        _ => vehicle::run(&args.what, &gateway).map(Some),
    });
    match result {
        Ok(None) => Outcome::Success,
        // What the stream has told is no document that another could follow.
        Err(failure) if is_stream => tell_failure(false, failure),
        Ok(Some(done)) => tell(&args.gateway, Ok(done)),
        Err(failure) => tell(&args.gateway, Err(failure)),
    }
}

/// `kittiwake mission`.
pub fn mission(args: &MissionArgs) -> Outcome {
    tell(&args.gateway, mission::run(&args.what, || Gateway::find(&args.gateway)))
}

/// `kittiwake permission`.
pub fn permission(args: &PermissionArgs) -> Outcome {
    tell(&args.gateway, Gateway::find(&args.gateway).and_then(|gateway| permission::run(&args.what, &gateway)))
}

/// One document, or a text, on standard output; a reason on standard error.
fn tell(args: &GatewayArgs, result: Result<Done, Failure>) -> Outcome {
    match result {
        Ok(done) if args.json => output::line(format_args!("{:#}", done.document)),
        Ok(done) => output::line(done.text),
        Err(failure) => return tell_failure(args.json, failure),
    }
    Outcome::Success
}

fn tell_failure(json: bool, failure: Failure) -> Outcome {
    if json {
        output::line(format_args!("{:#}", failure.document));
    }
    output::error_line(failure.why);
    failure.outcome
}
