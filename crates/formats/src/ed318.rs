//! UAS geographical zones as ED-318 describes them: GeoJSON, whose geometries have a `layer` with heights, and whose points may
//! have an `extent`, which makes a circle of them.

use crate::applicability;
use crate::content::{Content, Height, Outline, Reference, Rule, Zone};
use crate::findings::{Findings, Wrong};
use crate::json::Node;
use crate::shape::{self, Order};
use crate::zone_text::{self, FEET};

const PROPERTIES: [&str; 16] = [
    "identifier",
    "country",
    "name",
    "type",
    "variant",
    "restrictionConditions",
    "region",
    "reason",
    "otherReasonInfo",
    "regulationExemption",
    "message",
    "extendedProperties",
    "dataSource",
    "zoneAuthority",
    "limitedApplicability",
    "uSpaceClass",
];

/// The zones of a document.
pub(crate) fn read(document: &Node<'_>, findings: &mut Findings) -> Content {
    document.note_unused(&["name", "title", "metadata", "bbox"], "not needed: not read", findings);
    document.note_unknown(&["type", "features", "name", "title", "metadata", "bbox"], findings);
    let features = findings.unless_wrong(document.list("features")).unwrap_or_default();
    let mut content = Content::default();
    for feature in features {
        let zones = zone(&feature, findings);
        content.zones.extend(findings.unless_wrong(zones).into_iter().flatten());
    }
    content
}

fn zone(feature: &Node<'_>, findings: &mut Findings) -> Result<Vec<Zone>, Wrong> {
    feature.note_unknown(&["type", "id", "bbox", "properties", "geometry"], findings);
    let properties = feature.need("properties")?;
    properties.note_unknown(&PROPERTIES, findings);
    properties.note_unused(&["extendedProperties", "dataSource"], "not needed: not read", findings);
    let name = properties.need("identifier")?.text()?;
    let kind = properties.need("type")?;
    let rule = kind.one_of(&[
        ("PROHIBITED", Some(Rule::KeepOut)),
        ("REQ_AUTHORIZATION", Some(Rule::Permission)),
        ("CONDITIONAL", Some(Rule::Permission)),
        ("USPACE", Some(Rule::Permission)),
        ("NO_RESTRICTION", None),
    ])?;
    let Some(rule) = rule else {
        findings.note(&kind.place, "a zone without restriction has no counterpart: left out");
        return Ok(Vec::new());
    };
    match kind.text()? {
        "CONDITIONAL" => {
            findings.note(&kind.place, "conditions cannot be checked on board: the area needs a permission");
        }
        "USPACE" => findings.note(&kind.place, "U-space needs an authorised flight: the area needs a permission"),
        _ => {}
    }
    let mut remarks = zone_text::of_ed318(&properties);
    let (window, hours) = applicability::hull(&properties.list("limitedApplicability")?, &mut remarks, findings)?;
    let mut volumes = Vec::new();
    parts(&feature.need("geometry")?, findings, &mut volumes)?;
    let volume = |(outline, [lower, upper], source): Volume| {
        let (name, remarks, hours) = (name.to_owned(), remarks.clone(), hours.clone());
        Zone { name, rule, outline, lower, upper, window, hours, remarks, source }
    };
    Ok(volumes.into_iter().map(volume).collect())
}

type Volume = (Outline, [Option<Height>; 2], String);

/// The volumes of a geometry; one of several geometries has a volume for each.
fn parts(geometry: &Node<'_>, findings: &mut Findings, volumes: &mut Vec<Volume>) -> Result<(), Wrong> {
    geometry.note_unknown(&["type", "coordinates", "geometries", "layer", "extent", "bbox"], findings);
    let kind = geometry.need("type")?;
    match kind.text()? {
        // JSON is not parsed deeper than 128 levels, so this ends.
        "GeometryCollection" => {
            for part in geometry.need("geometries")?.items()? {
                parts(&part, findings, volumes)?;
            }
        }
        "Polygon" => {
            let outline = shape::polygon(&geometry.need("coordinates")?, findings)?;
            volumes.push((outline, layer(geometry, findings)?, geometry.place.clone()));
        }
        "MultiPolygon" => {
            for polygon in geometry.need("coordinates")?.items()? {
                let outline = shape::polygon(&polygon, findings)?;
                volumes.push((outline, layer(geometry, findings)?, polygon.place.clone()));
            }
        }
        "Point" => {
            let extent = geometry.need("extent")?;
            extent.note_unknown(&["subType", "radius", "uom"], findings);
            extent.need("subType")?.one_of(&[("Circle", ())])?;
            let unit_m = extent.get("uom").map_or(Ok(1.0), |it| unit(&it))?;
            let centre = shape::lat_lon(&geometry.need("coordinates")?, Order::LongitudeFirst)?;
            let radius = extent.need("radius")?;
            let outline = shape::circle(centre, radius.number()? * unit_m, &radius.place)?;
            volumes.push((outline, layer(geometry, findings)?, geometry.place.clone()));
        }
        other => {
            let message = format!("a zone with geometry `{}`", crate::json::short(other));
            return Err(Wrong::at(&kind.place, message, "expected Polygon, MultiPolygon, Point or GeometryCollection"));
        }
    }
    Ok(())
}

fn unit(node: &Node<'_>) -> Result<f64, Wrong> {
    node.one_of(&[("m", 1.0), ("ft", FEET)])
}

fn layer(geometry: &Node<'_>, findings: &mut Findings) -> Result<[Option<Height>; 2], Wrong> {
    let Some(layer) = geometry.get("layer") else { return Ok([None, None]) };
    layer.object()?;
    layer.note_unknown(&["upper", "upperReference", "lower", "lowerReference", "uom"], findings);
    let unit_m = layer.get("uom").map_or(Ok(1.0), |it| unit(&it))?;
    let limit = |value: &str, reference: &str| -> Result<Option<Height>, Wrong> {
        let Some(value) = layer.get(value) else { return Ok(None) };
        let known = [("AGL", Reference::Ground), ("AMSL", Reference::SeaLevel), ("WGS84", Reference::Ellipsoid)];
        Ok(Some(Height { metres: value.number()? * unit_m, above: layer.need(reference)?.one_of(&known)? }))
    };
    Ok([limit("lower", "lowerReference")?, limit("upper", "upperReference")?])
}
