//! Borders with arcs of circles, as AIXM and OpenAir draw them, as rings of corners that contain what the arcs enclose.

use domain::geodesy::{LatLon, LocalFrame};
use domain::geometry::Ned;

use crate::shape;

/// Between the corners that stand for an arc, in degrees. They lie at most 0.22 % of the radius beyond the arc.
const STEP_DEG: f64 = 7.5;
/// An arc and the corner before or after it are published with rounding: nearer than this they are the same place, in metres.
const SAME_M: f64 = 100.0;
/// The shortest line along a geodesic that is cut into pieces, in metres: it bends by 3 m at 54 degrees of latitude.
const PIECE_M: f64 = 10_000.0;
/// The most pieces of one line.
const MOST_PIECES: f64 = 100.0;

/// The most parts of a border: a zone has a hundredth. A file of some megabytes could otherwise take all memory.
pub(crate) const MOST_PARTS: usize = 20_000;

/// A part of a border.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Piece {
    Corner(LatLon),
    Arc(Arc),
}

/// A part of a circle.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Arc {
    pub(crate) centre: LatLon,
    /// Where it begins and where it ends. They differ where an arc is published by its ends.
    pub(crate) radii_m: [f64; 2],
    /// From the centre to where it begins, clockwise from north.
    pub(crate) from_deg: f64,
    /// On from there, clockwise; negative: counterclockwise.
    pub(crate) sweep_deg: f64,
}

/// The place at a distance from another one in a direction, clockwise from north.
pub(crate) fn place_at(from: LatLon, distance_m: f64, bearing_deg: f64) -> LatLon {
    let (sin, cos) = bearing_deg.to_radians().sin_cos();
    LocalFrame::at(from).lat_lon(Ned::new(distance_m * cos, distance_m * sin, 0.0))
}

/// The distance and the direction of a place from another one.
pub(crate) fn seen_from(from: LatLon, to: LatLon) -> (f64, f64) {
    let local = LocalFrame::at(from).local(to);
    (local.horizontal_distance_m(Ned::default()), local.east_m.atan2(local.north_m).to_degrees())
}

/// The places between two corners of a line along the geodesic, which is not straight in latitude and longitude.
pub(crate) fn between(a: LatLon, b: LatLon) -> Vec<LatLon> {
    let (distance_m, bearing_deg) = seen_from(a, b);
    let count = (distance_m / PIECE_M).ceil().clamp(1.0, MOST_PIECES) as u32;
    (1..count).map(|it| place_at(a, distance_m * f64::from(it) / f64::from(count), bearing_deg)).collect()
}

/// The corners of a border, which is not closed.
pub(crate) fn ring(pieces: &[Piece]) -> Vec<LatLon> {
    // On which side of an arc the area lies is known when the border is.
    let on_arcs = corners(pieces, None);
    if pieces.iter().all(|it| matches!(it, Piece::Corner(_))) {
        return on_arcs;
    }
    corners(pieces, Some(shape::is_clockwise(&on_arcs)))
}

fn corners(pieces: &[Piece], is_clockwise: Option<bool>) -> Vec<LatLon> {
    let count = pieces.len();
    let corner_at = |index: usize| match pieces.get(index) {
        Some(Piece::Corner(it)) => Some(*it),
        _ => None,
    };
    let mut ring = Vec::new();
    for (index, piece) in pieces.iter().enumerate() {
        match piece {
            Piece::Corner(it) => ring.push(*it),
            Piece::Arc(arc) => {
                let is_outside = is_clockwise.is_some_and(|it| it == (0.0 < arc.sweep_deg));
                let is_there =
                    |end: LatLon, neighbour: Option<LatLon>| neighbour.is_some_and(|it| it.distance_m(end) < SAME_M);
                let [begin, end] = [arc.at(0.0, 1.0), arc.at(1.0, 1.0)];
                if !is_there(begin, corner_at((index + count - 1) % count)) {
                    ring.push(begin);
                }
                ring.extend(arc.inner(is_outside));
                if !is_there(end, corner_at((index + 1) % count)) {
                    ring.push(end);
                }
            }
        }
    }
    ring.dedup();
    ring
}

impl Arc {
    /// The place at a fraction of the arc, and at a multiple of its radius.
    fn at(&self, fraction: f64, times: f64) -> LatLon {
        let radius_m = self.radii_m[0] + (self.radii_m[1] - self.radii_m[0]) * fraction;
        place_at(self.centre, radius_m * times, self.from_deg + self.sweep_deg * fraction)
    }

    /// The corners between its ends: beyond the arc where the area is on the side of the centre, so that the lines between them touch the
    /// arc from outside; else on the arc, so that the lines cut it off.
    fn inner(&self, is_outside: bool) -> Vec<LatLon> {
        let count = (self.sweep_deg.abs() / STEP_DEG).ceil().max(1.0);
        let half = (self.sweep_deg.abs() / count / 2.0).to_radians();
        let steps = count as u32;
        if is_outside {
            (0..steps).map(|it| self.at((f64::from(it) + 0.5) / count, 1.0 / half.cos())).collect()
        } else {
            (1..steps).map(|it| self.at(f64::from(it) / count, 1.0)).collect()
        }
    }
}
