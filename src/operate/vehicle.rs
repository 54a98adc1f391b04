//! `kittiwake vehicle`.

use reqwest::Method;
use serde_json::{Value, json};

use crate::operate::args::{Override, VehicleCommand};
use crate::operate::failure::Failure;
use crate::operate::gateway::Gateway;
use crate::operate::words::on_one_line;
use crate::operate::{Done, show};

/// Reads or orders; events are printed elsewhere.
pub fn run(what: &VehicleCommand, gateway: &Gateway) -> Result<Done, Failure> {
    match what {
        VehicleCommand::List => gateway.ask(Method::GET, &["vehicles"], None).map(|it| shown(it, show::fleet)),
        VehicleCommand::Show | VehicleCommand::Events { .. } => gateway.read(&[]).map(|it| shown(it, show::vehicle)),
        VehicleCommand::Start => verb(gateway, &["start"], None),
        VehicleCommand::Pause(over) => verb(gateway, &["pause"], body(*over)),
        VehicleCommand::Resume => verb(gateway, &["resume"], None),
        VehicleCommand::Abort(over) => verb(gateway, &["abort"], body(*over)),
        VehicleCommand::Return(over) => verb(gateway, &["return"], body(*over)),
        VehicleCommand::LandAt { north_m, east_m, over } => {
            let place = json!({ "position": { "northM": north_m, "eastM": east_m }, "overrides": over.overrides });
            verb(gateway, &["land-at"], Some(place))
        }
        VehicleCommand::Replan => verb(gateway, &["replan"], None),
        VehicleCommand::Inspected => verb(gateway, &["inspected"], None),
        VehicleCommand::Acknowledge { flag } => verb(gateway, &["contingencies", flag, "acknowledge"], None),
        VehicleCommand::Take => command_authority(gateway, "take", None),
        VehicleCommand::Release => command_authority(gateway, "release", None),
        VehicleCommand::HandOver { to } => command_authority(gateway, "hand-over", Some(json!({ "to": to }))),
    }
}

fn body(over: Override) -> Option<Value> {
    over.overrides.then(|| json!({ "overrides": true }))
}

fn shown(document: Value, words: fn(&Value) -> String) -> Done {
    let text = words(&on_one_line(&document));
    Done { document, text }
}

fn verb(gateway: &Gateway, path: &[&str], body: Option<Value>) -> Result<Done, Failure> {
    gateway.order(Method::POST, path, body).map(Done::of)
}

fn command_authority(gateway: &Gateway, what: &str, body: Option<Value>) -> Result<Done, Failure> {
    let document = gateway.order(Method::POST, &["command", what], body)?;
    let text = format!("command: {}", show::command(&on_one_line(&document)));
    Ok(Done { document, text })
}
