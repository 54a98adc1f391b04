//! `kittiwake mission`.

use std::path::Path;

use domain::file::Source;
use domain::mission::Mission;
use reqwest::Method;
use serde_json::{Value, json};

use crate::operate::args::MissionCommand;
use crate::operate::failure::Failure;
use crate::operate::gateway::Gateway;
use crate::operate::words::on_one_line;
use crate::operate::{Done, convert, show};

/// Reads or orders. A file is checked before a gateway is looked for.
pub fn run(what: &MissionCommand, gateway: impl FnOnce() -> Result<Gateway, Failure>) -> Result<Done, Failure> {
    match what {
        MissionCommand::Show => read(&gateway()?, show::mission),
        MissionCommand::Plan => read(&gateway()?, show::plan),
        MissionCommand::Validate { file } => {
            let text = text_of(file)?;
            order(&gateway()?, Method::POST, &["mission", "validate"], Some(text))
        }
        MissionCommand::Upload { file } => {
            let text = text_of(file)?;
            order(&gateway()?, Method::PUT, &["mission"], Some(text))
        }
        MissionCommand::Insert { index, name, north_m, east_m, height_m, landed } => {
            let position = json!({ "northM": north_m, "eastM": east_m, "downM": -height_m });
            let objective = json!({ "name": name, "position": position, "flying": !landed });
            let body = json!({ "index": index, "objective": objective });
            order(&gateway()?, Method::POST, &["mission", "objectives"], Some(body))
        }
        MissionCommand::Remove { name } => order(&gateway()?, Method::DELETE, &["mission", "objectives", name], None),
        MissionCommand::Skip { name } => {
            order(&gateway()?, Method::POST, &["mission", "objectives", name, "skip"], None)
        }
        MissionCommand::Approve { revision } => decide(&gateway()?, *revision, true),
        MissionCommand::Reject { revision } => decide(&gateway()?, *revision, false),
        MissionCommand::Import(args) => convert::import(args),
        MissionCommand::Export(args) => convert::export(args),
    }
}

fn read(gateway: &Gateway, words: fn(&Value) -> String) -> Result<Done, Failure> {
    let document = gateway.read(&["mission"])?;
    let text = words(&on_one_line(&document));
    Ok(Done { document, text })
}

/// The file's text, checked as `kittiwake up` checks it, so that a mistake is reported with the file's own name.
fn text_of(file: &Path) -> Result<Value, Failure> {
    let source = Source::read(file).map_err(|it| Failure::bad_input(it.to_string()))?;
    Mission::read(&source).map_err(|it| Failure::bad_input(it.to_string()))?;
    Ok(json!({ "text": source.text }))
}

fn order(gateway: &Gateway, method: Method, path: &[&str], body: Option<Value>) -> Result<Done, Failure> {
    let forecast = |it: &Value| show::forecast(&on_one_line(it));
    match gateway.order(method, path, body) {
        Ok(document) => {
            let text = format!("{}{}", document["text"].as_str().unwrap_or("done"), forecast(&document));
            Ok(Done { document, text })
        }
        Err(failure) => Err(Failure { why: format!("{}{}", failure.why, forecast(&failure.document)), ..failure }),
    }
}

/// Decides about this plan, or the one that waits. The gateway refuses a decision about a plan that does not wait.
fn decide(gateway: &Gateway, revision: Option<u64>, approve: bool) -> Result<Done, Failure> {
    let revision = match revision {
        Some(revision) => revision.to_string(),
        None => {
            let document = gateway.read(&[])?;
            let waiting = document["operator"]["planApproval"]["revision"].as_str().map(str::to_owned);
            waiting.ok_or_else(|| Failure::refused("no plan waits for approval"))?
        }
    };
    let body = json!({ "revision": revision, "approve": approve });
    gateway.order(Method::POST, &["plan", "decision"], Some(body)).map(Done::of)
}
