//! The fence of a plan, which becomes areas, and its rally points, which become sites.

use domain::site::SiteKind;

use super::version;
use crate::content::{Content, Height, Outline, Rule, Site, Zone};
use crate::findings::{Findings, Wrong};
use crate::json::Node;
use crate::shape::{self, Order};

/// Adds the areas of the fence. Version 1 (QGroundControl before 3.4) has one polygon, or one circle, that is not left.
pub(super) fn read(document: &Node<'_>, content: &mut Content, findings: &mut Findings) -> Result<(), Wrong> {
    let Some(fence) = document.get("geoFence") else { return Ok(()) };
    version(&fence, &[1, 2], "a fence", findings)?;
    fence.note_unused(&["breachReturn"], "the contingency table says what is flown: not read", findings);
    fence.note_unknown(&["version", "circles", "polygons", "polygon", "circle", "breachReturn"], findings);
    let mut inclusions = 0;
    let mut add = |zone: Result<Zone, Wrong>, place: &str, findings: &mut Findings| {
        let Some(zone) = findings.unless_wrong(zone) else { return };
        if zone.rule == Rule::StayInside {
            inclusions += 1;
            if inclusions == 2 {
                findings.note(place, "a further fence to stay inside: the mission stays inside all of them");
            }
        }
        content.zones.push(zone);
    };
    let is_empty = |it: &Node<'_>| it.value.as_array().is_some_and(Vec::is_empty);
    if let Some(polygon) = fence.get("polygon").filter(|it| !is_empty(it)) {
        let outline = polygon_of(&polygon, findings);
        add(outline.map(|it| zone(1, Rule::StayInside, it, polygon.place.clone())), &polygon.place, findings);
    }
    if let Some(circle) = fence.get("circle") {
        add(circle_of(&circle).map(|it| zone(1, Rule::StayInside, it, circle.place.clone())), &circle.place, findings);
    }
    for (index, part) in fence.list("polygons")?.into_iter().chain(fence.list("circles")?).enumerate() {
        let found = part_of(&part, index + 1, findings);
        add(found, &part.place, findings);
    }
    Ok(())
}

fn polygon_of(polygon: &Node<'_>, findings: &mut Findings) -> Result<Outline, Wrong> {
    let corners = shape::places(polygon, Order::LatitudeFirst)?;
    shape::open_ring(corners, &polygon.place, findings).map(Outline::polygon)
}

fn circle_of(circle: &Node<'_>) -> Result<Outline, Wrong> {
    let centre = shape::lat_lon(&circle.need("center")?, Order::LatitudeFirst)?;
    let radius = circle.need("radius")?;
    shape::circle(centre, radius.number()?, &radius.place)
}

fn part_of(part: &Node<'_>, number: usize, findings: &mut Findings) -> Result<Zone, Wrong> {
    part.note_unknown(&["polygon", "circle", "inclusion", "version"], findings);
    version(part, &[1], "a part of a fence", findings)?;
    let is_inclusion = part.need("inclusion")?.boolean()?;
    let rule = if is_inclusion { Rule::StayInside } else { Rule::KeepOut };
    let outline = match part.get("circle") {
        Some(circle) => circle_of(&circle)?,
        None => polygon_of(&part.need("polygon")?, findings)?,
    };
    Ok(zone(number, rule, outline, part.place.clone()))
}

fn zone(number: usize, rule: Rule, outline: Outline, source: String) -> Zone {
    Zone::always(format!("fence {number}"), rule, outline, source)
}

/// Adds the rally points.
pub(super) fn rally_points(document: &Node<'_>, content: &mut Content, findings: &mut Findings) -> Result<(), Wrong> {
    let Some(rally) = document.get("rallyPoints") else { return Ok(()) };
    version(&rally, &[1, 2], "rally points", findings)?;
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
