//! UAS geographical zones: ED-269, ED-318, and the forms in which authorities mix them with GeoJSON.
//!
//! The two standards differ in where they put things, not in what they say: the fields of a zone stand in the item itself
//! (ED-269) or in its `properties`; its shape in volumes with a `horizontalProjection` (ED-269) or in a GeoJSON `geometry`; its
//! limits beside the shape, in its `layer`, in `properties.geometry`, or flat in the properties.
//!
//! What is not understood of a zone becomes a doubt, and the zone bars more. A zone without a shape that can be read is a mistake:
//! nobody knows where it lies.

use domain::geodesy::LatLon;
use serde_json::{Map, Value};

use crate::applicability;
use crate::content::{Doubt, Height, Lost, Outline, Rule, Zone};
use crate::findings::{Findings, Wrong};
use crate::json::Node;
use crate::limits::{self, End, LENGTHS};
use crate::schedule;
use crate::shape::{self, Order};
use crate::zone_text;

/// What a zone has in any form of the standards.
const ZONE: [&str; 45] = [
    "identifier",
    "country",
    "name",
    "type",
    "variant",
    "restriction",
    "restrictionConditions",
    "region",
    "reason",
    "reasons",
    "otherReasonInfo",
    "regulationExemption",
    "uSpaceClass",
    "message",
    "applicability",
    "limitedApplicability",
    "zoneAuthority",
    "geometry",
    "extendedProperties",
    "additionalProperties",
    "dataSource",
    "lower",
    "lowerReference",
    "upper",
    "upperReference",
    "uom",
    "lowerLimit",
    "lowerVerticalReference",
    "upperLimit",
    "upperVerticalReference",
    "uomDimensions",
    "startDateTime",
    "endDateTime",
    "day",
    "startTime",
    "startEvent",
    "endTime",
    "endEvent",
    "purpose",
    "intervalBefore",
    "email",
    "phone",
    "service",
    "contactName",
    "siteURL",
];
const SHAPE: [&str; 15] = [
    "type",
    "coordinates",
    "geometries",
    "layer",
    "extent",
    "bbox",
    "horizontalProjection",
    "uomDimensions",
    "lowerLimit",
    "lowerVerticalReference",
    "upperLimit",
    "upperVerticalReference",
    "center",
    "radius",
    "subType",
];
/// A zone says by one of these fields what it restricts.
pub(crate) const RULES: [(&str, Option<Rule>); 7] = [
    ("PROHIBITED", Some(Rule::KeepOut)),
    ("REQ_AUTHORISATION", Some(Rule::Permission)),
    ("REQ_AUTHORIZATION", Some(Rule::Permission)),
    ("CONDITIONAL", Some(Rule::Permission)),
    ("USPACE", Some(Rule::Permission)),
    ("NO_RESTRICTION", None),
    ("INFORMATION", None),
];

/// What is said of a zone that only informs.
pub(crate) const WITHOUT_RESTRICTION: &str = "a zone without restriction has no counterpart: left out";

/// Whether a feature is a zone of one of the standards, by what only those have.
pub(crate) fn is_zone(item: &Node<'_>) -> bool {
    let Some(properties) = item.get("properties") else { return item.get("identifier").is_some() };
    let has = |key| properties.get(key).is_some();
    let restricts = |key| properties.get(key).is_some_and(|it| it.one_of(&RULES).is_ok());
    let is_named = has("identifier") || has("country");
    let has_layer = item.get("geometry").is_some_and(|it| it.get("layer").is_some());
    restricts("restriction")
        || restricts("type")
        || is_named && (has("restriction") || has("variant") || has("type") && has_layer)
}

/// What was not understood so far.
#[derive(Debug, Default)]
pub(crate) struct Doubts(pub(crate) Vec<Doubt>);

impl Doubts {
    /// The value, or `wider` after its mistake is kept.
    pub(crate) fn or<T>(&mut self, read: Result<T, Wrong>, wider: T) -> T {
        read.unwrap_or_else(|wrong| {
            self.0.push(Doubt { place: wrong.place, message: wrong.message });
            wider
        })
    }
}

/// The zones of an item: one for each of its shapes.
pub(crate) fn read(item: &Node<'_>, index: usize, findings: &mut Findings) -> Result<Vec<Zone>, Lost> {
    zones(item, index, findings).map_err(|wrong| lost(item, wrong))
}

/// A zone whose shape cannot be read, with the places of its shape that can be.
pub(crate) fn lost(item: &Node<'_>, wrong: Wrong) -> Lost {
    let mut places = Vec::new();
    collect_places(item.get("geometry").map_or(&Value::Null, |it| it.value), &mut places);
    Lost { wrong, places }
}

/// All pairs of numbers in a value that may be a place.
fn collect_places(value: &Value, places: &mut Vec<LatLon>) {
    match value {
        Value::Array(items) => match shape::position(value, Order::LongitudeFirst) {
            Ok(place) => places.push(place),
            Err(_) => items.iter().for_each(|it| collect_places(it, places)),
        },
        Value::Object(members) => members.values().for_each(|it| collect_places(it, places)),
        _ => {}
    }
}

fn zones(item: &Node<'_>, index: usize, findings: &mut Findings) -> Result<Vec<Zone>, Wrong> {
    let mut doubts = Doubts::default();
    let properties = item.get("properties").unwrap_or_else(|| item.clone());
    properties.note_unknown(&ZONE, findings);
    let field = properties.any_of(&["restriction"]).map_or_else(|| properties.need("type"), Ok);
    let rule = field.and_then(|it| it.one_of(&RULES).inspect(|rule| say_rule(&it, *rule, findings)));
    let Some(rule) = doubts.or(rule, Some(Rule::KeepOut)) else { return Ok(Vec::new()) };
    let identifier = properties.any_of(&["identifier", "name"]);
    let name = identifier.map_or_else(|| format!("zone {index}"), |it| zone_text::in_words(it.value));
    let mut remarks = zone_text::remarks(&properties);
    let flat = flat_period(&properties);
    let flat = flat.as_ref().map(|value| Node { value, place: properties.place.clone() });
    let periods = properties.any_of(&["applicability", "limitedApplicability"]).or(flat);
    let mut shapes = Vec::new();
    let geometry = item.need("geometry")?;
    let volumes = if geometry.value.is_array() { geometry.items()? } else { vec![geometry] };
    for volume in &volumes {
        parts(volume, None, findings, &mut shapes)?;
    }
    if shapes.is_empty() {
        return Err(Wrong::at(&item.place, format!("zone `{name}` has no geometry"), "a zone has at least one"));
    }
    let within = shapes.iter().map(|it| &it.outline);
    let periods = applicability::periods(periods, within, &mut remarks, &mut doubts, findings);
    let zone = |Shape { outline, limits: beside, place }: Shape<'_>| {
        let mut doubts = Doubts(doubts.0.clone());
        let limits = doubts.or(limits_of(&beside, &properties), None);
        let mut limit = |end| doubts.or(limits.as_ref().map_or(Ok(None), |it| limit(it, end)), None);
        let (lower, upper) = (limit(End::Lower), limit(End::Upper));
        let (name, remarks, periods) = (name.clone(), remarks.clone(), periods.clone());
        Zone { name, rule, outline, lower, upper, periods, remarks, doubts: doubts.0, source: place }
    };
    Ok(shapes.into_iter().map(zone).collect())
}

/// A period that stands in the properties themselves.
fn flat_period(properties: &Node<'_>) -> Option<Value> {
    let keys = schedule::ENTRY.iter().chain(&["startDateTime", "endDateTime"]);
    let members: Map<String, Value> =
        keys.filter_map(|key| Some(((*key).to_owned(), properties.get(key)?.value.clone()))).collect();
    (!members.is_empty()).then_some(Value::Object(members))
}

fn say_rule(field: &Node<'_>, rule: Option<Rule>, findings: &mut Findings) {
    let said = field.value.as_str().unwrap_or_default().trim().to_ascii_uppercase();
    match (rule, said.as_str()) {
        (None, _) => findings.note(&field.place, WITHOUT_RESTRICTION),
        (_, "CONDITIONAL") => {
            findings.note(&field.place, "conditions cannot be checked on board: the area needs a permission");
        }
        (_, "USPACE") => findings.note(&field.place, "U-space needs an authorised flight: the area needs a permission"),
        _ => {}
    }
}

/// A shape of a zone.
#[derive(Debug)]
pub(crate) struct Shape<'a> {
    pub(crate) outline: Outline,
    /// What may have the limits.
    limits: Node<'a>,
    pub(crate) place: String,
}

/// The shapes of a geometry or a volume. One of several geometries has one for each,
/// which may have its limits from what is `around` it.
pub(crate) fn parts<'a>(
    geometry: &Node<'a>,
    around: Option<&Node<'a>>,
    findings: &mut Findings,
    shapes: &mut Vec<Shape<'a>>,
) -> Result<(), Wrong> {
    geometry.object()?;
    geometry.note_unknown(&SHAPE, findings);
    let beside = [geometry.get("layer").as_ref(), Some(geometry), around]
        .into_iter()
        .flatten()
        .find(|it| has_limits(it))
        .cloned();
    let beside = beside.unwrap_or_else(|| geometry.clone());
    let mut add = |outline, place: &str| {
        shapes.push(Shape { outline, limits: beside.clone(), place: place.to_owned() });
    };
    let figure = geometry.get("horizontalProjection").unwrap_or_else(|| geometry.clone());
    let kind = figure.need("type")?;
    match kind.text()? {
        // JSON is not parsed deeper than 128 levels, so this ends.
        "GeometryCollection" => {
            for part in figure.need("geometries")?.items()? {
                parts(&part, Some(&beside), findings, shapes)?;
            }
        }
        "Polygon" => add(shape::polygon(&figure.need("coordinates")?, findings)?, &geometry.place),
        "MultiPolygon" => {
            let polygons = figure.need("coordinates")?;
            if polygons.items()?.is_empty() {
                return Err(polygons.wrong("at least one polygon"));
            }
            for polygon in polygons.items()? {
                add(shape::polygon(&polygon, findings)?, &polygon.place);
            }
        }
        "Circle" => {
            let centre = shape::lat_lon(&figure.need("center")?, Order::LongitudeFirst)?;
            let radius = figure.need("radius")?;
            // The radius has the unit of the limits.
            let unit_m = geometry.get("uomDimensions").map_or(Ok(1.0), |it| it.one_of(&LENGTHS))?;
            add(shape::circle(centre, radius.number()? * unit_m, &radius.place)?, &geometry.place);
        }
        "Point" => {
            let extent = figure.need("extent")?;
            extent.need("subType")?.one_of(&[("Circle", ())])?;
            let unit_m = extent.get("uom").map_or(Ok(1.0), |it| it.one_of(&LENGTHS))?;
            let centre = shape::lat_lon(&figure.need("coordinates")?, Order::LongitudeFirst)?;
            let radius = extent.need("radius")?;
            add(shape::circle(centre, radius.number()? * unit_m, &radius.place)?, &geometry.place);
        }
        other => {
            let message = format!("a zone with geometry `{}`", crate::json::short(other));
            let help = "expected Polygon, MultiPolygon, Circle, Point with an extent, or GeometryCollection";
            return Err(Wrong::at(&kind.place, message, help));
        }
    }
    Ok(())
}

const LOWER: [&str; 2] = ["lower", "lowerLimit"];
const UPPER: [&str; 2] = ["upper", "upperLimit"];

fn has_limits(node: &Node<'_>) -> bool {
    node.any_of(&LOWER).is_some() || node.any_of(&UPPER).is_some()
}

/// The object that has the limits: what is beside the shape, the `geometry` in the properties, or the properties.
fn limits_of<'a>(beside: &Node<'a>, properties: &Node<'a>) -> Result<Option<Node<'a>>, Wrong> {
    let inner = match properties.get("geometry") {
        Some(it) if it.value.is_array() => match it.items()?.as_slice() {
            [] => None,
            [only] => Some(only.clone()),
            _ => return Err(it.wrong("one pair of limits for this shape")),
        },
        other => other,
    };
    Ok([Some(beside.clone()), inner, Some(properties.clone())].into_iter().flatten().find(has_limits))
}

fn limit(node: &Node<'_>, end: End) -> Result<Option<Height>, Wrong> {
    let (value, reference) = match end {
        End::Lower => (&LOWER, ["lowerReference", "lowerVerticalReference"]),
        End::Upper => (&UPPER, ["upperReference", "upperVerticalReference"]),
    };
    let Some(value) = node.any_of(value) else { return Ok(None) };
    let (unit, reference) = (node.any_of(&["uom", "uomDimensions"]), node.any_of(&reference));
    limits::height(end, &value, unit.as_ref(), reference.as_ref())
}
