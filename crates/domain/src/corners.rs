//! The corners of an area grown by a margin: the only points at which a shortest way past it turns, and the directions in
//! which it may pass them.

use crate::area::Area;
use crate::geometry::Ned;

/// `(north, east)`.
type Vector = (f64, f64);

/// A corner of a grown area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Where it is; the height is zero.
    pub at: Ned,
    /// The direction of the side that ends there.
    before: Vector,
    /// The direction of the side that begins there.
    after: Vector,
}

impl Corner {
    /// Whether a shortest way may pass the corner in the direction from `a` to `b`: the area is on one side of that line there. Any
    /// other way through the corner could be cut short.
    #[inline]
    pub fn is_touched_along(&self, a: Ned, b: Ned) -> bool {
        /// Rounding: a thousandth of a millimetre beside a kilometre.
        const EPSILON: f64 = 1e-9;
        let (north_m, east_m) = (b.north_m - a.north_m, b.east_m - a.east_m);
        let cross = |side: Vector| north_m * side.1 - east_m * side.0;
        let (behind, ahead) = (-cross(self.before), cross(self.after));
        let touches = |length_m: f64| {
            let tolerance = (EPSILON * length_m).max(f64::MIN_POSITIVE);
            (-tolerance < behind && -tolerance < ahead) || (behind < tolerance && ahead < tolerance)
        };
        // The sum is never less than the length, and cheaper: it rules out most corners without a square root.
        touches(north_m.abs() + east_m.abs()) && touches(north_m.hypot(east_m))
    }

    /// Whether a shortest way may pass the corner along a line that meets the circle of `radius_m` around `centre`: if not, it
    /// leads to nothing in there. Heights are not looked at.
    #[inline]
    pub fn may_lead_into(&self, centre: Ned, radius_m: f64) -> bool {
        /// Rounding: more than that of [`Corner::is_touched_along`] at 100 km.
        const ROUNDING_M: f64 = 1e-3;
        let (north_m, east_m) = (centre.north_m - self.at.north_m, centre.east_m - self.at.east_m);
        // The distance of the centre from the line along each side.
        let cross = |side: Vector| north_m * side.1 - east_m * side.0;
        let (behind_m, ahead_m) = (-cross(self.before), cross(self.after));
        let reach_m = radius_m + ROUNDING_M;
        (-reach_m < behind_m && -reach_m < ahead_m) || (behind_m < reach_m && ahead_m < reach_m)
    }
}

/// A ring of an area's border, moved away from the area.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GrownRing {
    /// The corners at which a shortest way past the area may turn.
    pub corners: Vec<Corner>,
    /// The ring itself, not closed: those corners and the others, without very acute ones of the others. It is not simple where the
    /// ring is narrower than twice the margin.
    pub ring: Vec<Ned>,
}

/// The rings of `area` moved `margin_m` away from it, outwards or into the hole, so that their sides are that far from those of
/// the area: the outline's, then those of the holes.
pub fn grown(area: &Area, margin_m: f64) -> Vec<GrownRing> {
    let grow = |(number, ring): (usize, &[Ned])| grown_ring(ring, 0 < number, margin_m);
    area.rings().enumerate().map(grow).collect()
}

/// The corners at which a shortest way past `area` may turn that stays `margin_m` away from it.
pub fn corners(area: &Area, margin_m: f64) -> impl Iterator<Item = Corner> + use<> {
    grown(area, margin_m).into_iter().flat_map(|it| it.corners)
}

/// A ring (not closed, in either sense). An acute corner is replaced by two; no way turns at one that points towards the area.
fn grown_ring(ring: &[Ned], is_hole: bool, margin_m: f64) -> GrownRing {
    let mut ring = ring.to_vec();
    // A side without length has no direction.
    ring.dedup();
    while ring.len() > 1 && ring.first() == ring.last() {
        ring.pop();
    }
    let count = ring.len();
    if count < 3 {
        return GrownRing::default();
    }
    let has_area_on_right = (doubled_area(&ring) > 0.0) != is_hole;
    let side = |index: usize| {
        let (here, there) = (ring[index % count], ring[(index + 1) % count]);
        let length_m = here.horizontal_distance_m(there);
        ((there.north_m - here.north_m) / length_m, (there.east_m - here.east_m) / length_m)
    };
    let away = |(north, east): Vector| if has_area_on_right { (east, -north) } else { (-east, north) };
    let mut grown = GrownRing::default();
    for index in 0..count {
        let corner = ring[(index + 1) % count];
        let (before, after) = (side(index), side(index + 1));
        let (out_before, out_after) = (away(before), away(after));
        // The next side bends away from the outward direction of this one.
        let is_passed = dot(out_before, after) < 0.0;
        let alike = dot(out_before, out_after);
        let at =
            |(north, east): Vector| Ned::new(corner.north_m + north * margin_m, corner.east_m + east * margin_m, 0.0);
        /// The cosine of 120 degrees between the outward directions of two sides: for sharper corners the
        /// point is farther away than its two replacements.
        const ACUTE: f64 = -0.5;
        if alike > ACUTE {
            let sum = add(out_before, out_after);
            let at = at((sum.0 / (1.0 + alike), sum.1 / (1.0 + alike)));
            grown.ring.push(at);
            grown.corners.extend(is_passed.then_some(Corner { at, before, after }));
        } else if is_passed {
            let (first, second) = (at(add(out_before, before)), at(add(out_after, (-after.0, -after.1))));
            let between = (second.north_m - first.north_m, second.east_m - first.east_m);
            let length_m = between.0.hypot(between.1).max(f64::MIN_POSITIVE);
            let between = (between.0 / length_m, between.1 / length_m);
            grown.ring.extend([first, second]);
            grown.corners.push(Corner { at: first, before, after: between });
            grown.corners.push(Corner { at: second, before: between, after });
        }
    }
    grown
}

/// Twice the area, positive if the ring runs clockwise as seen from above.
fn doubled_area(ring: &[Ned]) -> f64 {
    let next = ring.iter().cycle().skip(1);
    std::iter::zip(ring, next).map(|(a, b)| a.north_m * b.east_m - b.north_m * a.east_m).sum()
}

fn dot(a: Vector, b: Vector) -> f64 {
    a.0 * b.0 + a.1 * b.1
}

fn add(a: Vector, b: Vector) -> Vector {
    (a.0 + b.0, a.1 + b.1)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use proptest::prelude::*;

    use super::*;
    use crate::area::AreaKind;

    fn area(corners: Vec<Ned>) -> Area {
        Area::new("a", AreaKind::KeepOut, corners)
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2_000, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn no_way_is_touched_along_into_a_circle_that_a_corner_does_not_lead_into(
            ring in proptest::collection::vec((-200.0..200.0, -200.0..200.0), 3..9),
            centre in (-900.0..900.0, -900.0..900.0),
            radius_m in 1.0..200.0,
            (angle, part) in (0.0..TAU, 0.0..=1.0),
        ) {
            let ring: Vec<Ned> = ring.into_iter().map(|(north, east)| Ned::new(north, east, 0.0)).collect();
            let centre = Ned::new(centre.0, centre.1, 0.0);
            let reach_m: f64 = part * radius_m;
            let there = Ned::new(centre.north_m + reach_m * angle.cos(), centre.east_m + reach_m * angle.sin(), 0.0);
            // As an outline and as a hole: the corners of the one are not those of the other.
            for corner in corners(&Area { holes: vec![ring.clone()], ..area(ring) }, 10.0) {
                let touched = corner.is_touched_along(corner.at, there);
                prop_assert!(!touched || corner.may_lead_into(centre, radius_m), "{corner:?}");
            }
        }
    }

    #[test]
    fn corners_move_outwards_or_into_the_hole_and_those_towards_the_area_have_none() {
        #[track_caller]
        fn check(ring: &[Vector], is_hole: bool, expected: &[Vector]) {
            for reversed in [false, true] {
                let mut ring: Vec<_> = ring.iter().map(|&(north, east)| Ned::new(north, east, 0.0)).collect();
                if reversed {
                    ring.reverse();
                }
                let grown = grown_ring(&ring, is_hole, 10.0);
                let rounded = |at: Ned| (at.north_m.round(), at.east_m.round());
                let mut found: Vec<_> = grown.corners.iter().map(|it| rounded(it.at)).collect();
                found.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
                assert_eq!(found, expected, "{ring:?}");
                let is_in_ring = |it: &Vector| grown.ring.iter().any(|at| rounded(*at) == *it);
                assert!(grown.ring.len() >= ring.len() && expected.iter().all(is_in_ring), "{grown:?}");
            }
        }
        check(
            &[(-90.0, 110.0), (90.0, 110.0), (90.0, 290.0), (-90.0, 290.0)],
            false,
            &[(-100.0, 100.0), (-100.0, 300.0), (100.0, 100.0), (100.0, 300.0)],
        );
        check(&[(-90.0, 110.0), (90.0, 110.0), (90.0, 290.0), (-90.0, 290.0)], true, &[]);
        // An L: five corners point outwards, one inwards.
        let l = [(0.0, 0.0), (100.0, 0.0), (100.0, 50.0), (50.0, 50.0), (50.0, 100.0), (0.0, 100.0)];
        check(&l, true, &[(40.0, 40.0)]);
        check(&l, false, &[(-10.0, -10.0), (-10.0, 110.0), (60.0, 110.0), (110.0, -10.0), (110.0, 60.0)]);
        // A needle to the north: its point is cut off.
        check(
            &[(0.0, 0.0), (1000.0, 10.0), (0.0, 20.0)],
            false,
            &[(-10.0, -10.0), (-10.0, 30.0), (1010.0, 0.0), (1010.0, 20.0)],
        );
    }

    #[test]
    fn a_corner_is_touched_along_lines_that_have_the_polygon_on_one_side() {
        let ring = [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)];
        let ring = ring.map(|(north, east)| Ned::new(north, east, 0.0));
        let mut found = corners(&area(ring.to_vec()), 10.0);
        let corner = found.find(|it| it.at == Ned::new(110.0, 110.0, 0.0)).expect("the one in the north-east");
        #[track_caller]
        fn check(corner: &Corner, direction: Vector, expected: bool) {
            for (north, east) in [direction, (-direction.0, -direction.1)] {
                let (a, b) = (corner.at, Ned::new(110.0 + north, 110.0 + east, 0.0));
                assert_eq!(corner.is_touched_along(a, b), expected, "{direction:?}");
            }
        }
        check(&corner, (1.0, -1.0), true);
        check(&corner, (1.0, 0.0), true);
        check(&corner, (0.0, 1.0), true);
        check(&corner, (1.0, -0.01), true);
        check(&corner, (1.0, 0.01), false);
        check(&corner, (1.0, 1.0), false);
    }
}
