//! A mission written as a plan of QGroundControl.

use domain::area::{Area, AreaKind};
use domain::geodesy::LatLon;
use domain::geometry::Ned;
use domain::mission::Objective;
use domain::mission::terms::Terms;
use domain::site::SiteKind;
use serde_json::{Value, json};

use super::action;
use super::commands::{DELAY, GRIPPER, LAND, TAKEOFF, WAYPOINT};
use super::item::{NO_PLACE, RELATIVE};
use crate::export::{Geographic, degrees};
use crate::findings::Findings;

/// MAVLink's PRECISION_LAND_MODE_REQUIRED: it searches for its target if that is not seen.
const PRECISION_REQUIRED: u8 = 2;

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
        let Terms { dwell, drop, land_on_target, actions, .. } = &objective.terms;
        let dwell_s = dwell.as_secs_f64();
        for (index, at) in places.iter().enumerate() {
            let mut item = simple_item(items.len() + 1, command, *at, if objective.flying { height_m } else { 0.0 });
            let is_last = index + 1 == places.len();
            if objective.flying && is_last && !drop {
                item["params"][0] = json!(dwell_s);
            }
            if *land_on_target {
                item["params"][1] = json!(PRECISION_REQUIRED);
            }
            items.push(item);
            // Of a survey they begin with its first line.
            if index == 0 && objective.survey.is_some() {
                add_actions(actions, &objective.name, &mut items, findings);
            }
        }
        if *drop {
            items.push(item_of(items.len() + 1, GRIPPER, NO_PLACE, &json!([1, GRIPPER_RELEASE, 0, 0, 0, 0, 0])));
        }
        // In flight it is the time to hold, but for a load that is dropped first.
        if !dwell.is_zero() && (*drop || !objective.flying) {
            items.push(item_of(items.len() + 1, DELAY, NO_PLACE, &json!([dwell_s, -1, -1, -1, 0, 0, 0])));
        }
        if objective.survey.is_none() {
            add_actions(actions, &objective.name, &mut items, findings);
        }
        if !objective.flying && height_m != 0.0 {
            findings.note(&objective.name, "the height of its ground has no counterpart in a plan");
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
    for (area, rings) in &mission.areas {
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
        // A fence has no holes. That round the take-off point is what the mission is flown in.
        let home = (1..rings.len()).find(|it| is_round_home(&area.holes[it - 1]));
        if home.is_some() {
            findings.note(
                &area.name,
                "an area with a hole round the take-off point is written as a fence to stay inside the hole",
            );
        }
        if usize::from(home.is_some()) + 1 < rings.len() {
            findings.note(&area.name, "a fence has no holes: the fence covers them");
        }
        let corners: Vec<Value> = rings[home.unwrap_or(0)].iter().map(|at| pair(*at)).collect();
        polygons.push(json!({ "polygon": corners, "inclusion": home.is_some(), "version": 1 }));
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
    let Terms { worth, after, within, by_utc_ms, tasks, along, .. } = &objective.terms;
    let lost = [
        (worth.is_some(), "that it may be left out"),
        (!after.is_empty(), "what comes before it"),
        (within.is_some() || by_utc_ms.is_some(), "its time limit"),
        (!tasks.is_empty(), "what skills do there"),
        (!along.is_empty(), "what skills do on the way"),
    ];
    for (_, what) in lost.iter().filter(|(is_asked, _)| *is_asked) {
        findings.note(&objective.name, format!("{what} has no counterpart in a plan: left out"));
    }
}

/// Items for the actions that are commands of MAVLink.
fn add_actions(actions: &[String], name: &str, items: &mut Vec<Value>, findings: &mut Findings) {
    for text in actions {
        match action::parse(text) {
            Some((command, frame, params)) => items.push(item_of(items.len() + 1, command, frame, &json!(params))),
            None => findings.note(name, format!("action `{text}` is not a command of MAVLink: left out")),
        }
    }
}

/// An autopilot flies this high to a rally point, in metres above it. (The mission manager's `return_height_m`.)
const RALLY_HEIGHT_M: f64 = 15.0;
/// The least height of a takeoff item. (The planner's `takeoff_height_m`.)
const TAKEOFF_HEIGHT_M: f64 = 10.0;

/// Whether the take-off point is inside of a hole.
fn is_round_home(hole: &[Ned]) -> bool {
    Area::new("", AreaKind::KeepOut, hole.to_vec()).is_at_or_below(Ned::default())
}

fn pair(at: LatLon) -> Value {
    json!([degrees(at.latitude_deg()), degrees(at.longitude_deg())])
}

/// `GRIPPER_ACTION_RELEASE`.
const GRIPPER_RELEASE: f64 = 0.0;

fn item_of(id: usize, command: i64, frame: i64, params: &Value) -> Value {
    json!({
        "type": "SimpleItem",
        "autoContinue": true,
        "command": command,
        "doJumpId": id,
        "frame": frame,
        "params": params,
    })
}

fn simple_item(id: usize, command: i64, at: LatLon, height_m: f64) -> Value {
    let (latitude, longitude) = (degrees(at.latitude_deg()), degrees(at.longitude_deg()));
    let mut item = item_of(id, command, RELATIVE, &json!([0, 0, 0, null, latitude, longitude, height_m]));
    item["Altitude"] = json!(height_m);
    item["AltitudeMode"] = json!(1);
    item["AMSLAltAboveTerrain"] = Value::Null;
    item
}
