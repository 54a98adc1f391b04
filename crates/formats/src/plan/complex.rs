//! Patterns of QGroundControl (`ComplexItem`), which it turns into items when it uploads a plan. Some of them it also writes.

use domain::geodesy::LatLon;

use super::commands::{
    CAMERA_DISTANCE, CHANGE_SPEED, IMAGE_STOP, LAND, LAND_START, LOITER_TO_HEIGHT, VIDEO_STOP, VTOL_LAND, WAYPOINT,
};
use super::item::{Item, NO_PLACE, RELATIVE, SEA_LEVEL};
use super::step::{self, Does, KEPT, Step};
use super::survey;
use crate::findings::{Findings, Weight, Wrong};
use crate::json::{Node, short};

/// Adds the steps of a pattern.
pub(super) fn read(
    node: &Node<'_>,
    home: Option<LatLon>,
    findings: &mut Findings,
    steps: &mut Vec<Step>,
) -> Result<(), Wrong> {
    let kind = node.need("complexItemType")?;
    match kind.text()? {
        "survey" => match survey::read(node)? {
            Ok(to) => {
                let text = "a survey of the same polygon, angle and spacing, flown by lines of its own: its turnaround and where it begins are left out";
                findings.note(&node.place, text);
                if !to.terms.actions.is_empty() {
                    findings.say(Weight::ForLater, &node.place, KEPT);
                }
                steps.push(Step { place: node.place.clone(), id: None, does: Does::Lead { to, is_end: false } });
                Ok(())
            }
            Err(why) => expanded(node, Some(why), home, findings, steps),
        },
        "CorridorScan" => expanded(node, None, home, findings, steps),
        "fwLandingPattern" => landing(node, LAND, home, findings, steps),
        "vtolLandingPattern" => landing(node, VTOL_LAND, home, findings, steps),
        other => Err(Wrong::at(
            &node.place,
            format!("a pattern `{}`, whose places are not in the file", short(other)),
            "in QGroundControl, upload the plan and download it again: it then has waypoints instead",
        )),
    }
}

/// The items that QGroundControl has made of a pattern.
fn expanded(
    node: &Node<'_>,
    no_survey: Option<&str>,
    home: Option<LatLon>,
    findings: &mut Findings,
    steps: &mut Vec<Step>,
) -> Result<(), Wrong> {
    let style = node.get("TransectStyleComplexItem");
    let items = style.map_or(Ok(Vec::new()), |it| it.list("Items"))?;
    let why = no_survey.map(|why| format!("not read as a survey, since {why}"));
    if items.is_empty() {
        let message = format!("a pattern without its items{}", why.map(|it| format!(", {it}")).unwrap_or_default());
        return Err(Wrong::at(&node.place, message, "open the plan in QGroundControl and save it again"));
    }
    if let Some(why) = why {
        findings.note(&node.place, why);
    }
    findings.note(&node.place, "a pattern is read as its items, which QGroundControl has made");
    for part in items {
        if findings.leaves_out(&part.place, "") {
            continue;
        }
        let found = Item::of_json(&part).and_then(|it| step::of(&it, home, findings));
        steps.extend(findings.unless_wrong(found).unwrap_or_default());
    }
    Ok(())
}

/// A landing pattern, as QGroundControl expands it: the mark of a landing sequence, the approach, the landing.
fn landing(
    node: &Node<'_>,
    land: i64,
    home: Option<LatLon>,
    findings: &mut Findings,
    steps: &mut Vec<Step>,
) -> Result<(), Wrong> {
    super::version(node, &[1, 2], "a landing pattern", findings)?;
    let flag = |key: &str, otherwise| node.get(key).map_or(Ok(otherwise), |it| it.boolean());
    let is_relative = flag("altitudesAreRelative", flag("loiterAltitudeRelative", true)?)?;
    let frame = if is_relative { RELATIVE } else { SEA_LEVEL };
    let place = |key: &str| -> Result<[f64; 3], Wrong> {
        let list = node.need(key)?;
        let numbers = list.items()?.iter().map(|it| it.number()).collect::<Result<Vec<_>, _>>()?;
        <[f64; 3]>::try_from(numbers)
            .map_err(|_| Wrong::at(&list.place, "expected latitude, longitude and altitude", ""))
    };
    let approach =
        if node.get("loiterCoordinate").is_some() { "loiterCoordinate" } else { "landingApproachCoordinate" };
    let (approach, end) = (place(approach)?, place("landCoordinate")?);
    let item = |command: i64, frame: i64, params: [f64; 4], at: [f64; 3]| {
        let [a, b, c, d] = params;
        let [latitude, longitude, altitude] = at;
        Item::of(&node.place, command, frame, [a, b, c, d, latitude, longitude, altitude])
    };
    let nowhere = |command: i64, params: [f64; 4]| item(command, NO_PLACE, params, [0.0; 3]);
    let mut items = vec![nowhere(LAND_START, [0.0; 4])];
    if flag("stopTakingPhotos", false)? {
        items.extend([nowhere(CAMERA_DISTANCE, [0.0; 4]), nowhere(IMAGE_STOP, [0.0; 4])]);
    }
    if flag("stopVideoPhotos", false)? {
        items.push(nowhere(VIDEO_STOP, [0.0; 4]));
    }
    if flag("useDoChangeSpeed", false)? {
        let speed_m_s = node.need("finalApproachSpeed")?.number()?;
        items.push(nowhere(CHANGE_SPEED, [0.0, speed_m_s, -1.0, 0.0]));
    }
    let circles = flag("useLoiterToAlt", true)?;
    items.push(item(if circles { LOITER_TO_HEIGHT } else { WAYPOINT }, frame, [0.0; 4], approach));
    items.push(item(land, frame, [0.0; 4], end));
    for item in items {
        steps.extend(step::of(&item, home, findings)?);
    }
    Ok(())
}
