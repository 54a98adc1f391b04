//! Plain GeoJSON (RFC 7946), and as this program writes it: what a feature is stands in its properties, under the names of a
//! mission file. Polygons that say nothing are keep-out areas, which is the safe side.

use serde_json::{Map, Value, json};

use crate::applicability;
use crate::content::{Content, Height, Outline, Place, Reference, Rule, Site, Survey, Waypoint, Window, Zone};
use crate::findings::{Findings, Wrong};
use crate::json::Node;
use crate::shape::{self, Order};
use crate::terms;
use domain::geodesy::{LatLon, Origin};
use domain::hours::{InvalidHours, WeeklyHours, text};
use domain::mission::terms::Order as Sequence;
use domain::site::SiteKind;

/// The property that says what a feature is.
const KIND: &str = "kind";
const PROPERTIES: [&str; 13] = [
    KIND,
    "name",
    "order",
    "height_m",
    "flying",
    "altitude_m",
    "floor_m",
    "ceiling_m",
    "from_utc",
    "until_utc",
    "hours_utc",
    "spacing_m",
    "heading_deg",
];

/// Reads a document.
pub(crate) fn read(document: &Node<'_>, findings: &mut Findings) -> Content {
    document.note_unused(&["name", "bbox"], "not needed: not read", findings);
    document.note_unknown(&["type", "features", "name", "bbox", "geometry", "properties", "id"], findings);
    let features = match document.value.get("type").and_then(Value::as_str) {
        Some("Feature") => vec![document.clone()],
        _ => findings.unless_wrong(document.list("features")).unwrap_or_default(),
    };
    let mut content = Content::default();
    for (index, node) in features.iter().enumerate() {
        let outcome = feature(node, index, &mut content, findings);
        findings.unless_wrong(outcome);
    }
    content
}

fn feature(node: &Node<'_>, index: usize, content: &mut Content, findings: &mut Findings) -> Result<(), Wrong> {
    let Some(geometry) = node.get("geometry") else {
        findings.note(&node.place, "a feature without geometry: left out");
        return Ok(());
    };
    let nothing = Value::Null;
    let properties = node.get("properties").unwrap_or(Node { value: &nothing, place: node.place.clone() });
    if properties.get(KIND).and_then(|it| it.value.as_str()) == Some("leg") {
        findings.note(&node.place, "a leg of a plan: left out, the planner makes its own");
        return Ok(());
    }
    properties.note_unknown(&[&PROPERTIES[..], &terms::PROPERTIES].concat(), findings);
    let name = match properties.get("name") {
        Some(it) => it.text()?.to_owned(),
        None => format!("feature {index}"),
    };
    let kind = properties.get(KIND).map(|it| {
        it.one_of(&[
            ("origin", Kind::Origin),
            ("objective", Kind::Objective),
            ("survey", Kind::Survey),
            ("landing", Kind::Site(SiteKind::Landing)),
            ("ditch", Kind::Site(SiteKind::Ditch)),
            ("keep-out", Kind::Zone(Rule::KeepOut)),
            ("permission", Kind::Zone(Rule::Permission)),
        ])
    });
    let shape = geometry.need("type")?.text()?.to_owned();
    let coordinates = || geometry.need("coordinates");
    match (kind.transpose()?, shape.as_str()) {
        (Some(Kind::Origin), "Point") => {
            let altitude_m = properties.get("altitude_m").map(|it| it.number()).transpose()?;
            let place = shape::lat_lon(&coordinates()?, Order::LongitudeFirst)?;
            content.origin = Some(Origin { place, altitude_m });
            let order =
                properties.get("order").map(|it| it.one_of(&[("given", Sequence::Given), ("free", Sequence::Free)]));
            content.order = order.transpose()?.unwrap_or_default();
        }
        (Some(Kind::Objective), "Point") => {
            let height = Height { metres: properties.need("height_m")?.number()?, above: Reference::TakeOff };
            let at = Place::At(shape::lat_lon(&coordinates()?, Order::LongitudeFirst)?);
            let flying = properties.need("flying")?.boolean()?;
            let (terms, source) = (terms::read(&properties)?, node.place.clone());
            content.waypoints.push(Waypoint { name, at, height, flying, terms, survey: None, source });
        }
        (Some(Kind::Site(kind)), "Point") => {
            let metres = properties.get("height_m").map_or(Ok(0.0), |it| it.number())?;
            let height = Height { metres, above: Reference::TakeOff };
            let at = shape::lat_lon(&coordinates()?, Order::LongitudeFirst)?;
            content.sites.push(Site { name, at, height, kind, source: node.place.clone() });
        }
        (Some(Kind::Survey), "Polygon") => {
            let height = Height { metres: properties.need("height_m")?.number()?, above: Reference::TakeOff };
            let Outline::Polygon(corners) = shape::polygon(&coordinates()?, findings)? else { return Ok(()) };
            let spacing_m = properties.need("spacing_m")?.number()?;
            let heading_deg = properties.get("heading_deg").map(|it| it.number()).transpose()?;
            let survey = Some(Survey { corners, spacing_m, heading_deg });
            let (terms, source) = (terms::read(&properties)?, node.place.clone());
            content.waypoints.push(Waypoint { name, at: Place::Here, height, flying: true, terms, survey, source });
        }
        (kind @ (None | Some(Kind::Zone(_))), "Polygon" | "MultiPolygon") => {
            let rule = if let Some(Kind::Zone(rule)) = kind {
                rule
            } else {
                findings.note(&node.place, "a polygon without `kind`: read as a keep-out area, the safe side");
                Rule::KeepOut
            };
            let polygons = if shape == "Polygon" { vec![coordinates()?] } else { coordinates()?.items()? };
            for polygon in polygons {
                let outline = shape::polygon(&polygon, findings)?;
                content.zones.push(zone(name.clone(), rule, outline, &properties, polygon.place.clone())?);
            }
        }
        (None, _) => {
            let text = format!("{} without `kind` has no counterpart: left out", crate::json::short(&shape));
            findings.note(&geometry.place, text);
        }
        (Some(_), _) => {
            let message = format!("the geometry is {}, which does not fit its `kind`", crate::json::short(&shape));
            return Err(Wrong::at(
                &geometry.place,
                message,
                "origin, objectives and sites are Points, surveys and areas are Polygons",
            ));
        }
    }
    Ok(())
}

#[derive(Clone, Copy)]
enum Kind {
    Origin,
    Objective,
    Survey,
    Site(SiteKind),
    Zone(Rule),
}

fn zone(name: String, rule: Rule, outline: Outline, properties: &Node<'_>, source: String) -> Result<Zone, Wrong> {
    let height = |key| -> Result<Option<Height>, Wrong> {
        let metres = properties.get(key).map(|it| it.number()).transpose()?;
        Ok(metres.map(|metres| Height { metres, above: Reference::TakeOff }))
    };
    let moment = |key| properties.get(key).map(|it| applicability::moment(&it)).transpose();
    let window = Window { from_utc_ms: moment("from_utc")?, until_utc_ms: moment("until_utc")? };
    let window = applicability::checked(window, &properties.place)?;
    let (lower, upper) = (height("floor_m")?, height("ceiling_m")?);
    let hours = hours(properties)?;
    Ok(Zone { name, rule, outline, lower, upper, window, hours, remarks: Vec::new(), source })
}

/// As a mission file has them; an empty list says nothing.
fn hours(properties: &Node<'_>) -> Result<Option<WeeklyHours>, Wrong> {
    let list = properties.list("hours_utc")?;
    let texts = list.iter().map(|it| it.text()).collect::<Result<Vec<&str>, Wrong>>()?;
    if texts.is_empty() {
        return Ok(None);
    }
    let wrong = |(index, invalid): (usize, InvalidHours)| {
        let place = list.get(index).map_or(&properties.place, |it| &it.place);
        Wrong::at(place, invalid.to_string(), text::HELP)
    };
    WeeklyHours::parse(&texts).map(Some).map_err(wrong)
}

/// A document with the origin, the objectives, the sites and the areas of a mission.
pub(crate) fn write(mission: &crate::export::Geographic<'_>) -> String {
    let point = |at: LatLon| json!({ "type": "Point", "coordinates": position(at) });
    let origin = mission.origin;
    let mut features = vec![feature_of(
        point(origin.place),
        json!({ KIND: "origin", "name": mission.name, "altitude_m": origin.altitude_m, "order": order(mission.order) }),
    )];
    features.extend(mission.objectives.iter().map(|(objective, places)| {
        let mut properties = Map::new();
        properties.insert("name".into(), json!(objective.name));
        properties.insert("height_m".into(), json!(objective.position.height_m() + 0.0));
        terms::write(&objective.terms, &mut properties);
        let Some(survey) = &objective.survey else {
            properties.insert(KIND.into(), json!("objective"));
            properties.insert("flying".into(), json!(objective.flying));
            let at = places.last().copied().unwrap_or(origin.place);
            return feature_of(point(at), Value::Object(properties));
        };
        properties.insert(KIND.into(), json!("survey"));
        properties.insert("spacing_m".into(), json!(survey.spacing_m()));
        properties.insert("heading_deg".into(), json!(survey.heading_deg()));
        let corners = crate::export::on_earth(survey.corners(), mission.frame);
        feature_of(json!({ "type": "Polygon", "coordinates": [ring(&corners)] }), Value::Object(properties))
    }));
    features.extend(mission.sites.iter().map(|(site, at)| {
        let height_m = site.position.height_m() + 0.0;
        feature_of(point(*at), json!({ KIND: site.kind.word(), "name": site.name, "height_m": height_m }))
    }));
    features.extend(mission.areas.iter().map(|(area, corners)| {
        let properties = json!({
            KIND: crate::export::kind(area.kind),
            "name": area.name,
            "floor_m": area.floor_m,
            "ceiling_m": area.ceiling_m,
            "from_utc": area.from_utc_ms.map(crate::export::utc),
            "until_utc": area.until_utc_ms.map(crate::export::utc),
            "hours_utc": area.hours.as_ref().map(WeeklyHours::to_texts),
        });
        feature_of(json!({ "type": "Polygon", "coordinates": [ring(corners)] }), properties)
    }));
    features.extend(mission.route.iter().map(|leg| {
        let ends = [leg.way.0, leg.way.1];
        let [from_height_m, to_height_m] = ends.map(|it| it.height_m() + 0.0);
        let coordinates: Value = crate::export::on_earth(&ends, mission.frame).into_iter().map(position).collect();
        let properties = json!({
            KIND: "leg",
            "objective": leg.objective,
            "text": leg.text,
            "from_height_m": from_height_m,
            "to_height_m": to_height_m,
            "begins_s": leg.begins_s,
            "time_s": leg.time_s,
        });
        feature_of(json!({ "type": "LineString", "coordinates": coordinates }), properties)
    }));
    format!("{:#}\n", json!({ "type": "FeatureCollection", "features": features }))
}

fn order(order: Sequence) -> &'static str {
    match order {
        Sequence::Given => "given",
        Sequence::Free => "free",
    }
}

fn feature_of(geometry: Value, properties: Value) -> Value {
    json!({ "type": "Feature", "properties": properties, "geometry": geometry })
}

/// Closed, and counterclockwise, as the RFC asks (section 3.1.6).
fn ring(corners: &[LatLon]) -> Value {
    let mut ring = corners.to_vec();
    if shape::is_clockwise(&ring) {
        ring.reverse();
    }
    ring.extend(ring.first().copied());
    ring.into_iter().map(position).collect()
}

fn position(at: LatLon) -> Value {
    json!([crate::export::degrees(at.longitude_deg()), crate::export::degrees(at.latitude_deg())])
}
