//! Outlines in the local frame.

use std::f64::consts::PI;

use domain::geodesy::{LatLon, LocalFrame};
use domain::geometry::Ned;
use geo::{
    Area as _, BooleanOps as _, Contains as _, ConvexHull as _, Distance as _, Euclidean, LineString, Point, Polygon,
    Rect,
};

use crate::content::Outline;
use crate::findings::Wrong;
use crate::shape;

/// The sides of the polygon that stands for a circle.
const SIDES: u32 = 24;
/// Polygons round circles are drawn with this much more radius, for what a plane differs from the Earth: at 100 km from the
/// origin lengths are wrong by less than half of it.
const PLANE: f64 = 1e-4;
/// A line that is straight in latitude and longitude is cut into pieces until each is this near to one that is straight in
/// the local frame, in metres.
const BEND_M: f64 = 0.5;
/// The most pieces of one line.
const MOST_PIECES: f64 = 100.0;
/// The most corners of one zone: more are a drawing, not a border that a way can be planned round.
const MOST_CORNERS: usize = 2_000;
/// A smaller zone is a mistake, in square metres.
const LEAST_AREA_M2: f64 = 1.0;
/// The mean radius of the Earth, in metres (IUGG). Only for how much a line bends.
const EARTH_M: f64 = 6_371_008.8;

/// How far from the origin zones matter: as far as objectives may lie, in metres.
pub(crate) const REACH_M: f64 = 100_000.0;
/// Zones are cut off at this distance north, south, east and west, in metres; a mission file takes corners to 200 km.
const CUT_M: f64 = 140_000.0;

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
    let corners: Vec<Ned> = match outline {
        Outline::Polygon(corners) => {
            shape::edges(corners).flat_map(|(a, b)| pieces(a, b)).map(|it| frame.local(it)).collect()
        }
        Outline::Circle { centre, radius_m } => {
            let centre = frame.local(*centre);
            let radius_m = match side {
                Side::Contain => radius_m * (1.0 + PLANE) / (PI / f64::from(SIDES)).cos(),
                Side::Inscribe => radius_m * (1.0 - PLANE),
            };
            return circle(centre, radius_m);
        }
    };
    Polygon::new(corners.iter().map(|it| (it.east_m, it.north_m)).collect(), vec![])
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
    let origin = Point::new(0.0, 0.0);
    polygon.contains(&origin) || Euclidean.distance(&origin, polygon.exterior()) <= REACH_M
}

/// Whether all of an outline is certainly out of reach of the origin, by its latitudes or longitudes alone.
pub(crate) fn is_far(outline: &Outline, origin: LatLon) -> bool {
    /// Half as far again as the reach: degrees differ by less than that in length.
    const FAR_M: f64 = 1.5 * REACH_M;
    let (corners, radius_m) = match outline {
        Outline::Polygon(corners) => (corners.as_slice(), 0.0),
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
        Outline::Polygon(corners) => Outline::Polygon(corners.iter().map(exchange).collect::<Option<_>>()?),
        Outline::Circle { centre, radius_m } => Outline::Circle { centre: exchange(centre)?, radius_m: *radius_m },
    })
}

/// Refuses a ring that crosses itself, encloses nothing, or has too many corners.
pub(crate) fn checked(polygon: &Polygon<f64>, source: &str) -> Result<(), Wrong> {
    let count = polygon.exterior().0.len();
    if MOST_CORNERS < count {
        let message = format!("a ring of {count} corners, expected at most {MOST_CORNERS}");
        return Err(Wrong::at(source, message, "simplify it outwards, or leave it out"));
    }
    // Of the hull: the halves of a ring that crosses itself may cancel each other.
    let area_m2 = polygon.convex_hull().unsigned_area();
    if area_m2 < LEAST_AREA_M2 {
        let message = format!("a ring that encloses {area_m2:.1} square metres");
        return Err(Wrong::at(source, message, "correct its corners, or leave the zone out"));
    }
    if !area_of(corners(polygon.exterior())).is_simple() {
        return Err(Wrong::at(
            source,
            "the ring crosses or touches itself",
            "list its corners in order round the zone",
        ));
    }
    Ok(())
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

/// The polygon, cut off where a mission file ends: none, one or several parts, and whether something was cut.
pub(crate) fn cut(polygon: Polygon<f64>) -> (Vec<Polygon<f64>>, bool) {
    let is_near = |it: &geo::Coord| it.x.abs() <= CUT_M && it.y.abs() <= CUT_M;
    if polygon.exterior().coords().all(is_near) {
        return (vec![polygon], false);
    }
    let square = Rect::new((-CUT_M, -CUT_M), (CUT_M, CUT_M)).to_polygon();
    (polygon.intersection(&square).0, true)
}

/// A keep-out frame round a fence that is not left: two halves, since an area has no hole. The halves overlap, so that no way
/// leads between them.
pub(crate) fn frame_round(fence: &Polygon<f64>) -> Vec<Polygon<f64>> {
    /// How far the frame reaches beyond the fence, in metres: more than any vehicle overshoots.
    const WIDTH_M: f64 = 500.0;
    /// How far the halves overlap, in metres.
    const OVERLAP_M: f64 = 2.0;
    use geo::BoundingRect as _;
    let Some(bounds) = fence.bounding_rect() else { return Vec::new() };
    let width = geo::Coord { x: WIDTH_M, y: WIDTH_M };
    let (low, high) = (bounds.min() - width, bounds.max() + width);
    let middle = bounds.center().x;
    let halves = [
        Rect::new((low.x, low.y), (middle + OVERLAP_M / 2.0, high.y)),
        Rect::new((middle - OVERLAP_M / 2.0, low.y), (high.x, high.y)),
    ];
    halves.into_iter().flat_map(|half| half.to_polygon().difference(fence).0).collect()
}

/// The corners of a ring, the first one not repeated.
pub(crate) fn corners(ring: &LineString<f64>) -> Vec<Ned> {
    let count = ring.0.len().saturating_sub(1);
    ring.coords().take(count).map(|it| Ned::new(it.y, it.x, 0.0)).collect()
}

/// An area of these corners, for the rules about its shape.
pub(crate) fn area_of(corners: Vec<Ned>) -> domain::area::Area {
    domain::area::Area {
        name: String::new(),
        kind: domain::area::AreaKind::KeepOut,
        corners,
        floor_m: None,
        ceiling_m: None,
        from_utc_ms: None,
        until_utc_ms: None,
        hours: None,
    }
}
