//! The border of an area over the ground, that of its holes included, prepared once, so that many straight ways can be held against it.
//!
//! It knows neither heights nor times. What it answers is the same as for an area that is looked at once: the rule has one
//! implementation, here.

use geo::line_intersection::{LineIntersection, line_intersection};
use geo::{BoundingRect, Contains, Coord, Distance, Euclidean, Line, Point, Polygon, Rect};

use crate::area::{Area, rings};
use crate::geometry::Ned;
use crate::way::Exempt;

/// Corners this far beyond a line, in metres, are on that side whatever the rounding. (Among coordinates of up to 1,000
/// km the distance from a line is computed to a thousandth of that.)
const ROUNDING_M: f64 = 1e-6;

/// The polygon of an area, with its bounding box.
#[derive(Debug, Clone)]
pub struct Outline {
    /// x is east, y is north.
    polygon: Polygon<f64>,
    /// `None`: it has no corners.
    bounds: Option<Rect<f64>>,
}

impl Outline {
    /// That of `area`.
    pub fn new(area: &Area) -> Outline {
        let polygon = area.polygon();
        let bounds = polygon.bounding_rect();
        Outline { polygon, bounds }
    }

    /// The rectangle around it; x is east, y is north. `None`: it has no corners.
    pub fn bounds(&self) -> Option<Rect<f64>> {
        self.bounds
    }

    /// Whether the bounding boxes of the way and the area are more than `distance_m` apart.
    pub fn is_beyond(&self, distance_m: f64, from: Ned, to: Ned) -> bool {
        let Some(bounds) = self.bounds else { return true };
        let apart = |low: f64, high: f64, a: f64, b: f64| high < a.min(b) - distance_m || a.max(b) + distance_m < low;
        apart(bounds.min().x, bounds.max().x, from.east_m, to.east_m)
            || apart(bounds.min().y, bounds.max().y, from.north_m, to.north_m)
    }

    /// Whether the whole outline is on one side of the straight line through `from` and `to`, which leads on beyond
    /// both, and at least `distance_m` away. Then the way between them keeps that distance; otherwise it may still, in
    /// a hole too.
    pub fn is_aside(&self, distance_m: f64, from: Ned, to: Ned) -> bool {
        let line = Sides::of(from, to);
        let (lowest, highest) =
            self.polygon.exterior().0.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), it| {
                let side = line.side(it);
                (if side < low { side } else { low }, if high < side { side } else { high })
            });
        let least = (distance_m + ROUNDING_M) * line.length_m;
        0.0 < line.length_m && (least < lowest || highest < -least)
    }

    /// Distance over ground from `point` to the border, that of the nearest hole included, from inside or outside.
    pub fn distance_to_border_m(&self, point: Ned) -> f64 {
        let point = Point::new(point.east_m, point.north_m);
        rings(&self.polygon).map(|it| Euclidean.distance(&point, it)).fold(f64::INFINITY, f64::min)
    }

    /// Whether `point` is inside, whatever the heights. The border is not, nor is a hole.
    pub fn covers(&self, point: Ned) -> bool {
        !self.is_beyond(0.0, point, point) && self.polygon.contains(&Point::new(point.east_m, point.north_m))
    }

    /// Fractions of the way from `from` to `to` at which the path over ground meets the border, ascending, with 0 and 1 added at
    /// the ends, so that each neighbouring pair is a stretch that is wholly inside or wholly outside.
    pub fn crossings(&self, from: Ned, to: Ned) -> Vec<f64> {
        let mut found = vec![0.0, 1.0];
        if self.is_beyond(0.0, from, to) {
            return found;
        }
        let way = Line::new(coord(from), coord(to));
        let length_squared = way.dx() * way.dx() + way.dy() * way.dy();
        let fraction = |at: Coord| {
            if length_squared == 0.0 {
                return 0.0;
            }
            (((at.x - way.start.x) * way.dx() + (at.y - way.start.y) * way.dy()) / length_squared).clamp(0.0, 1.0)
        };
        for edge in self.edges_within(0.0, from, to) {
            match line_intersection(way, edge) {
                Some(LineIntersection::SinglePoint { intersection, .. }) => found.push(fraction(intersection)),
                Some(LineIntersection::Collinear { intersection }) => {
                    found.extend([fraction(intersection.start), fraction(intersection.end)]);
                }
                None => {}
            }
        }
        found.sort_by(f64::total_cmp);
        found.dedup_by(|a, b| (*a - *b).abs() < 1e-12);
        found
    }

    /// Whether the level leg from `from` to `to` keeps `margin_m` from it, but for the first and last `margin_m` of the leg where
    /// those are exempt.
    pub fn keeps_clear(&self, from: Ned, to: Ned, margin_m: f64, exempt: Exempt) -> bool {
        if self.is_beyond(margin_m, from, to) {
            return true;
        }
        let length_m = from.horizontal_distance_m(to);
        let (trim_start_m, trim_end_m) =
            (if exempt.start { margin_m } else { 0.0 }, if exempt.end { margin_m } else { 0.0 });
        if length_m <= trim_start_m + trim_end_m {
            return true;
        }
        let start = from.towards(to, trim_start_m / length_m);
        // `towards` rounds the far end: an area at exactly the margin would be too near.
        let end = if 0.0 < trim_end_m { from.towards(to, (length_m - trim_end_m) / length_m) } else { to };
        let kept = Line::new(coord(start), coord(end));
        let is_far = |edge: Line| margin_m <= Euclidean.distance(&kept, &edge);
        self.edges_within(margin_m, start, end).all(is_far) && !self.covers(start)
    }

    /// The sides of all rings, without those of which it is plain that they are farther than `distance_m` from the line through
    /// `from` and `to`.
    fn edges_within(&self, distance_m: f64, from: Ned, to: Ned) -> impl Iterator<Item = Line> {
        let line = Sides::of(from, to);
        let least = (distance_m + ROUNDING_M) * line.length_m;
        rings(&self.polygon).flat_map(|it| it.0.windows(2)).filter_map(move |ends| {
            let (a, b) = (line.side(&ends[0]), line.side(&ends[1]));
            let is_far = 0.0 < line.length_m && ((least < a && least < b) || (a < -least && b < -least));
            (!is_far).then(|| Line::new(ends[0], ends[1]))
        })
    }
}

/// A straight line over the ground, to find on which side a point is.
struct Sides {
    start: Coord,
    direction: Coord,
    length_m: f64,
}

impl Sides {
    fn of(from: Ned, to: Ned) -> Sides {
        let (start, end) = (coord(from), coord(to));
        let direction = end - start;
        Sides { start, direction, length_m: (direction.x * direction.x + direction.y * direction.y).sqrt() }
    }

    /// The distance of `point` from the line, times [`Sides::length_m`]; positive on its left.
    fn side(&self, point: &Coord) -> f64 {
        self.direction.x * (point.y - self.start.y) - self.direction.y * (point.x - self.start.x)
    }
}

fn coord(at: Ned) -> Coord {
    Coord { x: at.east_m, y: at.north_m }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::area::AreaKind;

    fn area(corners: &[(f64, f64)]) -> Area {
        Area::new("a", AreaKind::KeepOut, ring(corners))
    }

    fn ring(corners: &[(f64, f64)]) -> Vec<Ned> {
        corners.iter().map(|&(north, east)| Ned::new(north, east, 0.0)).collect()
    }

    /// On a coarse grid too, so that ways lead along sides and through corners.
    fn any_spot() -> impl Strategy<Value = (f64, f64)> {
        let coarse = (-4..5i32, -4..5i32).prop_map(|(north, east)| (f64::from(north) * 50.0, f64::from(east) * 50.0));
        prop_oneof![coarse, (-200.0..200.0, -200.0..200.0)]
    }

    /// Around a middle, so that it seldom crosses itself.
    fn any_hole() -> impl Strategy<Value = Option<Vec<(f64, f64)>>> {
        let middle = (-80.0..80.0, -80.0..80.0);
        proptest::option::of((middle, proptest::collection::vec(20.0..150.0, 3..9)).prop_map(
            |((north, east), reach)| {
                let angle = |number: usize| std::f64::consts::TAU * number as f64 / reach.len() as f64;
                let corner = |(number, reach_m): (usize, &f64)| {
                    (north + reach_m * angle(number).sin(), east + reach_m * angle(number).cos())
                };
                reach.iter().enumerate().map(corner).collect()
            },
        ))
    }

    /// Whether a place is inside of an odd number of rings: it looks at nothing but corners.
    fn is_inside(area: &Area, at: Ned) -> bool {
        let crosses = |(a, b): (&Ned, &Ned)| {
            let east_m = a.east_m + (b.east_m - a.east_m) * (at.north_m - a.north_m) / (b.north_m - a.north_m);
            (a.north_m <= at.north_m) != (b.north_m <= at.north_m) && at.east_m < east_m
        };
        let sides = area.rings().flat_map(|ring| ring.iter().zip(ring.iter().cycle().skip(1)));
        sides.filter(|it| crosses(*it)).count() % 2 == 1
    }

    /// 326.6 m along the way, its end would be rounded to beyond 150 m.
    #[test]
    fn an_area_at_exactly_the_margin_is_far_enough() {
        let outline = Outline::new(&area(&[(200.0, 0.0), (200.0, 150.0), (250.0, 0.0)]));
        let (from, to) = (Ned::new(-176.63524270845582, 0.0, 0.0), Ned::new(150.0, 0.0, 0.0));
        assert!(outline.keeps_clear(from, to, 50.0, Exempt { start: false, end: false }));
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2_000, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn what_is_left_out_changes_no_answer(
            corners in proptest::collection::vec(any_spot(), 3..9),
            hole in any_hole(),
            from in any_spot(),
            to in any_spot(),
            margin_m in prop_oneof![Just(10.0), Just(50.0), 1.0..80.0],
        ) {
            let mut area = area(&corners);
            if let Some(hole) = hole {
                // A wide square round it: few random polygons have room for a hole.
                area.corners = ring(&[(-250.0, -250.0), (250.0, -250.0), (250.0, 250.0), (-250.0, 250.0)]);
                prop_assume!(area.add_hole(ring(&hole)).is_ok());
            }
            let (outline, polygon) = (Outline::new(&area), area.polygon());
            let (from, to) = (Ned::new(from.0, from.1, 0.0), Ned::new(to.0, to.1, 0.0));
            let way = Line::new(coord(from), coord(to));
            // Every side counts.
            let meets = |edge: &Line| line_intersection(way, *edge).is_some();
            let is_met = rings(&polygon).any(|ring| ring.lines().any(|it| meets(&it)));
            let crossings = outline.crossings(from, to);
            prop_assert!(crossings.windows(2).all(|it| it[0] < it[1]) && crossings[0] == 0.0);
            prop_assert!(is_met || crossings == [0.0, 1.0], "{crossings:?}");
            let distance_m = Euclidean.distance(&way, &polygon);
            let keeps_clear = outline.keeps_clear(from, to, margin_m, Exempt { start: false, end: false });
            // At no length there is nothing to keep clear.
            prop_assert!(keeps_clear == (margin_m <= distance_m) || from == to, "{distance_m} m");
            prop_assert!(!outline.is_aside(margin_m, from, to) || margin_m <= distance_m, "{distance_m} m");
            prop_assert!(!outline.is_beyond(margin_m, from, to) || margin_m <= distance_m, "{distance_m} m");
            // Stretch by stretch, the way is inside or outside.
            for stretch in crossings.windows(2) {
                let inside = [0.25, 0.5, 0.75].map(|it| {
                    let at = from.towards(to, stretch[0] + (stretch[1] - stretch[0]) * it);
                    (outline.covers(at), area.distance_to_border_m(at))
                });
                let sure: Vec<bool> = inside.iter().filter(|it| 1e-6 < it.1).map(|it| it.0).collect();
                prop_assert!(sure.windows(2).all(|it| it[0] == it[1]), "{inside:?}");
            }
            for at in [from, to].into_iter().filter(|at| area.is_simple() && 1e-6 < area.distance_to_border_m(*at)) {
                prop_assert_eq!(area.covers(at), is_inside(&area, at));
                prop_assert!(!area.covers(at) || !outline.is_beyond(0.0, at, at));
            }
        }
    }
}
