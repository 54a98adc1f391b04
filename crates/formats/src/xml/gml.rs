//! Borders in GML 3.2 as AIXM uses it: straight lines, geodesics, circles and arcs round a centre.

use domain::geodesy::LatLon;
use roxmltree::Node;

use super::{Lines, LocalName as _, all};
use crate::arcs::{Arc, MOST_PARTS, Piece, between, ring};
use crate::content::{Lost, Outline};
use crate::findings::{Findings, Wrong};
use crate::json::short;
use crate::shape;
use crate::zone_text::FEET;

const HELP: &str = "correct it, or leave the zone out";
/// Ways to draw a line that are not read. A border that has one is lost.
const NOT_READ: [&str; 12] = [
    "Arc",
    "ArcString",
    "ArcByBulge",
    "ArcStringByBulge",
    "Circle",
    "CubicSpline",
    "BSpline",
    "Bezier",
    "OffsetCurve",
    "Clothoid",
    "OrientableCurve",
    "coordinates",
];
/// The most polygons of a volume, and of all volumes the most that cannot be read.
const MOST_POLYGONS: usize = 100_000;
/// A coordinate system may be named on an element that is at most this many levels above a position.
const MOST_LEVELS: usize = 16;
const LENGTHS: [(&str, f64); 10] = [
    ("M", 1.0),
    ("KM", 1000.0),
    ("NM", 1852.0),
    ("[NMI_I]", 1852.0),
    ("NMI", 1852.0),
    ("NAUTMI", 1852.0),
    ("FT", FEET),
    ("[FT_I]", FEET),
    ("MI", 1609.344),
    ("[MI_I]", 1609.344),
];

/// A shape over the ground.
pub(super) struct Shape {
    pub(super) outline: Outline,
    pub(super) source: String,
}

/// All polygons within a node. Those that cannot be read are lost, each with its places.
pub(super) fn shapes(node: Node<'_, '_>, lines: &Lines, lost: &mut Vec<Lost>, findings: &mut Findings) -> Vec<Shape> {
    let mut shapes = Vec::new();
    let mut read_until = 0;
    for polygon in node.descendants().filter(Node::is_element) {
        let range = polygon.range();
        let is_polygon = ["Polygon", "PolygonPatch"].contains(&polygon.tag_name().name());
        if range.start < read_until || !is_polygon {
            continue;
        }
        read_until = range.end;
        let source = lines.place(polygon);
        if MOST_POLYGONS < shapes.len() + lost.len() {
            let wrong = Wrong::at(source, format!("more than {MOST_POLYGONS} polygons in a volume"), "cut it down");
            lost.push(Lost { wrong, places: Vec::new() });
            break;
        }
        let mut pieces = Vec::new();
        let read = border(polygon, lines, &source, &mut pieces);
        let corners = ring(&pieces);
        match read.and_then(|()| outline(&pieces, corners.clone(), &source, findings)) {
            Ok(mut outline) => {
                if let Outline::Polygon { holes, .. } = &mut outline {
                    holes.extend(all(polygon, "interior").filter_map(|it| hole(it, lines, findings)));
                }
                shapes.push(Shape { outline, source });
            }
            Err(wrong) => lost.push(Lost { wrong, places: corners }),
        }
    }
    shapes
}

fn outline(
    pieces: &[Piece],
    mut corners: Vec<LatLon>,
    source: &str,
    findings: &mut Findings,
) -> Result<Outline, Wrong> {
    match pieces {
        [Piece::Arc(Arc { centre, radii_m, sweep_deg, .. })] if 359.99 < sweep_deg.abs() => {
            return shape::circle(*centre, radii_m[0], source);
        }
        _ if pieces.iter().all(|it| matches!(it, Piece::Corner(_))) => {
            return shape::ring(corners, source, findings).map(Outline::polygon);
        }
        _ => {}
    }
    if corners.len() > 1 && corners.first() == corners.last() {
        corners.pop();
    }
    shape::open_ring(corners, source, findings).map(Outline::polygon)
}

/// The corners of a hole. One with an arc is filled: its corners lie outside of the arc, where those of a hole must not be.
fn hole(interior: Node<'_, '_>, lines: &Lines, findings: &mut Findings) -> Option<Vec<LatLon>> {
    let place = lines.place(interior);
    let mut pieces = Vec::new();
    let read = ring_of(interior, lines, &mut pieces).and_then(|()| {
        match pieces.iter().all(|it| matches!(it, Piece::Corner(_))) {
            true => Ok(ring(&pieces)),
            false => Err(Wrong::at(&place, "it has an arc", "")),
        }
    });
    shape::hole(read, &place, findings)
}

/// The pieces of the outer border, up to one that cannot be read.
fn border(polygon: Node<'_, '_>, lines: &Lines, source: &str, pieces: &mut Vec<Piece>) -> Result<(), Wrong> {
    let exterior = polygon.child("exterior").or_else(|| polygon.child("outerBoundaryIs"));
    let exterior = exterior.ok_or_else(|| Wrong::at(source, "a polygon without an outer border", HELP))?;
    ring_of(exterior, lines, pieces)
}

/// The pieces of a border.
fn ring_of(border: Node<'_, '_>, lines: &Lines, pieces: &mut Vec<Piece>) -> Result<(), Wrong> {
    let mut read_until = 0;
    for node in border.descendants().filter(Node::is_element) {
        let range = node.range();
        if range.start < read_until {
            continue;
        }
        let name = node.tag_name().name();
        let at = |message: String| Wrong::at(lines.place(node), message, HELP);
        if node.attribute_of("href").is_some() {
            return Err(at(format!("`{}` is in another place of the file, or in another file", short(name))));
        }
        match name {
            "pos" | "posList" => pieces.extend(positions(node).map_err(at)?.into_iter().map(Piece::Corner)),
            "GeodesicString" | "Geodesic" => {
                let mut last: Option<LatLon> = None;
                for list in node.descendants().filter(|it| it.has_tag_name_of("pos") || it.has_tag_name_of("posList")) {
                    for corner in positions(list).map_err(at)? {
                        let way = last.map_or_else(Vec::new, |it| between(it, corner));
                        pieces.extend(way.into_iter().map(Piece::Corner));
                        last = Some(corner);
                        pieces.push(Piece::Corner(corner));
                        if MOST_PARTS < pieces.len() {
                            return Err(at(format!("a border of more than {MOST_PARTS} parts")));
                        }
                    }
                }
            }
            "CircleByCenterPoint" | "ArcByCenterPoint" => pieces.push(Piece::Arc(arc(node).map_err(at)?)),
            _ if NOT_READ.contains(&name) => return Err(at(format!("a border drawn by `{name}` is not read"))),
            _ => continue,
        }
        if MOST_PARTS < pieces.len() {
            return Err(at(format!("a border of more than {MOST_PARTS} parts")));
        }
        read_until = range.end;
    }
    Ok(())
}

fn arc(node: Node<'_, '_>) -> Result<Arc, String> {
    let position = node.descendants().find(|it| it.has_tag_name_of("pos") || it.has_tag_name_of("posList"));
    let position = position.ok_or("a circle without a centre")?;
    let [centre] = positions(position)?[..] else { return Err("a circle with several centres".into()) };
    let number = |name: &str| -> Result<f64, String> {
        let text = node.child_words(name).ok_or_else(|| format!("`{name}` is missing"))?;
        let value = text.parse().ok().filter(|it: &f64| it.is_finite() && it.abs() < 1e7);
        value.ok_or_else(|| format!("`{name}` is `{}`, expected a number", short(&text)))
    };
    let unit = node.child("radius").and_then(|it| it.attribute_of("uom")).unwrap_or_default();
    let length = LENGTHS.iter().find(|it| it.0.eq_ignore_ascii_case(unit));
    let (_, unit_m) =
        length.ok_or_else(|| format!("the unit of the radius is `{}`, expected m, km or NM", short(unit)))?;
    let radius_m = number("radius")? * unit_m;
    shape::circle(centre, radius_m, "").map_err(|wrong| wrong.message)?;
    let radii_m = [radius_m; 2];
    if node.has_tag_name_of("CircleByCenterPoint") {
        return Ok(Arc { centre, radii_m, from_deg: 0.0, sweep_deg: 360.0 });
    }
    for name in ["startAngle", "endAngle"] {
        let unit = node.child(name).and_then(|it| it.attribute_of("uom")).unwrap_or("deg");
        if !unit.to_ascii_lowercase().ends_with("deg") {
            return Err(format!("the unit of `{name}` is `{}`, expected deg", short(unit)));
        }
    }
    let (from, to) = (number("startAngle")?, number("endAngle")?);
    // Angles begin at the first axis and grow towards the second one: from north to east, or from east to north.
    let (from_deg, sweep_deg) = match axes(position)? {
        Axes::LatitudeFirst => (from, to - from),
        Axes::LongitudeFirst => (90.0 - from, from - to),
    };
    if sweep_deg == 0.0 || 360.0 < sweep_deg.abs() {
        return Err(format!("an arc from {from} to {to} degrees"));
    }
    Ok(Arc { centre, radii_m, from_deg, sweep_deg })
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Axes {
    LatitudeFirst,
    LongitudeFirst,
}

/// The order of the numbers, by the coordinate system on the node or above it. WGS 84 and ETRS89 differ by less than a metre.
fn axes(node: Node<'_, '_>) -> Result<Axes, String> {
    let system = node.ancestors().take(MOST_LEVELS).find_map(|it| it.attribute_of("srsName")).unwrap_or_default();
    let code = system.rsplit([':', '#', '/']).next().unwrap_or_default();
    match code {
        "CRS84" => Ok(Axes::LongitudeFirst),
        // The old form of the name has the order of a map.
        "4326" if system.contains("epsg.xml") => Ok(Axes::LongitudeFirst),
        "" | "4326" | "4258" | "4979" => Ok(Axes::LatitudeFirst),
        _ => Err(format!("the coordinate system `{}` is not read, expected EPSG:4326 or CRS84", short(system))),
    }
}

/// The places of a `pos` or a `posList`.
fn positions(node: Node<'_, '_>) -> Result<Vec<LatLon>, String> {
    let text = node.words();
    let numbers = text.split_whitespace().map(|it| {
        let number = it.parse().ok().filter(|it: &f64| it.is_finite());
        number.ok_or_else(|| format!("found `{}`, expected degrees", short(it)))
    });
    let numbers = numbers.collect::<Result<Vec<f64>, String>>()?;
    let told = node.ancestors().take(MOST_LEVELS).find_map(|it| it.attribute_of("srsDimension"));
    let dimensions = match told {
        None if node.has_tag_name_of("pos") && numbers.len() == 3 => 3,
        None | Some("2") => 2,
        Some("3") => 3,
        Some(other) => return Err(format!("`srsDimension` is `{}`, expected 2 or 3", short(other))),
    };
    if numbers.len() % dimensions != 0 || (node.has_tag_name_of("pos") && numbers.len() != dimensions) {
        return Err(format!("found {} numbers, expected {dimensions} for each place", numbers.len()));
    }
    let axes = axes(node)?;
    let place = |numbers: &[f64]| {
        let [first, second] = [numbers[0], numbers[1]];
        let (latitude, longitude) = if axes == Axes::LatitudeFirst { (first, second) } else { (second, first) };
        LatLon::new(latitude, longitude).map_err(|error| error.to_string())
    };
    numbers.chunks_exact(dimensions).map(place).collect()
}
