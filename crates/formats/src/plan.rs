//! Plans of QGroundControl (`.plan`, JSON) and missions of `QGC WPL`: their items become places to fly to, the fence becomes areas,
//! the rally points become sites.
//!
//! Commands are those of MAVLink's `MAV_CMD`, frames those of `MAV_FRAME`. Latitude comes first, other than in GeoJSON. Each item
//! becomes steps ([`step`]), and the steps are put in the order in which an autopilot flies them ([`order`]).

use domain::geodesy::Origin;
use serde_json::Value;

use crate::content::Content;
use crate::findings::{Findings, Wrong};
use crate::json::{Node, short};
use crate::shape::{self, Order};
use item::Item;

mod action;
mod commands;
mod complex;
mod fence;
mod item;
mod order;
mod step;
mod survey;
pub(crate) mod wpl;
mod write;

pub(crate) use write::write;

/// Whether a document is a plan, or a mission as QGroundControl wrote it before there were plans (`.mission`).
pub(crate) fn is_plan(document: &Node<'_>) -> bool {
    let text = |key| document.value.get(key).and_then(Value::as_str);
    let is_old_mission = document.get("items").is_some() && document.get("plannedHomePosition").is_some();
    matches!(text("fileType"), Some("Plan" | "Mission")) || is_old_mission
}

/// Reads a document.
pub(crate) fn read(document: &Node<'_>, findings: &mut Findings) -> Content {
    let mut content = Content::default();
    if document.get("mission").is_none() && document.get("items").is_some() {
        let outcome = mission(document, &mut content, findings);
        findings.unless_wrong(outcome);
        return content;
    }
    document.note_unknown(&["fileType", "groundStation", "version", "mission", "geoFence", "rallyPoints"], findings);
    let known = version(document, &[1], "a plan", findings);
    if findings.unless_wrong(known).is_none() {
        return content;
    }
    let items = |document: &Node<'_>, content: &mut Content, findings: &mut Findings| {
        mission(&document.need("mission")?, content, findings)
    };
    for part in [items, fence::read, fence::rally_points] {
        let outcome = part(document, &mut content, findings);
        findings.unless_wrong(outcome);
    }
    content
}

/// The version of a part, which must be known: another one may mean something else. Once it was a text.
fn version(node: &Node<'_>, known: &[i64], what: &str, findings: &mut Findings) -> Result<i64, Wrong> {
    let newest = known.last().copied().unwrap_or_default();
    let Some(version) = node.get("version") else {
        findings.note(&node.place, format!("its version is missing: read as {newest}"));
        return Ok(newest);
    };
    let number = match version.value.as_str() {
        Some(text) => text.parse().unwrap_or(f64::NAN),
        None => version.number()?,
    };
    match known.iter().find(|it| **it as f64 == number) {
        Some(found) => Ok(*found),
        None => {
            let expected = known.iter().map(i64::to_string).collect::<Vec<_>>().join(" or ");
            let found = short(&version.value.to_string());
            let message = format!("version {found} of {what} of QGroundControl, expected {expected}");
            Err(Wrong::at(&version.place, message, "save it with a version of QGroundControl that writes this one"))
        }
    }
}

fn mission(mission: &Node<'_>, content: &mut Content, findings: &mut Findings) -> Result<(), Wrong> {
    version(mission, &[1, 2], "a mission", findings)?;
    mission.note_unused(
        &["cruiseSpeed", "hoverSpeed"],
        "the configuration says how fast a vehicle flies: not read",
        findings,
    );
    let vehicle = ["firmwareType", "vehicleType", "MAV_AUTOPILOT"];
    mission.note_unused(&vehicle, "the mission is flown by any vehicle: not read", findings);
    let known = [
        "version",
        "items",
        "complexItems",
        "plannedHomePosition",
        "cruiseSpeed",
        "hoverSpeed",
        "globalPlanAltitudeMode",
        "fileType",
        "groundStation",
    ];
    mission.note_unknown(&[&known[..], &vehicle].concat(), findings);
    if let Some(home) = mission.get("plannedHomePosition") {
        content.origin = Some(origin(&home)?);
    }
    if let Some(pattern) = mission.list("complexItems")?.first() {
        let message = "a pattern of version 1 of a mission, whose items are not in the file";
        return Err(Wrong::at(&pattern.place, message, "open it in QGroundControl and save it again"));
    }
    let home = content.origin.map(|it| it.place);
    let mut steps = Vec::new();
    for item in mission.need("items")?.items()? {
        if findings.leaves_out(&item.place, "") {
            continue;
        }
        let outcome = match item.need("type").and_then(|it| it.text()) {
            Ok("SimpleItem" | "missionItem") => {
                Item::of_json(&item).and_then(|it| step::of(&it, home, findings)).map(|it| steps.extend(it))
            }
            Ok("ComplexItem") => complex::read(&item, home, findings, &mut steps),
            Ok(other) => {
                let message = format!("an item of type `{}`", short(other));
                Err(Wrong::at(&item.place, message, "expected SimpleItem or ComplexItem"))
            }
            Err(wrong) => Err(wrong),
        };
        findings.unless_wrong(outcome);
    }
    // The order of items of which some could not be read is another one.
    if findings.has_mistakes() { Ok(()) } else { order::run(&steps, content, findings) }
}

/// The planned home: a list of three numbers, and in version 1 an item.
fn origin(home: &Node<'_>) -> Result<Origin, Wrong> {
    let home = if home.value.is_object() { &home.need("coordinate")? } else { home };
    let altitude_m = match home.items()?.get(2).filter(|it| !it.value.is_null()) {
        Some(altitude) => Some(altitude.number()?),
        None => None,
    };
    let place = home.value.as_array().map(|it| Value::from(it.iter().take(2).cloned().collect::<Vec<_>>()));
    let place = place.unwrap_or_default();
    let node = Node { value: &place, place: home.place.clone() };
    Ok(Origin { place: shape::lat_lon(&node, Order::LatitudeFirst)?, altitude_m })
}
