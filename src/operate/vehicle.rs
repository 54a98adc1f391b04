//! `kittiwake vehicle`.

use reqwest::Method;
use serde_json::{Value, json};

use crate::operate::args::VehicleCommand;
use crate::operate::failure::Failure;
use crate::operate::gateway::Gateway;
use crate::operate::{Done, show};

/// Asks or orders what the words say; events have a way of their own.
pub fn run(what: &VehicleCommand, gateway: &Gateway) -> Result<Done, Failure> {
    match what {
        VehicleCommand::List => gateway.ask(Method::GET, &["vehicles"], None).map(|it| shown(it, show::fleet)),
        VehicleCommand::Show | VehicleCommand::Events { .. } => gateway.read(&[]).map(|it| shown(it, show::vehicle)),
        VehicleCommand::Start => verb(gateway, &["start"], None),
        VehicleCommand::Pause => verb(gateway, &["pause"], None),
        VehicleCommand::Resume => verb(gateway, &["resume"], None),
        VehicleCommand::Abort => verb(gateway, &["abort"], None),
        VehicleCommand::Return => verb(gateway, &["return"], None),
        VehicleCommand::LandAt { north_m, east_m } => {
            let place = json!({ "position": { "northM": north_m, "eastM": east_m } });
            verb(gateway, &["land-at"], Some(place))
        }
        VehicleCommand::Replan => verb(gateway, &["replan"], None),
        VehicleCommand::Acknowledge { flag } => verb(gateway, &["contingencies", flag, "acknowledge"], None),
        VehicleCommand::Take => helm(gateway, "take", None),
        VehicleCommand::Release => helm(gateway, "release", None),
        VehicleCommand::HandOver { to } => helm(gateway, "hand-over", Some(json!({ "to": to }))),
    }
}

fn shown(document: Value, words: fn(&Value) -> String) -> Done {
    let text = words(&document);
    Done { document, text }
}

fn verb(gateway: &Gateway, path: &[&str], body: Option<Value>) -> Result<Done, Failure> {
    gateway.order(Method::POST, path, body).map(Done::of)
}

fn helm(gateway: &Gateway, what: &str, body: Option<Value>) -> Result<Done, Failure> {
    let document = gateway.order(Method::POST, &["command", what], body)?;
    let text = format!("command: {}", show::command(&document));
    Ok(Done { document, text })
}
