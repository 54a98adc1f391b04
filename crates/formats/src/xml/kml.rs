//! Areas from KML 2.2 (OGC 07-147r2) and the extensions that Google Earth writes: the polygons of all placemarks, and circles round
//! points with a radius. KML says nothing about rules of the air, so they are keep-out areas, which is the safe side, unless the
//! placemark's `ExtendedData` has a `kind`.
//!
//! Whatever has a place is read wherever it stands, with what the last placemark round it says. How things look is passed over.

use domain::geodesy::LatLon;
use roxmltree::{Document, Node};

use super::{Lines, LocalName as _, all};
use crate::applicability::{Side, checked};
use crate::content::{Content, Doubt, Height, Lost, Outline, Period, Reference, Rule, Unused, Window, Zone};
use crate::findings::{Findings, Wrong};
use crate::json::short;
use crate::shape;
use coordinates::Position;

mod coordinates;
mod dates;

/// What is shown on a map, and limits nothing.
const PICTURES: [&str; 5] = ["GroundOverlay", "ScreenOverlay", "PhotoOverlay", "Tour", "Update"];
const LINES: [&str; 5] = ["LineString", "Track", "MultiTrack", "Model", "LinearRing"];
const RADIUS: [&str; 4] = ["radius_m", "radius", "buffer_m", "buffer"];

/// Whether a document with this root is KML. Some programs write a part of one.
pub(super) fn is_root(root: Node<'_, '_>) -> bool {
    ["kml", "Document", "Folder", "Placemark"].contains(&root.tag_name().name())
}

/// When something applies, and what of that is not understood.
#[derive(Debug, Clone, Default)]
struct Time {
    window: Window,
    doubt: Option<Doubt>,
}

/// What a placemark says of its shapes.
#[derive(Debug, Clone)]
struct Placemark {
    source: String,
    name: String,
    kind: Option<String>,
    radius: Option<String>,
    has_polygon: bool,
    remarks: Vec<String>,
    /// What is said about the placemark as a whole has been said.
    is_noted: bool,
}

/// An element whose parts are being read.
struct Frame {
    /// Its last byte lies before this.
    end: usize,
    time: Time,
    placemark: Option<Placemark>,
}

/// Reads a document; `beside` are the names of the KML files in the same archive.
pub(super) fn read(
    document: &Document<'_>,
    lines: &Lines,
    beside: &[&str],
    content: &mut Content,
    findings: &mut Findings,
) {
    let mut reader = Reader { text: document.input_text(), lines, content, findings };
    let mut frames: Vec<Frame> = Vec::new();
    // What is before this belongs to something that was read.
    let mut read_until = 0;
    for node in document.descendants().filter(Node::is_element) {
        let range = node.range();
        if range.start < read_until {
            continue;
        }
        while frames.last().is_some_and(|it| it.end <= range.start) {
            frames.pop();
        }
        let name = node.tag_name().name();
        match name {
            "Document" | "Folder" | "Placemark" => {
                let time = reader.time(node).or_else(|| frames.last().map(|it| it.time.clone())).unwrap_or_default();
                let placemark = (name == "Placemark").then(|| reader.placemark(node));
                frames.push(Frame { end: range.end, time, placemark });
                continue;
            }
            "Polygon" => reader.polygon(node, frames.last_mut()),
            "Point" => reader.point(node, frames.last_mut()),
            _ if LINES.contains(&name) => reader.line(node, frames.last_mut()),
            "NetworkLink" => reader.link(node, beside),
            _ if PICTURES.contains(&name) => {
                let text = format!("{name} has no counterpart: left out");
                reader.findings.note(&lines.place(node), text);
            }
            _ => continue,
        }
        read_until = range.end;
        if let Some(wrong) = reader.content.too_many(|| lines.place(node)) {
            reader.findings.wrong(wrong);
            break;
        }
    }
}

struct Reader<'a> {
    text: &'a str,
    lines: &'a Lines,
    content: &'a mut Content,
    findings: &'a mut Findings,
}

impl Reader<'_> {
    /// When the parts of an element apply, if it says so.
    fn time(&mut self, node: Node<'_, '_>) -> Option<Time> {
        if let Some(stamp) = node.child("TimeStamp") {
            let text = "a TimeStamp says when something was seen, not when it applies: the areas always apply";
            self.findings.note(&self.lines.place(stamp), text);
        }
        let span = node.child("TimeSpan")?;
        let place = self.lines.place(span);
        let bound = |name, side| {
            let Some(text) = span.child_words(name) else { return Ok(None) };
            dates::bound(&text, side).map_err(|message| Wrong::at(&place, message, ""))
        };
        let window = || -> Result<Window, Wrong> {
            let window = Window { from_utc_ms: bound("begin", Side::From)?, until_utc_ms: bound("end", Side::Until)? };
            checked(window, &place)
        };
        Some(match window() {
            Ok(window) => Time { window, doubt: None },
            Err(Wrong { place, message, .. }) => {
                Time { window: Window::default(), doubt: Some(Doubt { place, message }) }
            }
        })
    }

    fn placemark(&self, node: Node<'_, '_>) -> Placemark {
        let data = node.child("ExtendedData");
        let value = |names: &[&str]| {
            let schema = data.into_iter().flat_map(|it| all(it, "SchemaData")).flat_map(|it| all(it, "SimpleData"));
            let plain = data.into_iter().flat_map(|it| all(it, "Data").map(|it| (it, it.child("value"))));
            let mut values = plain.filter_map(|(data, value)| Some((data, value?))).chain(schema.map(|it| (it, it)));
            let found = values.find(|(data, _)| data.attribute("name").is_some_and(|it| names.contains(&it)));
            found.map(|(_, value)| value.words()).filter(|it| !it.is_empty())
        };
        Placemark {
            source: self.lines.place(node),
            name: node.child_words("name").unwrap_or_else(|| "placemark".into()),
            kind: value(&["kind"]),
            radius: value(&RADIUS),
            has_polygon: all(node, "MultiGeometry")
                .flat_map(|it| it.children())
                .chain(node.children())
                .any(|it| it.has_tag_name_of("Polygon")),
            remarks: node.child_words("description").map(|it| format!("Description: {it}")).into_iter().collect(),
            is_noted: false,
        }
    }

    /// A zone with what the placemark round it says.
    fn zone(&mut self, outline: Outline, source: String, frame: Option<&mut Frame>) -> Zone {
        let mut zone = Zone::always("placemark", Rule::KeepOut, outline, source);
        let Some(Frame { time, placemark, .. }) = frame else { return zone };
        zone.periods = vec![Period { window: time.window, hours: None }];
        zone.doubts.extend(time.doubt.clone());
        let Some(placemark) = placemark else { return zone };
        zone.name.clone_from(&placemark.name);
        zone.remarks.clone_from(&placemark.remarks);
        match placemark.kind.as_deref() {
            Some("keep-out") => {}
            Some("permission") => zone.rule = Rule::Permission,
            Some(other) => {
                let message = format!("`kind` is `{}`, expected keep-out or permission", short(other));
                zone.doubts.push(Doubt { place: placemark.source.clone(), message });
            }
            None if !placemark.is_noted => {
                let text = "a placemark without `kind`: read as a keep-out area, the safe side";
                self.findings.note(&placemark.source, text);
                placemark.is_noted = true;
            }
            None => {}
        }
        zone
    }

    fn polygon(&mut self, node: Node<'_, '_>, mut frame: Option<&mut Frame>) {
        let source = self.lines.place(node);
        let mut holes = Vec::new();
        for hole in all(node, "innerBoundaryIs").flat_map(|it| all(it, "LinearRing")) {
            let place = self.lines.place(hole);
            let mut positions = Vec::new();
            let read = self.positions(hole, &place, &mut positions);
            let corners = read.map(|()| positions.iter().map(|it| it.at).collect());
            holes.extend(shape::hole(corners, &place, self.findings));
        }
        let rings: Vec<_> = all(node, "outerBoundaryIs").flat_map(|it| all(it, "LinearRing")).collect();
        if rings.is_empty() {
            let wrong = Wrong::at(source, "a polygon without an outer border", "correct it, or leave it out");
            self.content.lost.push(Lost { wrong, places: Vec::new() });
            return;
        }
        for ring in rings {
            let Some((corners, highest_m)) = self.ring(ring, &source) else { continue };
            let outline = Outline::Polygon { border: corners, holes: holes.clone() };
            let mut zone = self.zone(outline, source.clone(), frame.as_deref_mut());
            match upper(node, highest_m) {
                Ok((upper, said)) => {
                    zone.upper = upper;
                    if let Some(said) = said {
                        self.findings.note(&source, said);
                    }
                }
                Err(message) => zone.doubts.push(Doubt { place: source.clone(), message }),
            }
            self.content.zones.push(zone);
        }
    }

    /// The corners of a ring and the highest height in it; without them the zone is lost.
    fn ring(&mut self, node: Node<'_, '_>, source: &str) -> Option<(Vec<LatLon>, f64)> {
        let mut positions = Vec::new();
        let read = self.positions(node, source, &mut positions);
        let corners: Vec<LatLon> = positions.iter().map(|it| it.at).collect();
        let highest_m = positions.iter().map(|it| it.height_m).fold(f64::NEG_INFINITY, f64::max);
        match read.and_then(|()| shape::ring(corners.clone(), source, self.findings)) {
            Ok(ring) => Some((ring, highest_m)),
            Err(wrong) => {
                self.content.lost.push(Lost { wrong, places: corners });
                None
            }
        }
    }

    /// The positions in the `coordinates` of a node, up to one that cannot be read.
    fn positions(&self, node: Node<'_, '_>, source: &str, positions: &mut Vec<Position>) -> Result<(), Wrong> {
        const HELP: &str = "coordinates are longitude,latitude[,height], separated by spaces";
        let Some(list) = node.child("coordinates") else {
            return Err(Wrong::at(source, "it has no coordinates", HELP));
        };
        for tuple in coordinates::tuples(&list.words()) {
            let read = coordinates::position(tuple).map_err(|message| {
                let range = list.range();
                let ahead = self.text.get(range.clone()).and_then(|it| it.find(tuple)).unwrap_or_default();
                Wrong::at(self.lines.place_at(range.start + ahead), message, HELP)
            });
            positions.push(read?);
        }
        Ok(())
    }

    fn point(&mut self, node: Node<'_, '_>, frame: Option<&mut Frame>) {
        let source = self.lines.place(node);
        let placemark = frame.as_ref().and_then(|it| it.placemark.as_ref());
        let Some(radius) = placemark.and_then(|it| it.radius.clone()) else {
            // Where the name of a polygon is shown.
            if placemark.is_some_and(|it| it.has_polygon) {
                return self.findings.note(&source, "a Point beside a polygon is its label: left out");
            }
            return self.unused("Point", source);
        };
        let mut positions = Vec::new();
        let read = self.positions(node, &source, &mut positions);
        let places: Vec<LatLon> = positions.iter().map(|it| it.at).collect();
        let circle = || {
            read?;
            let [centre] = places.as_slice() else { return Err(Wrong::at(&source, "a point with several places", "")) };
            let number = radius.parse().map_err(|_| {
                Wrong::at(&source, format!("its radius is `{}`, expected metres", short(&radius)), "write a number")
            });
            shape::circle(*centre, number?, &source)
        };
        match circle() {
            Ok(outline) => {
                let zone = self.zone(outline, source, frame);
                self.content.zones.push(zone);
            }
            Err(wrong) => self.content.lost.push(Lost { wrong, places }),
        }
    }

    /// A line. A closed ring is one as well; it is drawn where an area is meant.
    fn line(&mut self, node: Node<'_, '_>, frame: Option<&mut Frame>) {
        let (name, source) = (node.tag_name().name(), self.lines.place(node));
        let mut positions = Vec::new();
        let is_read = name == "LinearRing" && self.positions(node, &source, &mut positions).is_ok();
        let is_closed = positions.len() > 3 && positions.first().map(|it| it.at) == positions.last().map(|it| it.at);
        let has_radius = frame.as_ref().and_then(|it| it.placemark.as_ref()).is_some_and(|it| it.radius.is_some());
        if is_read && is_closed {
            if let Some((corners, _)) = self.ring(node, &source) {
                let text = "a LinearRing is a line; as it is closed, it is read as the border of an area";
                self.findings.note(&source, text);
                let zone = self.zone(Outline::polygon(corners), source, frame);
                self.content.zones.push(zone);
            }
        } else if has_radius {
            let wrong = Wrong::at(source, format!("{name} with a radius"), "give it as a polygon");
            self.content.lost.push(Lost { wrong, places: positions.iter().map(|it| it.at).collect() });
        } else {
            self.unused(name, source);
        }
    }

    fn unused(&mut self, what: &str, source: String) {
        self.content.unused.push(Unused { what: what.to_owned(), source });
    }

    /// A link to another file, whose places nobody here knows.
    fn link(&mut self, node: Node<'_, '_>, beside: &[&str]) {
        let address = node.child("Link").or_else(|| node.child("Url")).and_then(|it| it.child_words("href"));
        let address = address.unwrap_or_default();
        if !beside.contains(&address.trim_start_matches("./")) {
            let message = format!("a NetworkLink: its places are in another file, `{}`", short(&address));
            self.findings.wrong(Wrong::at(
                self.lines.place(node),
                message,
                "download that file and give it with --areas",
            ));
        }
    }
}

/// Up to where a polygon reaches, and what is to be said about it.
fn upper(polygon: Node<'_, '_>, highest_m: f64) -> Result<(Option<Height>, Option<&'static str>), String> {
    let above = match polygon.child_words("altitudeMode").as_deref() {
        None | Some("clampToGround" | "clampToSeaFloor") => return Ok((None, None)),
        Some("relativeToGround") => Reference::Ground,
        Some("absolute") => Reference::SeaLevel,
        Some("relativeToSeaFloor") => {
            return Ok((
                None,
                Some("a height above the sea floor has no counterpart: the area has no limits of height"),
            ));
        }
        Some(other) => return Err(format!("altitude mode `{}` is not known", short(other))),
    };
    let is_extruded = ["1", "true"].contains(&polygon.child_words("extrude").unwrap_or_default().as_str());
    Ok(match is_extruded {
        false => (
            None,
            Some("a polygon in the air that is not extruded has no counterpart: the area has no limits of height"),
        ),
        // A polygon that was only drawn on the map.
        true if highest_m <= 0.0 => {
            (None, Some("its corners have no heights above 0: the area has no limits of height"))
        }
        true => (Some(Height { metres: highest_m, above }), None),
    })
}
