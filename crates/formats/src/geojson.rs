//! Plain GeoJSON (RFC 7946), and as this program writes it: what a feature is stands in its properties, under the names of a
//! mission file. Polygons that say nothing are keep-out areas, which is the safe side.

use serde_json::{Map, Value, json};

use crate::applicability;
use crate::content::{
    Content, Height, Outline, Period, Place, Reference, Rule, Site, Survey, Unused, Waypoint, Window, Zone,
};
use crate::findings::{Findings, Wrong};
use crate::json::Node;
use crate::shape::{self, Order};
use crate::terms;
use crate::zone_text::in_words;
use crate::zones::Doubts;
use domain::geodesy::{LatLon, Origin};
use domain::hours::{InvalidHours, WeeklyHours, text};
use domain::mission::terms::Order as Sequence;
use domain::site::SiteKind;

/// The property that says what a feature is.
const KIND: &str = "kind";
const PROPERTIES: [&str; 18] = [
    "radius_m",
    "radius",
    "buffer_m",
    "buffer",
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
    "picture_distance_m",
    "heading_deg",
];

/// Reads a feature.
pub(crate) fn read(node: &Node<'_>, index: usize, content: &mut Content, findings: &mut Findings) -> Result<(), Wrong> {
    node.object()?;
    let Some(geometry) = node.get("geometry") else {
        if let Some(kind) = node.get("properties").and_then(|it| it.get(KIND)) {
            return Err(Wrong::at(&node.place, format!("{} without geometry", in_words(kind.value)), "give it one"));
        }
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
    let mut doubts = Doubts::default();
    let kind = match kind.transpose() {
        Err(wrong) if is_area(node) => doubts.or(Err(wrong), None),
        read => read?,
    };
    let coordinates = || geometry.need("coordinates");
    match (kind, shape.as_str()) {
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
            let coordinates = coordinates()?;
            let Outline::Polygon { border: corners, holes } = shape::polygon(&coordinates, findings)? else {
                return Ok(());
            };
            if !holes.is_empty() {
                findings.note(&coordinates.place, "a survey has no holes: its lines lead over them too");
            }
            let spacing_m = properties.need("spacing_m")?.number()?;
            let number = |key: &str| properties.get(key).map(|it| it.number()).transpose();
            let (picture_distance_m, heading_deg) = (number("picture_distance_m")?, number("heading_deg")?);
            let survey = Some(Survey { corners, spacing_m, picture_distance_m, heading_deg });
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
            if polygons.is_empty() {
                return Err(coordinates()?.wrong("at least one polygon"));
            }
            for polygon in polygons {
                let outline = shape::polygon(&polygon, findings)?;
                let mut zone = zone(name.clone(), rule, outline, &properties, polygon.place.clone());
                zone.doubts.extend_from_slice(&doubts.0);
                content.zones.push(zone);
            }
        }
        (kind @ (None | Some(Kind::Zone(_))), "Point") if radius(&properties).is_some() => {
            let rule = if let Some(Kind::Zone(rule)) = kind { rule } else { Rule::KeepOut };
            let centre = shape::lat_lon(&coordinates()?, Order::LongitudeFirst)?;
            let radius = radius(&properties).unwrap_or_else(|| properties.clone());
            let outline = shape::circle(centre, radius.number()?, &radius.place)?;
            content.zones.push(zone(name, rule, outline, &properties, node.place.clone()));
        }
        (None, "GeometryCollection") => {
            for part in geometry.need("geometries")?.items()? {
                let feature = json!({ "type": "Feature", "properties": properties.value, "geometry": part.value });
                read(&Node { value: &feature, place: part.place.clone() }, index, content, findings)?;
            }
        }
        (None, _) if radius(&properties).is_some() => {
            let message = format!("{} with a radius", crate::json::short(&shape));
            return Err(Wrong::at(&geometry.place, message, "give it as a polygon"));
        }
        (None, _) => {
            let what = crate::json::short(&shape);
            content.unused.push(Unused { what, source: geometry.place.clone() });
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

/// Whether it is meant as an area, as far as can be told.
pub(crate) fn is_area(feature: &Node<'_>) -> bool {
    let shape = feature.get("geometry").and_then(|it| it.get("type"));
    let is_polygon =
        shape.is_some_and(|it| ["Polygon", "MultiPolygon"].contains(&it.value.as_str().unwrap_or_default()));
    let kind = feature.get("properties").and_then(|it| it.get(KIND));
    is_polygon
        && kind.is_none_or(|it| {
            !["survey", "objective", "origin", "landing", "ditch"].contains(&it.value.as_str().unwrap_or_default())
        })
}

#[derive(Clone, Copy)]
enum Kind {
    Origin,
    Objective,
    Survey,
    Site(SiteKind),
    Zone(Rule),
}

/// The radius of a circle round a point, in metres.
fn radius<'a>(properties: &Node<'a>) -> Option<Node<'a>> {
    properties.any_of(&["radius_m", "radius", "buffer_m", "buffer"])
}

/// What is not understood becomes a doubt.
fn zone(name: String, rule: Rule, outline: Outline, properties: &Node<'_>, source: String) -> Zone {
    let height = |key| -> Result<Option<Height>, Wrong> {
        let metres = properties.get(key).map(|it| it.number()).transpose()?;
        Ok(metres.map(|metres| Height { metres, above: Reference::TakeOff }))
    };
    let moment = |key| properties.get(key).map(|it| applicability::moment(&it)).transpose();
    let period = || -> Result<Period, Wrong> {
        let window = Window { from_utc_ms: moment("from_utc")?, until_utc_ms: moment("until_utc")? };
        Ok(Period { window: applicability::checked(window, &properties.place)?, hours: hours(properties)? })
    };
    let mut doubts = Doubts::default();
    let periods = vec![doubts.or(period(), Period::default())];
    let lower = doubts.or(height("floor_m"), None);
    let upper = doubts.or(height("ceiling_m"), None);
    Zone { lower, upper, periods, doubts: doubts.0, ..Zone::always(name, rule, outline, source) }
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
        properties.insert("picture_distance_m".into(), json!(survey.picture_distance_m()));
        properties.insert("heading_deg".into(), json!(survey.heading_deg()));
        let corners = crate::export::on_earth(survey.corners(), mission.frame);
        feature_of(json!({ "type": "Polygon", "coordinates": [ring(&corners, false)] }), Value::Object(properties))
    }));
    features.extend(mission.sites.iter().map(|(site, at)| {
        let height_m = site.position.height_m() + 0.0;
        feature_of(point(*at), json!({ KIND: site.kind.word(), "name": site.name, "height_m": height_m }))
    }));
    features.extend(mission.areas.iter().map(|(area, rings)| {
        let properties = json!({
            KIND: crate::export::kind(area.kind),
            "name": area.name,
            "floor_m": area.floor_m,
            "ceiling_m": area.ceiling_m,
            "from_utc": area.from_utc_ms.map(crate::export::utc),
            "until_utc": area.until_utc_ms.map(crate::export::utc),
            "hours_utc": area.hours.as_ref().map(WeeklyHours::to_texts),
        });
        let rings: Vec<Value> = rings.iter().enumerate().map(|(number, it)| ring(it, 0 < number)).collect();
        feature_of(json!({ "type": "Polygon", "coordinates": rings }), properties)
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

/// Closed; counterclockwise, and a hole clockwise, as the RFC asks (section 3.1.6).
fn ring(corners: &[LatLon], is_hole: bool) -> Value {
    let mut ring = corners.to_vec();
    if shape::is_clockwise(&ring) != is_hole {
        ring.reverse();
    }
    ring.extend(ring.first().copied());
    ring.into_iter().map(position).collect()
}

fn position(at: LatLon) -> Value {
    json!([crate::export::degrees(at.longitude_deg()), crate::export::degrees(at.latitude_deg())])
}
