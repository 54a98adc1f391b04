//! Areas from KML 2.2 (OGC 07-147r2): the polygons of all placemarks. KML says nothing about rules of the air, so they are
//! keep-out areas, which is the safe side, unless the placemark's `ExtendedData` has a `kind`.

use domain::file::{Mistake, Mistakes, Source};
use domain::geodesy::LatLon;
use roxmltree::{Document, Node, ParsingOptions};

use crate::applicability;
use crate::content::{Content, Height, Outline, Period, Reference, Rule, Window, Zone};
use crate::findings::{Findings, Wrong};
use crate::json::short;
use crate::shape;

/// The most elements of a document: one needs some hundred bytes of memory.
const MOST_NODES: u32 = 2_000_000;

/// Reads a document.
///
/// # Errors
/// If it is no XML.
pub(crate) fn read(source: &Source, findings: &mut Findings) -> Result<Content, Mistakes> {
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(&source.text, options).map_err(|error| {
        let help = "a KML file is XML; a .kmz file is a ZIP archive with one inside: unpack it";
        Mistakes(vec![Mistake {
            path: source.path.clone(),
            place: None,
            message: format!("no valid XML: {error}"),
            help: help.into(),
        }])
    })?;
    let lines = Lines::of(&source.text);
    let mut content = Content::default();
    for placemark in document.descendants().filter(|it| it.has_tag_name_of("Placemark")) {
        let zones = zones(placemark, &lines, findings);
        content.zones.extend(findings.unless_wrong(zones).into_iter().flatten());
    }
    for other in ["NetworkLink", "GroundOverlay", "ScreenOverlay", "PhotoOverlay"] {
        for node in document.descendants().filter(|it| it.has_tag_name_of(other)) {
            findings.note(&lines.place(node), format!("{other} has no counterpart: left out"));
        }
    }
    Ok(content)
}

/// Where lines begin: a node's line is searched for, not counted from the start for each.
struct Lines(Vec<usize>);

impl Lines {
    fn of(text: &str) -> Lines {
        Lines(std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect())
    }

    fn place(&self, node: Node<'_, '_>) -> String {
        let at = node.range().start;
        let line = self.0.partition_point(|start| *start <= at);
        let column = at - self.0[line - 1] + 1;
        format!("line {line} column {column}")
    }
}

/// Names of elements in any edition of the format: publishers use several namespaces.
trait LocalName<'a, 'd> {
    fn has_tag_name_of(&self, name: &str) -> bool;
    fn child(&self, name: &str) -> Option<Node<'a, 'd>>;
    fn child_text(&self, name: &str) -> Option<&'a str>;
}

impl<'a, 'd> LocalName<'a, 'd> for Node<'a, 'd> {
    fn has_tag_name_of(&self, name: &str) -> bool {
        self.is_element() && self.tag_name().name() == name
    }

    fn child(&self, name: &str) -> Option<Node<'a, 'd>> {
        self.children().find(|it| it.has_tag_name_of(name))
    }

    fn child_text(&self, name: &str) -> Option<&'a str> {
        self.child(name).and_then(|it| it.text()).map(str::trim).filter(|it| !it.is_empty())
    }
}

fn zones(placemark: Node<'_, '_>, lines: &Lines, findings: &mut Findings) -> Result<Vec<Zone>, Wrong> {
    let place = lines.place(placemark);
    let name = placemark.child_text("name").unwrap_or("placemark");
    for other in ["Point", "LineString", "LinearRing", "Model", "Track"] {
        let is_own =
            |it: &Node<'_, '_>| it.has_tag_name_of(other) && !it.ancestors().any(|it| it.has_tag_name_of("Polygon"));
        for node in placemark.descendants().filter(is_own) {
            findings.note(&lines.place(node), format!("{other} has no counterpart: left out"));
        }
    }
    let polygons: Vec<_> = placemark.descendants().filter(|it| it.has_tag_name_of("Polygon")).collect();
    if polygons.is_empty() {
        return Ok(Vec::new());
    }
    let rule = match extended(placemark, "kind") {
        Some("keep-out") => Rule::KeepOut,
        Some("permission") => Rule::Permission,
        Some(other) => {
            let message = format!("`kind` is `{}`, expected keep-out or permission", short(other));
            return Err(Wrong::at(place, message, ""));
        }
        None => {
            findings.note(&place, "a placemark without `kind`: read as a keep-out area, the safe side");
            Rule::KeepOut
        }
    };
    let window = window(placemark, &place)?;
    let remarks: Vec<_> =
        placemark.child_text("description").map(|it| format!("Description: {it}")).into_iter().collect();
    let zone = |polygon| {
        let source = lines.place(polygon);
        let (outline, upper) = outline(polygon, &source, lines, findings)?;
        let (name, remarks) = (name.to_owned(), remarks.clone());
        let periods = vec![Period { window, hours: None }];
        Ok(Zone { upper, periods, remarks, ..Zone::always(name, rule, outline, source) })
    };
    polygons.into_iter().map(zone).collect()
}

/// A value of the placemark's own data.
fn extended<'a>(placemark: Node<'a, '_>, name: &str) -> Option<&'a str> {
    let mut data = placemark.child("ExtendedData")?.children();
    data.find(|it| it.has_tag_name_of("Data") && it.attribute("name") == Some(name))?.child_text("value")
}

fn window(placemark: Node<'_, '_>, place: &str) -> Result<Window, Wrong> {
    let Some(span) = placemark.child("TimeSpan") else { return Ok(Window::default()) };
    let moment = |name| {
        let text: Option<&str> = span.child_text(name);
        let help = "write it like 2026-05-01T08:00:00Z";
        text.map(applicability::utc_ms).transpose().map_err(|message| Wrong::at(place, message, help))
    };
    applicability::checked(Window { from_utc_ms: moment("begin")?, until_utc_ms: moment("end")? }, place)
}

/// The outline, and the height up to which a polygon is extruded from the ground.
fn outline(
    polygon: Node<'_, '_>,
    place: &str,
    lines: &Lines,
    findings: &mut Findings,
) -> Result<(Outline, Option<Height>), Wrong> {
    let ring = polygon.child("outerBoundaryIs").and_then(|it| it.child("LinearRing"));
    let ring = ring.ok_or_else(|| Wrong::at(place, "a polygon without outer coordinates", ""))?;
    let points = points(ring, place)?;
    let highest_m = points.iter().map(|(_, height)| *height).fold(f64::NEG_INFINITY, f64::max);
    let border = shape::ring(points.into_iter().map(|(at, _)| at).collect(), place, findings)?;
    let mut holes = Vec::new();
    // Some programs write one boundary with all rings, others one for each.
    let inner = polygon.children().filter(|it| it.has_tag_name_of("innerBoundaryIs")).flat_map(|it| it.children());
    for ring in inner.filter(|it| it.has_tag_name_of("LinearRing")) {
        let place = lines.place(ring);
        let corners = self::points(ring, &place).map(|it| it.into_iter().map(|(at, _)| at).collect());
        holes.extend(shape::hole(corners, &place, findings));
    }
    let outline = Outline::Polygon { border, holes };
    let is_extruded = polygon.child_text("extrude") == Some("1");
    let above = match polygon.child_text("altitudeMode") {
        None | Some("clampToGround") => return Ok((outline, None)),
        Some("relativeToGround") => Reference::Ground,
        Some("absolute") => Reference::SeaLevel,
        Some(other) => return Err(Wrong::at(place, format!("altitude mode `{}` is not known", short(other)), "")),
    };
    if !is_extruded {
        findings.note(
            place,
            "a polygon in the air that is not extruded has no counterpart: the area has no limits of height",
        );
    }
    let upper = is_extruded.then_some(Height { metres: highest_m, above });
    Ok((outline, upper))
}

/// The places of a ring, each with its height.
fn points(ring: Node<'_, '_>, place: &str) -> Result<Vec<(LatLon, f64)>, Wrong> {
    let text = ring.child_text("coordinates").ok_or_else(|| Wrong::at(place, "a ring without coordinates", ""))?;
    text.split_whitespace().map(|it| point(it, place)).collect()
}

/// `longitude,latitude` with a height, which is 0 if it is not given.
fn point(text: &str, place: &str) -> Result<(LatLon, f64), Wrong> {
    let wrong =
        |message: String| Wrong::at(place, message, "coordinates are longitude,latitude[,height], separated by spaces");
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|it| it.parse().ok().filter(|it: &f64| it.is_finite())).collect();
    let (longitude, latitude, height) = match numbers.as_deref() {
        Some([longitude, latitude]) => (*longitude, *latitude, 0.0),
        Some([longitude, latitude, height]) => (*longitude, *latitude, *height),
        _ => return Err(wrong(format!("found `{}`, expected a place", short(text)))),
    };
    Ok((LatLon::new(latitude, longitude).map_err(|error| wrong(error.to_string()))?, height))
}
