//! Outlines in the local frame.

use std::f64::consts::PI;

use domain::area::{AREAS_END_M, Area, AreaKind};
use domain::geodesy::{LatLon, LocalFrame};
use domain::geometry::Ned;
use geo::{
    Area as _, BooleanOps as _, ConvexHull as _, Coord, Distance as _, Euclidean, LineString, Point, Polygon, Rect,
};

use crate::content::Outline;
use crate::findings::{Findings, Wrong};
use crate::shape;

/// The sides of the polygon that stands for a circle.
const SIDES: u32 = 24;
/// Polygons round circles are drawn with this much more radius, for what a plane differs from the Earth: at 100 km from the
/// origin lengths are wrong by less than half of that.
const PLANE: f64 = 1e-4;
/// A line that is straight in latitude and longitude is cut into pieces until each is this near to one that is straight in
/// the local frame, in metres.
const BEND_M: f64 = 0.5;
/// The most pieces of one line.
const MOST_PIECES: f64 = 100.0;
/// The most corners of one zone, its holes included: more are a drawing, not a border that a way can be planned round.
const MOST_CORNERS: usize = 2_000;
/// A smaller zone is a mistake, in square metres.
const LEAST_AREA_M2: f64 = 1.0;
/// The mean radius of the Earth, in metres (IUGG). Only for how much a line bends.
const EARTH_M: f64 = 6_371_008.8;

/// How far from the origin zones matter: as far as objectives may lie, in metres.
pub(crate) const REACH_M: f64 = 100_000.0;

/// Which side of an outline is to be kept from: a polygon for a circle errs towards it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// The polygon contains the circle. Its corners are at most 0.87 % of the radius outside of the circle:
    /// 1 / cos(pi / 24) - 1.
    Contain,
    /// The circle contains the polygon.
    Inscribe,
}

/// The polygon of an outline; x is east, y is north, and the first corner is not repeated.
pub(crate) fn polygon(outline: &Outline, frame: &LocalFrame, side: Side) -> Polygon<f64> {
    let ring = |corners: &Vec<LatLon>| -> LineString {
        shape::edges(corners).flat_map(|(a, b)| pieces(a, b)).map(|it| coord(frame.local(it))).collect()
    };
    match outline {
        Outline::Polygon { border, holes } => Polygon::new(ring(border), holes.iter().map(ring).collect()),
        Outline::Circle { centre, radius_m } => {
            let centre = frame.local(*centre);
            let radius_m = match side {
                Side::Contain => radius_m * (1.0 + PLANE) / (PI / f64::from(SIDES)).cos(),
                Side::Inscribe => radius_m * (1.0 - PLANE),
            };
            circle(centre, radius_m)
        }
    }
}

fn coord(at: Ned) -> Coord {
    Coord { x: at.east_m, y: at.north_m }
}

/// The polygon with its corners at this distance from a place.
fn circle(centre: Ned, radius_m: f64) -> Polygon<f64> {
    let corner = |side| {
        let (sin, cos) = (2.0 * PI * f64::from(side) / f64::from(SIDES)).sin_cos();
        (centre.east_m + radius_m * sin, centre.north_m + radius_m * cos)
    };
    Polygon::new((0..SIDES).map(corner).collect(), vec![])
}

/// The places from `a` on, before `b`, between which a line that is straight in latitude and longitude is straight in the
/// local frame as well. A parallel of that length bends by its square times the tangent of the latitude, over eight radii.
fn pieces(a: LatLon, b: LatLon) -> Vec<LatLon> {
    let turn_deg = shape::turn_deg(a, b);
    let latitude = a.latitude_deg().abs().max(b.latitude_deg().abs()).min(89.0).to_radians();
    let length_m = turn_deg.to_radians() * latitude.cos() * EARTH_M;
    let bend_m = length_m * length_m * latitude.tan() / (8.0 * EARTH_M);
    let count = (bend_m / BEND_M).sqrt().ceil().clamp(1.0, MOST_PIECES) as u32;
    let at = |piece| {
        let fraction = f64::from(piece) / f64::from(count);
        let latitude = a.latitude_deg() + (b.latitude_deg() - a.latitude_deg()) * fraction;
        let longitude = (a.longitude_deg() + turn_deg * fraction + 540.0).rem_euclid(360.0) - 180.0;
        LatLon::new(latitude, longitude).unwrap_or(a)
    };
    std::iter::once(a).chain((1..count).map(at)).collect()
}

/// Whether some of the polygon is within reach of the origin.
pub(crate) fn is_in_reach(polygon: &Polygon<f64>) -> bool {
    Euclidean.distance(&Point::new(0.0, 0.0), polygon) <= REACH_M
}

/// Whether all of an outline is certainly out of reach of the origin, by its latitudes or longitudes alone.
pub(crate) fn is_far(outline: &Outline, origin: LatLon) -> bool {
    /// Half as far again as the reach: degrees differ by less than that in length.
    const FAR_M: f64 = 1.5 * REACH_M;
    let (corners, radius_m) = match outline {
        Outline::Polygon { border, .. } => (border.as_slice(), 0.0),
        Outline::Circle { centre, radius_m } => (std::slice::from_ref(centre), *radius_m),
    };
    // Of the sphere: the way to the nearest place of a parallel, and of a meridian less than a quarter round.
    let far = (FAR_M + radius_m) / EARTH_M;
    let turn_deg = (far.sin() / origin.latitude_deg().to_radians().cos()).asin().to_degrees();
    let all = |is_beyond: &dyn Fn(LatLon) -> bool| corners.iter().all(|it| is_beyond(*it));
    let north_deg = |it: LatLon| it.latitude_deg() - origin.latitude_deg();
    let east_deg = |it: LatLon| shape::turn_deg(origin, it);
    let far_deg = far.to_degrees();
    all(&|it| far_deg < north_deg(it))
        || all(&|it| north_deg(it) < -far_deg)
        || all(&|it| turn_deg < east_deg(it) && east_deg(it) < 90.0)
        || all(&|it| east_deg(it) < -turn_deg && -90.0 < east_deg(it))
}

/// The same outline with latitudes and longitudes exchanged, if there are such places.
pub(crate) fn exchanged(outline: &Outline) -> Option<Outline> {
    let exchange = |it: &LatLon| LatLon::new(it.longitude_deg(), it.latitude_deg()).ok();
    Some(match outline {
        Outline::Polygon { border, .. } => {
            Outline::Polygon { border: border.iter().map(exchange).collect::<Option<_>>()?, holes: Vec::new() }
        }
        Outline::Circle { centre, radius_m } => Outline::Circle { centre: exchange(centre)?, radius_m: *radius_m },
    })
}

/// The polygon without holes that a mission file does not take: the area covers them, which is said. Refuses a border that crosses
/// itself or encloses nothing, and too many corners.
pub(crate) fn checked(polygon: Polygon<f64>, source: &str, findings: &mut Findings) -> Result<Polygon<f64>, Wrong> {
    let (border, holes) = polygon.into_inner();
    let count = border.0.len() + holes.iter().map(|it| it.0.len()).sum::<usize>();
    if MOST_CORNERS < count {
        let message = format!("a zone of {count} corners, expected at most {MOST_CORNERS}");
        return Err(Wrong::at(source, message, "simplify it outwards, or leave it out"));
    }
    let border = Polygon::new(border, vec![]);
    // Of the hull: the halves of a ring that crosses itself may cancel each other.
    let area_m2 = border.convex_hull().unsigned_area();
    if area_m2 < LEAST_AREA_M2 {
        let message = format!("a ring that encloses {area_m2:.1} square metres");
        return Err(Wrong::at(source, message, "correct its corners, or leave the zone out"));
    }
    let mut area = area_of(&border);
    if !area.is_simple() {
        return Err(Wrong::at(
            source,
            "the ring crosses or touches itself",
            "list its corners in order round the zone",
        ));
    }
    for hole in holes {
        let corners = corners(&hole);
        if Polygon::new(hole, vec![]).unsigned_area() < LEAST_AREA_M2 {
            findings.note(source, "a hole of less than a square metre: filled, the area covers it");
        } else if area.add_hole(corners).is_err() {
            findings.note(source, "a hole that crosses or touches a border: filled, the area covers it");
        }
    }
    let polygon = area.polygon();
    if is_cut(&polygon) {
        findings.note(source, "it is cut off 140 km from the take-off point");
    }
    Ok(polygon)
}

/// All that the corners of a polygon enclose, whatever their order: its convex hull, or a circle where that has no area.
pub(crate) fn hull(polygon: &Polygon<f64>) -> Polygon<f64> {
    use geo::{BoundingRect as _, Simplify as _};
    let hull = polygon.convex_hull();
    if LEAST_AREA_M2 <= hull.unsigned_area() {
        // Its corners are then so near to each other that a metre is nothing.
        return if hull.exterior().0.len() <= MOST_CORNERS { hull } else { hull.simplify(1.0) };
    }
    let Some(bounds) = polygon.bounding_rect() else { return hull };
    let centre = Ned::new(bounds.center().y, bounds.center().x, 0.0);
    circle(centre, bounds.width().hypot(bounds.height()) / 2.0 + 1.0)
}

/// Whether some of the polygon lies beyond where a mission file ends.
fn is_cut(polygon: &Polygon<f64>) -> bool {
    !polygon.exterior().coords().all(|it| it.x.abs() <= AREAS_END_M && it.y.abs() <= AREAS_END_M)
}

/// The polygon, cut off where a mission file ends: none, one or several parts.
pub(crate) fn cut(polygon: Polygon<f64>) -> Vec<Polygon<f64>> {
    if is_cut(&polygon) { polygon.intersection(&square()).0 } else { vec![polygon] }
}

/// What is kept out of round a fence that is not left: all around as far as zones matter, with the fence as a hole.
pub(crate) fn frame_round(fence: &Polygon<f64>) -> Vec<Polygon<f64>> {
    square().difference(fence).0
}

/// What a mission file has room for.
fn square() -> Polygon<f64> {
    Rect::new((-AREAS_END_M, -AREAS_END_M), (AREAS_END_M, AREAS_END_M)).to_polygon()
}

/// The corners of a ring, the first one not repeated.
pub(crate) fn corners(ring: &LineString<f64>) -> Vec<Ned> {
    let count = ring.0.len().saturating_sub(1);
    ring.coords().take(count).map(|it| Ned::new(it.y, it.x, 0.0)).collect()
}

/// The area of a polygon, for the rules about its shape.
pub(crate) fn area_of(polygon: &Polygon<f64>) -> Area {
    let holes = polygon.interiors().iter().map(corners).collect();
    Area { holes, ..Area::new("", AreaKind::KeepOut, corners(polygon.exterior())) }
}
