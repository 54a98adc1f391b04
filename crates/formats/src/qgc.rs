//! Plans of QGroundControl (`.plan`, JSON): its mission items become places to fly to, its fence becomes areas, its rally points
//! become sites.
//!
//! Commands are those of MAVLink's `MAV_CMD`, frames those of `MAV_FRAME`. Latitude comes first, other than in GeoJSON.

use std::time::Duration;

use serde_json::{Value, json};

use crate::content::{Content, Height, Outline, Reference, Rule, Site, Survey, Waypoint, Window, Zone};
use crate::export::{Geographic, degrees};
use crate::findings::{Findings, Wrong};
use crate::json::{Node, short};
use crate::shape::{self, Order};
use crate::terms;
use domain::area::AreaKind;
use domain::geodesy::{LatLon, Origin};
use domain::mission::Objective;
use domain::mission::terms::Terms;
use domain::site::SiteKind;

const WAYPOINT: i64 = 16;
/// The vehicle stays for the seconds of the first parameter.
const LOITER_TIME: i64 = 19;
const RETURN: i64 = 20;
const LAND: i64 = 21;
const TAKEOFF: i64 = 22;
/// `MAV_CMD_NAV_PAYLOAD_PLACE`: descends at a place and lets go of the load on the ground.
const PAYLOAD_PLACE: i64 = 94;
/// `MAV_CMD_DO_GRIPPER`: the number of the gripper, then what it does, at the item before.
const GRIPPER: i64 = 211;
/// `GRIPPER_ACTION_RELEASE`.
const GRIPPER_RELEASE: f64 = 0.0;
/// `MAV_FRAME_MISSION`: of an item without a place.
const NO_PLACE: i64 = 2;
/// `MAV_FRAME_GLOBAL_RELATIVE_ALT`: heights are above the take-off point.
const RELATIVE: i64 = 3;

/// Reads a document.
pub(crate) fn read(document: &Node<'_>, findings: &mut Findings) -> Content {
    document.note_unknown(&["fileType", "groundStation", "version", "mission", "geoFence", "rallyPoints"], findings);
    let mut content = Content::default();
    for part in [mission, fence, rally_points] {
        let outcome = part(document, &mut content, findings);
        findings.unless_wrong(outcome);
    }
    content
}

fn mission(document: &Node<'_>, content: &mut Content, findings: &mut Findings) -> Result<(), Wrong> {
    let mission = document.need("mission")?;
    mission.note_unused(
        &["cruiseSpeed", "hoverSpeed"],
        "the configuration says how fast a vehicle flies: not read",
        findings,
    );
    mission.note_unused(&["firmwareType", "vehicleType"], "the mission is flown by any vehicle: not read", findings);
    if let Some(home) = mission.get("plannedHomePosition") {
        content.origin = Some(origin(&home)?);
    }
    for item in mission.need("items")?.items()? {
        let outcome = any_item(&item, content, findings);
        findings.unless_wrong(outcome);
    }
    Ok(())
}

fn origin(home: &Node<'_>) -> Result<Origin, Wrong> {
    let altitude_m = match home.items()?.get(2).filter(|it| !it.value.is_null()) {
        Some(altitude) => Some(altitude.number()?),
        None => None,
    };
    let place = home.value.as_array().map(|it| Value::from(it.iter().take(2).cloned().collect::<Vec<_>>()));
    let place = place.unwrap_or_default();
    let node = Node { value: &place, place: home.place.clone() };
    Ok(Origin { place: shape::lat_lon(&node, Order::LatitudeFirst)?, altitude_m })
}

fn any_item(node: &Node<'_>, content: &mut Content, findings: &mut Findings) -> Result<(), Wrong> {
    match node.need("type")?.text()? {
        "SimpleItem" => item(node, content, findings),
        "ComplexItem" => {
            match crate::qgc_survey::read(node)? {
                Ok((survey, height)) => {
                    add_survey(node, survey, height, content, findings);
                    return Ok(());
                }
                Err("no survey") => {}
                Err(why) => findings.note(&node.place, format!("not read as a survey, since {why}")),
            }
            let style = node.get("TransectStyleComplexItem");
            let Some(expanded) = style.and_then(|it| it.get("Items")) else {
                let kind = node.get("complexItemType").and_then(|it| it.value.as_str()).unwrap_or("pattern");
                findings.note(&node.place, format!("{} has no counterpart: left out", short(kind)));
                return Ok(());
            };
            findings.note(&node.place, "a pattern is read as its items, which QGroundControl has made");
            for part in expanded.items()? {
                let outcome = item(&part, content, findings);
                findings.unless_wrong(outcome);
            }
            Ok(())
        }
        other => Err(Wrong::at(
            &node.place,
            format!("an item of type `{}`", short(other)),
            "expected SimpleItem or ComplexItem",
        )),
    }
}

fn add_survey(node: &Node<'_>, survey: Survey, height: Height, content: &mut Content, findings: &mut Findings) {
    let text =
        "a survey of the same polygon, angle and spacing; its camera, its turnaround and where it begins are left out";
    findings.note(&node.place, text);
    let name = format!("survey {}", content.waypoints.len() + 1);
    let (source, terms) = (node.place.clone(), Terms::default());
    content.waypoints.push(Waypoint { name, at: None, height, flying: true, terms, survey: Some(survey), source });
}

fn item(node: &Node<'_>, content: &mut Content, findings: &mut Findings) -> Result<(), Wrong> {
    let command = node.need("command")?.number()? as i64;
    match command {
        WAYPOINT => {}
        LOITER_TIME => {}
        PAYLOAD_PLACE => {
            findings.note(
                &node.place,
                "a load to be placed is dropped from the height of its item: nothing descends with it",
            );
        }
        GRIPPER => return gripper(node, content, findings),
        17..=18 => findings.note(&node.place, "to loiter has no counterpart: the place is flown to"),
        LAND => {}
        RETURN => {
            let height = Height { metres: 0.0, above: Reference::TakeOff };
            let source = node.place.clone();
            let (name, terms) = ("return".into(), Terms::default());
            content.waypoints.push(Waypoint { name, at: None, height, flying: false, terms, survey: None, source });
            return Ok(());
        }
        TAKEOFF => {
            findings.note(&node.place, "the planner takes off by itself: no objective");
            return Ok(());
        }
        other => {
            findings.note(&node.place, format!("command {other} has no counterpart: left out"));
            return Ok(());
        }
    }
    let params = node.need("params")?.items()?;
    let param = |index: usize| params.get(index).filter(|it| !it.value.is_null());
    let number = |index: usize| param(index).map_or(Ok(0.0), |it| it.number());
    let dwell = match param(0).filter(|_| [WAYPOINT, LOITER_TIME].contains(&command)) {
        Some(seconds) => terms::seconds(seconds)?,
        None => Duration::ZERO,
    };
    let flying = command != LAND;
    let at = match (number(4)?, number(5)?) {
        // Land where the vehicle is, which is where the item before it has brought it.
        (latitude, longitude) if !flying && latitude == 0.0 && longitude == 0.0 => {
            content.waypoints.last().and_then(|it| it.at)
        }
        (latitude, longitude) => {
            let place = LatLon::new(latitude, longitude);
            Some(place.map_err(|error| Wrong::at(format!("{}/params", node.place), error.to_string(), ""))?)
        }
    };
    let frame = node.need("frame")?;
    let above = match frame.number()? as i64 {
        0 | 5 => Reference::SeaLevel,
        RELATIVE | 6 => Reference::TakeOff,
        10 | 11 => Reference::Ground,
        other => {
            let message = format!(
                "frame {other}, expected 0 (above sea level), 3 (above the take-off point) or 10 (above the ground)"
            );
            return Err(Wrong::at(&frame.place, message, "give the item one of these frames in QGroundControl"));
        }
    };
    let count = content.waypoints.len() + 1;
    let name = if flying { format!("waypoint {count}") } else { format!("land {count}") };
    let height = if flying { Height { metres: number(6)?, above } } else { Height::ON_GROUND };
    let terms = Terms { dwell, drop: command == PAYLOAD_PLACE, ..Terms::default() };
    content.waypoints.push(Waypoint { name, at, height, flying, terms, survey: None, source: node.place.clone() });
    Ok(())
}

/// A release belongs to the place before it.
fn gripper(node: &Node<'_>, content: &mut Content, findings: &mut Findings) -> Result<(), Wrong> {
    let params = node.need("params")?.items()?;
    let action = match params.get(1).filter(|it| !it.value.is_null()) {
        Some(action) => action.number()?,
        None => GRIPPER_RELEASE,
    };
    if action != GRIPPER_RELEASE {
        findings.note(&node.place, "a gripper that does anything else than release has no counterpart: left out");
        return Ok(());
    }
    match content.waypoints.last_mut().filter(|it| it.flying) {
        None => findings.note(&node.place, "a release that follows no place in flight has no counterpart: left out"),
        Some(waypoint) if waypoint.terms.drop => {
            findings.note(&node.place, "a second release at a place has no counterpart: left out");
        }
        Some(waypoint) => {
            waypoint.terms.drop = true;
            if !waypoint.terms.dwell.is_zero() {
                findings.note(&node.place, "the time to hold before a release becomes a stay after it");
            }
        }
    }
    Ok(())
}

fn fence(document: &Node<'_>, content: &mut Content, findings: &mut Findings) -> Result<(), Wrong> {
    let Some(fence) = document.get("geoFence") else { return Ok(()) };
    fence.note_unused(&["breachReturn"], "the contingency table says what is flown: not read", findings);
    fence.note_unknown(&["version", "circles", "polygons", "breachReturn"], findings);
    let mut inclusions = 0;
    let parts = fence.list("polygons")?.into_iter().chain(fence.list("circles")?);
    for (index, part) in parts.enumerate() {
        let zone = fence_part(&part, index, findings);
        let Some(zone) = findings.unless_wrong(zone) else { continue };
        if zone.rule == Rule::StayInside {
            inclusions += 1;
            if inclusions == 2 {
                findings.note(&part.place, "a further fence to stay inside: the mission stays inside all of them");
            }
        }
        content.zones.push(zone);
    }
    Ok(())
}

fn fence_part(part: &Node<'_>, index: usize, findings: &mut Findings) -> Result<Zone, Wrong> {
    part.note_unknown(&["polygon", "circle", "inclusion", "version"], findings);
    let is_inclusion = part.need("inclusion")?.boolean()?;
    let rule = if is_inclusion { Rule::StayInside } else { Rule::KeepOut };
    let outline = match part.get("circle") {
        Some(circle) => {
            let centre = shape::lat_lon(&circle.need("center")?, Order::LatitudeFirst)?;
            let radius = circle.need("radius")?;
            shape::circle(centre, radius.number()?, &radius.place)?
        }
        None => {
            let polygon = part.need("polygon")?;
            let corners = shape::places(&polygon, Order::LatitudeFirst)?;
            Outline::Polygon(shape::open_ring(corners, &polygon.place, findings)?)
        }
    };
    Ok(Zone {
        name: format!("fence {}", index + 1),
        rule,
        outline,
        lower: None,
        upper: None,
        window: Window::default(),
        hours: None,
        remarks: Vec::new(),
        source: part.place.clone(),
    })
}

fn rally_points(document: &Node<'_>, content: &mut Content, findings: &mut Findings) -> Result<(), Wrong> {
    let Some(rally) = document.get("rallyPoints") else { return Ok(()) };
    rally.note_unknown(&["version", "points"], findings);
    for (index, point) in rally.list("points")?.iter().enumerate() {
        // `[latitude, longitude, height to fly at]`.
        let at = shape::lat_lon(point, Order::LatitudeFirst);
        let Some(at) = findings.unless_wrong(at) else { continue };
        let text = "a rally point is read as a site on the ground; how high to fly there is not read";
        findings.note(&point.place, text);
        let height = Height::ON_GROUND;
        let (name, kind, source) = (format!("rally {}", index + 1), SiteKind::Landing, point.place.clone());
        content.sites.push(Site { name, at, height, kind, source });
    }
    Ok(())
}

/// The rally points of a plan: sites to land at.
fn rally(mission: &Geographic<'_>, findings: &mut Findings) -> Vec<Value> {
    let mut points = Vec::new();
    for (site, at) in &mission.sites {
        if site.kind == SiteKind::Ditch {
            findings
                .note(&site.name, "a ditch has no counterpart in a plan: left out, as an autopilot would land there");
            continue;
        }
        if site.position.height_m() != 0.0 {
            findings.note(&site.name, "the height of its ground has no counterpart in a plan");
        }
        findings.note(&site.name, "the name of a site has no counterpart in a plan");
        let height_m = site.position.height_m() + RALLY_HEIGHT_M;
        points.push(json!([degrees(at.latitude_deg()), degrees(at.longitude_deg()), height_m]));
    }
    points
}

/// A plan with the objectives of a mission as items, its keep-out areas as a fence, and its sites as rally points; and what it
/// cannot say.
pub(crate) fn write(mission: &Geographic<'_>, findings: &mut Findings) -> String {
    let mut items: Vec<Value> = Vec::new();
    let mut ground = Some(mission.origin.place);
    for (objective, places) in &mission.objectives {
        let height_m = objective.position.height_m() + 0.0;
        if let Some(from) = ground.take() {
            let id = items.len() + 1;
            items.push(simple_item(id, TAKEOFF, from, height_m.max(TAKEOFF_HEIGHT_M)));
        }
        let command = if objective.flying { WAYPOINT } else { LAND };
        for (index, at) in places.iter().enumerate() {
            let mut item = simple_item(items.len() + 1, command, *at, height_m);
            if objective.flying && index + 1 == places.len() {
                item["params"][0] = json!(objective.terms.dwell.as_secs_f64());
            }
            items.push(item);
        }
        if objective.terms.drop {
            let id = items.len() + 1;
            items.push(release_item(id));
        }
        if objective.survey.is_some() {
            findings.note(&objective.name, "a survey is written as the ends of its lines");
        }
        note_terms(objective, findings);
        ground = places.last().copied().filter(|_| !objective.flying);
        findings.note(&objective.name, "the name of an objective has no counterpart in a plan");
    }
    if mission.order != domain::mission::terms::Order::Given {
        findings.note("order", "that the order is free has no counterpart: it becomes the order of the file");
    }
    let mut polygons = Vec::new();
    for (area, corners) in &mission.areas {
        if area.kind == AreaKind::Permission {
            findings.note(&area.name, "a permission area has no counterpart in a plan: left out");
            continue;
        }
        if area.floor_m.is_some() || area.ceiling_m.is_some() {
            findings.note(&area.name, "a fence has no heights: the area applies at all of them in the plan");
        }
        if area.from_utc_ms.is_some() || area.until_utc_ms.is_some() {
            findings.note(&area.name, "a fence has no time window: the area always applies in the plan");
        }
        if area.hours.is_some() {
            findings.note(&area.name, "a fence has no hours: the area applies at all of them in the plan");
        }
        findings.note(&area.name, "the name of an area has no counterpart in a plan");
        let corners: Vec<Value> = corners.iter().map(|at| pair(*at)).collect();
        polygons.push(json!({ "polygon": corners, "inclusion": false, "version": 1 }));
    }
    let points = rally(mission, findings);
    let home = mission.origin.place;
    let altitude_m = mission.origin.altitude_m;
    if altitude_m.is_none() {
        findings.note("origin", "its altitude is not known: the planned home of the plan is at 0 m above sea level");
    }
    let plan = json!({
        "fileType": "Plan",
        "version": 1,
        "groundStation": "QGroundControl",
        "mission": {
            "version": 2,
            // MAV_AUTOPILOT_PX4, MAV_TYPE_QUADROTOR.
            "firmwareType": 12,
            "vehicleType": 2,
            "cruiseSpeed": 15,
            "hoverSpeed": 5,
            "globalPlanAltitudeMode": 1,
            "plannedHomePosition": [degrees(home.latitude_deg()), degrees(home.longitude_deg()), altitude_m.unwrap_or(0.0)],
            "items": items,
        },
        "geoFence": { "version": 2, "circles": [], "polygons": polygons },
        "rallyPoints": { "version": 2, "points": points },
    });
    format!("{plan:#}\n")
}

/// What is asked of an objective, and has no counterpart in a plan.
fn note_terms(objective: &Objective, findings: &mut Findings) {
    let Terms { worth, after, within, by_utc_ms, dwell, drop } = &objective.terms;
    let lost = [
        (worth.is_some(), "that it may be left out"),
        (!after.is_empty(), "what comes before it"),
        (within.is_some() || by_utc_ms.is_some(), "its time limit"),
        (!objective.flying && !dwell.is_zero(), "how long the vehicle stays on the ground"),
    ];
    for (_, what) in lost.iter().filter(|(is_asked, _)| *is_asked) {
        findings.note(&objective.name, format!("{what} has no counterpart in a plan: left out"));
    }
    if *drop && !dwell.is_zero() {
        findings
            .note(&objective.name, "a stay after a drop has no counterpart in a plan, which holds before it releases");
    }
}

/// An autopilot flies this high to a rally point, in metres above it. (The mission manager's `return_height_m`.)
const RALLY_HEIGHT_M: f64 = 15.0;
/// The least height of a takeoff item. (The planner's `takeoff_height_m`.)
const TAKEOFF_HEIGHT_M: f64 = 10.0;

fn pair(at: LatLon) -> Value {
    json!([degrees(at.latitude_deg()), degrees(at.longitude_deg())])
}

fn release_item(id: usize) -> Value {
    json!({
        "type": "SimpleItem",
        "autoContinue": true,
        "command": GRIPPER,
        "doJumpId": id,
        "frame": NO_PLACE,
        "params": [1, GRIPPER_RELEASE, 0, 0, 0, 0, 0],
    })
}

fn simple_item(id: usize, command: i64, at: LatLon, height_m: f64) -> Value {
    let (latitude, longitude) = (degrees(at.latitude_deg()), degrees(at.longitude_deg()));
    json!({
        "type": "SimpleItem",
        "autoContinue": true,
        "command": command,
        "doJumpId": id,
        "frame": RELATIVE,
        "Altitude": height_m,
        "AltitudeMode": 1,
        "AMSLAltAboveTerrain": null,
        "params": [0, 0, 0, null, latitude, longitude, height_m],
    })
}
