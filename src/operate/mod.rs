//! `kittiwake vehicle`, `mission`, `permission`, `pictures`, `site` and `why`: the gateway's routes as subcommands, for operators
//! and, with `--json`, for scripts.
//!
//! Nothing is decided here: the gateway's answer is printed as it is, and the exit code says what kind of
//! failure there was.

use reqwest::Method;
use serde_json::Value;

use crate::operate::args::{GatewayArgs, MissionArgs, PermissionArgs, SiteArgs, VehicleArgs};
use crate::operate::failure::Failure;
use crate::operate::gateway::Gateway;
use crate::outcome::Outcome;
use crate::output;
use crate::output::visible;

pub mod args;
pub mod audit;
pub mod convert;
mod events;
pub mod failure;
pub mod gateway;
mod mission;
mod permission;
pub mod pictures;
mod route;
pub mod show;
mod site;
mod vehicle;
pub mod why;
pub mod words;

/// The outcome of a command.
pub struct Done {
    /// The gateway's answer.
    pub document: Value,
    /// For a human.
    pub text: String,
}

impl Done {
    /// The answer to an order, which has its outcome in words.
    fn of(document: Value) -> Done {
        let text = visible::one_line(document["text"].as_str().unwrap_or("done")).into_owned();
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
        // Events were printed before: another document could not follow them.
        Err(failure) if is_stream => report_failure(false, failure),
        Ok(Some(done)) => report(&args.gateway, Ok(done)),
        Err(failure) => report(&args.gateway, Err(failure)),
    }
}

/// `kittiwake mission`.
pub fn mission(args: &MissionArgs) -> Outcome {
    report(&args.gateway, mission::run(&args.what, || Gateway::find(&args.gateway)))
}

/// `kittiwake permission`.
pub fn permission(args: &PermissionArgs) -> Outcome {
    report(&args.gateway, Gateway::find(&args.gateway).and_then(|gateway| permission::run(&args.what, &gateway)))
}

/// `kittiwake site`.
pub fn site(args: &SiteArgs) -> Outcome {
    report(&args.gateway, Gateway::find(&args.gateway).and_then(|gateway| site::run(&args.what, &gateway)))
}

/// Gives an order to the vehicle, and prints its outcome.
pub fn order(args: &GatewayArgs, path: &[&str], body: Value) -> Outcome {
    let order = |gateway: Gateway| gateway.order(Method::POST, path, Some(body)).map(Done::of);
    report(args, Gateway::find(args).and_then(order))
}

/// Prints one document, or a text, on standard output; a failure on standard error.
pub fn report(args: &GatewayArgs, result: Result<Done, Failure>) -> Outcome {
    match result {
        Ok(done) if args.json => output::line(format_args!("{:#}", done.document)),
        Ok(done) => output::line(done.text),
        Err(failure) => return report_failure(args.json, failure),
    }
    Outcome::Success
}

fn report_failure(json: bool, failure: Failure) -> Outcome {
    if json {
        output::line(format_args!("{:#}", failure.document));
    }
    output::error_line(failure.why);
    failure.outcome
}
