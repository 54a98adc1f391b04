//! Rings of corners and circles as JSON files write them, and what can be repaired about them.

use domain::geodesy::LatLon;
use serde_json::Value;

use crate::content::Outline;
use crate::findings::{Findings, Wrong};
use crate::json::Node;

/// How a format orders the two numbers of a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Order {
    /// As GeoJSON does.
    LongitudeFirst,
    /// As QGroundControl does.
    LatitudeFirst,
}

/// A place as a list of two numbers; a third one, a height, is not part of a ring.
pub(crate) fn lat_lon(node: &Node<'_>, order: Order) -> Result<LatLon, Wrong> {
    position(node.value, order).map_err(|message| Wrong::at(&node.place, message, order.help()))
}

/// The place in a list of numbers. A third one is a height, and some publishers add a fourth.
pub(crate) fn position(value: &Value, order: Order) -> Result<LatLon, String> {
    let numbers = value.as_array().map(Vec::as_slice).unwrap_or_default();
    match (numbers, order) {
        ([first, second] | [first, second, _] | [first, second, _, _], _) => {
            match (first.as_f64(), second.as_f64(), order) {
                (Some(longitude), Some(latitude), Order::LongitudeFirst)
                | (Some(latitude), Some(longitude), Order::LatitudeFirst) => {
                    LatLon::new(latitude, longitude).map_err(|error| error.to_string())
                }
                _ => Err("expected a place, two numbers".into()),
            }
        }
        _ => Err("expected a place, two numbers".into()),
    }
}

impl Order {
    fn help(self) -> &'static str {
        match self {
            Order::LongitudeFirst => "longitude comes first in this format",
            Order::LatitudeFirst => "latitude comes first in this format",
        }
    }
}

/// The polygon with these rings, the first of which is its border.
pub(crate) fn polygon(rings: &Node<'_>, findings: &mut Findings) -> Result<Outline, Wrong> {
    let rings = rings.items()?;
    let Some((border, holes)) = rings.split_first() else {
        return Err(Wrong::at("", "a polygon without rings", ""));
    };
    let corners = places(border, Order::LongitudeFirst)?;
    let outline = ring(corners, &border.place, findings)?;
    if is_clockwise(&outline) {
        findings.note(&border.place, "the corners run clockwise, against RFC 7946: read all the same");
    }
    let mut kept = Vec::new();
    for it in holes {
        kept.extend(hole(places(it, Order::LongitudeFirst), &it.place, findings));
    }
    Ok(Outline::Polygon { border: outline, holes: kept })
}

/// The corners of a hole as those of a ring; `None` if it cannot be read or encloses nothing, which is said.
pub(crate) fn hole(corners: Result<Vec<LatLon>, Wrong>, place: &str, findings: &mut Findings) -> Option<Vec<LatLon>> {
    let ring = corners.and_then(|it| ring(it, place, findings));
    ring.map_err(|wrong| findings.note(place, format!("a hole: filled, the area covers it ({})", wrong.message))).ok()
}

/// A list of places.
pub(crate) fn places(node: &Node<'_>, order: Order) -> Result<Vec<LatLon>, Wrong> {
    let list = node.value.as_array().ok_or_else(|| Wrong::at(&node.place, "expected a list of places", ""))?;
    let place = |(index, value)| {
        position(value, order).map_err(|message| Wrong::at(format!("{}/{index}", node.place), message, order.help()))
    };
    list.iter().enumerate().map(place).collect()
}

/// The corners of a closed ring, each once. A ring that is not closed is closed, and that is said.
pub(crate) fn ring(mut corners: Vec<LatLon>, place: &str, findings: &mut Findings) -> Result<Vec<LatLon>, Wrong> {
    if corners.len() > 1 && corners.first() == corners.last() {
        corners.pop();
    } else if corners.len() > 2 {
        findings.note(place, "the ring does not end where it begins: it is closed");
    }
    open_ring(corners, place, findings)
}

/// The corners of a ring that is not closed in its format, each once.
pub(crate) fn open_ring(mut corners: Vec<LatLon>, place: &str, findings: &mut Findings) -> Result<Vec<LatLon>, Wrong> {
    let before = corners.len();
    corners.dedup();
    if corners.len() < before {
        findings.note(place, "a corner is there twice in a row: read once");
    }
    if corners.len() < 3 {
        let message = format!("a ring of {} different corners has no area", corners.len());
        return Err(Wrong::at(place, message, "a ring has at least three corners"));
    }
    if edges(&corners).any(|(a, b)| 180.0 < (b.longitude_deg() - a.longitude_deg()).abs()) {
        findings.note(
            place,
            "the ring crosses the antimeridian, where RFC 7946 asks to cut it: it is read the short way round",
        );
    }
    Ok(corners)
}

/// The edges of a ring that is not closed.
pub(crate) fn edges(corners: &[LatLon]) -> impl Iterator<Item = (LatLon, LatLon)> {
    corners.iter().copied().zip(corners.iter().copied().cycle().skip(1))
}

/// The way from one longitude to another, the short way round.
pub(crate) fn turn_deg(from: LatLon, to: LatLon) -> f64 {
    (to.longitude_deg() - from.longitude_deg() + 540.0).rem_euclid(360.0) - 180.0
}

/// Whether a ring runs clockwise, seen from above: the shoelace formula, with longitudes counted on from the first corner.
pub(crate) fn is_clockwise(corners: &[LatLon]) -> bool {
    let Some(first) = corners.first() else { return false };
    let doubled: f64 = edges(corners)
        .map(|(a, b)| turn_deg(*first, a) * b.latitude_deg() - turn_deg(*first, b) * a.latitude_deg())
        .sum();
    doubled < 0.0
}

/// A circle.
pub(crate) fn circle(centre: LatLon, radius_m: f64, place: &str) -> Result<Outline, Wrong> {
    if 0.0 < radius_m && radius_m <= 1e6 {
        return Ok(Outline::Circle { centre, radius_m });
    }
    Err(Wrong::at(place, format!("a circle with a radius of {radius_m} m"), "expected more than 0 m, at most 1000 km"))
}
