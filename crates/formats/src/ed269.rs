//! UAS geographical zones as ED-269 describes them: a JSON document, whose list of zones is `features` or, as some
//! authorities publish it, `UASZoneList`.

use crate::applicability;
use crate::content::{Content, Height, Outline, Reference, Rule, Zone};
use crate::findings::{Findings, Wrong};
use crate::json::Node;
use crate::shape::{self, Order};
use crate::zone_text::{self, FEET};

const ZONE: [&str; 17] = [
    "identifier",
    "country",
    "name",
    "type",
    "restriction",
    "restrictionConditions",
    "region",
    "reason",
    "otherReasonInfo",
    "regulationExemption",
    "uSpaceClass",
    "message",
    "applicability",
    "zoneAuthority",
    "geometry",
    "extendedProperties",
    "additionalProperties",
];
const VOLUME: [&str; 6] = [
    "uomDimensions",
    "lowerLimit",
    "lowerVerticalReference",
    "upperLimit",
    "upperVerticalReference",
    "horizontalProjection",
];

/// The zones of a document.
pub(crate) fn read(document: &Node<'_>, findings: &mut Findings) -> Content {
    document.note_unused(&["title", "description", "formatVersion", "createdAt"], "not needed: not read", findings);
    document.note_unknown(&["title", "description", "formatVersion", "createdAt", "features", "UASZoneList"], findings);
    let list = document.get("UASZoneList").or_else(|| document.get("features"));
    let list = findings.unless_wrong(list.map_or(Ok(Vec::new()), |it| it.items())).unwrap_or_default();
    let mut content = Content::default();
    for node in list {
        let zones = zone(&node, findings);
        content.zones.extend(findings.unless_wrong(zones).into_iter().flatten());
    }
    content
}

/// A zone has a part for each of its volumes.
fn zone(node: &Node<'_>, findings: &mut Findings) -> Result<Vec<Zone>, Wrong> {
    let name = node.need("identifier")?.text()?;
    node.note_unknown(&ZONE, findings);
    node.note_unused(&["extendedProperties", "additionalProperties"], "free for each authority: not read", findings);
    let restriction = node.need("restriction")?;
    let rule = restriction.one_of(&[
        ("PROHIBITED", Some(Rule::KeepOut)),
        ("REQ_AUTHORISATION", Some(Rule::Permission)),
        ("CONDITIONAL", Some(Rule::Permission)),
        ("NO_RESTRICTION", None),
    ])?;
    let Some(rule) = rule else {
        findings.note(&restriction.place, "a zone without restriction has no counterpart: left out");
        return Ok(Vec::new());
    };
    if restriction.text()? == "CONDITIONAL" {
        findings.note(&restriction.place, "conditions cannot be checked on board: the area needs a permission");
    }
    let mut remarks = zone_text::of_ed269(node);
    let (window, hours) = applicability::hull(&node.list("applicability")?, &mut remarks, findings)?;
    let volumes = node.need("geometry")?.items()?;
    let mut zones = Vec::new();
    for volume in &volumes {
        let [lower, upper] = limits(volume, findings)?;
        zones.push(Zone {
            name: name.to_owned(),
            rule,
            outline: outline(volume, findings)?,
            lower,
            upper,
            window,
            hours: hours.clone(),
            remarks: remarks.clone(),
            source: volume.place.clone(),
        });
    }
    if zones.is_empty() {
        return Err(Wrong::at(&node.place, format!("zone `{name}` has no geometry"), "a zone has at least one"));
    }
    Ok(zones)
}

fn unit_m(volume: &Node<'_>) -> Result<f64, Wrong> {
    volume.get("uomDimensions").map_or(Ok(1.0), |it| it.one_of(&[("M", 1.0), ("FT", FEET)]))
}

fn limits(volume: &Node<'_>, findings: &mut Findings) -> Result<[Option<Height>; 2], Wrong> {
    volume.object()?;
    volume.note_unknown(&VOLUME, findings);
    let unit_m = unit_m(volume)?;
    let limit = |value: &str, reference: &str| -> Result<Option<Height>, Wrong> {
        let Some(value) = volume.get(value) else { return Ok(None) };
        let metres = value.number()? * unit_m;
        let known = [("AGL", Reference::Ground), ("AMSL", Reference::SeaLevel), ("WGS84", Reference::Ellipsoid)];
        Ok(Some(Height { metres, above: volume.need(reference)?.one_of(&known)? }))
    };
    Ok([limit("lowerLimit", "lowerVerticalReference")?, limit("upperLimit", "upperVerticalReference")?])
}

fn outline(volume: &Node<'_>, findings: &mut Findings) -> Result<Outline, Wrong> {
    let node = volume.need("horizontalProjection")?;
    match node.need("type")?.one_of(&[("Circle", true), ("Polygon", false)])? {
        true => {
            node.note_unknown(&["type", "center", "radius"], findings);
            let centre = shape::lat_lon(&node.need("center")?, Order::LongitudeFirst)?;
            let radius = node.need("radius")?;
            // The radius has the unit of the limits.
            shape::circle(centre, radius.number()? * unit_m(volume)?, &radius.place)
        }
        false => {
            node.note_unknown(&["type", "coordinates"], findings);
            shape::polygon(&node.need("coordinates")?, findings)
        }
    }
}
