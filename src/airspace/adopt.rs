//! `kittiwake airspace adopt`: new editions for the mission that is flown.
//!
//! The planner replaces the areas that came from feeds, and nothing else: its objectives stay as they are, with what was reached.

use domain::feed::Feed;
use domain::file::Source;
use domain::geodesy::Origin;
use domain::mission::feeds::Airspace;
use domain::plan::MissionStatus;
use formats::assemble::assemble_airspace;
use kittiwake_proto::json::from_json;
use kittiwake_proto::v1;
use reqwest::Method;
use serde_json::{Value, json};

use crate::airspace::args::AdoptArgs;
use crate::airspace::diff::{document, lines_after};
use crate::airspace::import::of_feeds;
use crate::airspace::{bad_input, feed_lines, own_areas, read_all, warnings};
use crate::operate::Done;
use crate::operate::convert::{in_words, refused};
use crate::operate::failure::Failure;
use crate::operate::gateway::Gateway;
use crate::operate::show;
use crate::operate::words::on_one_line;
use crate::output;
use crate::output::visible::one_line;

/// Compares, tries out and adopts. A refusal leaves the mission as it is.
pub(super) fn adopt(
    args: &AdoptArgs,
    as_json: bool,
    gateway: impl FnOnce() -> Result<Gateway, Failure>,
) -> Result<Done, Failure> {
    let imports = read_all(&args.feeds.files)?;
    let gateway = gateway()?;
    let mut present = status(gateway.read(&["mission"])?)?;
    present.feeds.retain(Feed::is_data_set);
    let origin = present.origin.ok_or_else(|| {
        let why = "the mission in flight has no origin, so nobody knows where it lies among the zones";
        Failure::bad_input(format!("{why}: upload one that has"))
    })?;
    args.feeds.replace_all(&present.feeds, &imports)?;
    let own = own_areas(&present.areas, &present.feeds);
    let assembled = assemble_airspace(&imports, origin, &own, &args.feeds.settings()).map_err(refused)?;
    // Comments are for humans who open a file, and would double what crosses the link. No value has several lines.
    let tables: Vec<&str> = assembled.text.lines().filter(|it| !it.starts_with('#')).collect();
    let text = format!("{}{}\n", head(origin), tables.join("\n"));
    let new = Airspace::read(&Source { path: "the new airspace".into(), text: text.clone() }).map_err(bad_input)?;
    let difference = of_feeds(&present.areas, &new.areas, &own);
    let tell = |lines: Vec<String>| {
        let lines = lines.iter().flat_map(|it| it.lines()).map(|it| one_line(it).into_owned());
        lines.filter(|_| !as_json).for_each(output::line);
    };
    tell(in_words(&assembled.notes));
    if present.feeds.is_empty() && !own.is_empty() {
        tell(vec![format!("note: the mission names no feed: its {} areas are its own, and stay", own.len())]);
    }
    tell(lines_after(&present.feeds, &difference));
    tell(feed_lines(&new.feeds));
    tell(warnings(&new.feeds));
    let body = json!({ "text": text });
    let tried = ask(&gateway, Method::POST, &["mission", "airspace", "validate"], &body)?;
    let mut document = document(&difference);
    document["whatIf"] = without_mission(tried.document);
    document["adopted"] = Value::Bool(!args.dry_run);
    if args.dry_run {
        return Ok(Done { document, text: format!("{}\nnothing was changed: --dry-run", tried.text) });
    }
    tell(vec![tried.text]);
    let adopted = ask(&gateway, Method::PUT, &["mission", "airspace"], &body)?;
    document["text"] = adopted.document["text"].clone();
    Ok(Done { document, text: one_line(adopted.document["text"].as_str().unwrap_or("done")).into_owned() })
}

/// The present mission as the gateway's document has it, which says the time besides.
fn status(mut document: Value) -> Result<MissionStatus, Failure> {
    if let Some(members) = document.as_object_mut() {
        members.retain(|name, _| name != "missionTimeS" && name != "utc");
    }
    let read = from_json::<v1::MissionStatus>(&document);
    let status = read.and_then(|it| MissionStatus::try_from(it).map_err(|invalid| invalid.to_string()));
    status.map_err(|why| Failure::unreachable(format!("the mission in flight cannot be read: {why}")))
}

/// What the planner has answered, without the mission as it stands: that may have megabytes, and was asked for by nobody.
fn without_mission(mut reply: Value) -> Value {
    reply.as_object_mut().map(|it| it.remove("status"));
    reply
}

/// The beginning of a mission file that has only areas. Numbers are exact, so that the origin is the same one.
fn head(Origin { place, altitude_m }: Origin) -> String {
    let (latitude, longitude) = (place.latitude_deg(), place.longitude_deg());
    let altitude = altitude_m.map(|it| format!("altitude_m = {it:?}\n")).unwrap_or_default();
    format!("name = \"airspace\"\n\n[origin]\nlatitude_deg = {latitude:?}\nlongitude_deg = {longitude:?}\n{altitude}")
}

/// The answer, with the forecast of what is left of the mission.
fn ask(gateway: &Gateway, method: Method, path: &[&str], body: &Value) -> Result<Done, Failure> {
    let forecast = |it: &Value| show::forecast(&on_one_line(it));
    match gateway.order(method, path, Some(body.clone())) {
        Ok(document) => {
            let text = one_line(document["text"].as_str().unwrap_or("done")).into_owned();
            Ok(Done { text: format!("{text}{}", forecast(&document)), document })
        }
        Err(failure) => Err(Failure { why: format!("{}{}", failure.why, forecast(&failure.document)), ..failure }),
    }
}
