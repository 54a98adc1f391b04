//! Areas: polygons with an altitude band, a time window and hours, entered with a permission or not at all. They may have holes,
//! which belong to the outside.

use geo::{Contains, Coord, Intersects, Line, LineString, Polygon};
use sha2::{Digest, Sha256};

use crate::geometry::Ned;
use crate::harm::{Ground, Harm};
use crate::hours::WeeklyHours;
use crate::outline::Outline;

/// What it takes to enter an area.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AreaKind {
    /// Entered only with the control tower's permission.
    Permission,
    /// Never entered.
    KeepOut,
}

/// The height above the origin up to which an area is barred that may not be landed in, in metres. (ENG: with the vertical margin of 2 m
/// below the least height of a flight, 5 m; it reaches down as far as there is ground.)
pub const NO_LANDING_TO_M: f64 = 3.0;

/// How far north, south, east and west of the origin areas reach, in metres: what lies all round something goes on to there. (A mission
/// file takes corners to 200 km, and those of this square are at 198 km.)
pub const AREAS_END_M: f64 = 140_000.0;

/// Where an area is, as a grant names it: no other area of the same name has the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent {
    /// The SHA-256 of the rings in canonical form: see docs/formats.md.
    pub outline: [u8; 32],
    /// [`Area::floor_m`] in tenths of a millimetre.
    pub floor_tenth_mm: Option<i64>,
    /// [`Area::ceiling_m`] in tenths of a millimetre.
    pub ceiling_tenth_mm: Option<i64>,
}

/// A polygon over the ground with an altitude band, a time window and hours.
#[derive(Debug, Clone, PartialEq)]
pub struct Area {
    /// Unique within a mission.
    pub name: String,
    /// What it takes to enter.
    pub kind: AreaKind,
    /// The corners of its outline in order, not closed; the heights are not used.
    pub corners: Vec<Ned>,
    /// The corners of each of its holes, in the same form. A hole lies inside the outline; it touches neither that nor another hole.
    pub holes: Vec<Vec<Ned>>,
    /// Height above the origin from which on it applies; `None`: from the ground up.
    pub floor_m: Option<f64>,
    /// Height above the origin up to which it applies; `None`: without limit.
    pub ceiling_m: Option<f64>,
    /// Applies from then on, milliseconds since the Unix epoch, UTC.
    pub from_utc_ms: Option<i64>,
    /// Applies until then.
    pub until_utc_ms: Option<i64>,
    /// Applies at these hours of the week only; `None`: at all of them.
    pub hours: Option<WeeklyHours>,
    /// The kind of ground in a no-landing area ([`Area::only_bars_landings`]). It has no meaning in other areas.
    pub ground: Ground,
}

/// Why the rings of an area are refused: a message goes on after the name of the area. Holes are counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum InvalidRings {
    /// The outline is not a simple polygon.
    #[error("crosses itself or has fewer than three corners")]
    Outline,
    /// A hole is not a simple polygon.
    #[error("has a hole that crosses itself or has fewer than three corners, hole {0}")]
    Hole(usize),
    /// A hole crosses or touches the outline, or lies outside.
    #[error("has a hole that is not inside its outline, hole {0}")]
    NotInside(usize),
    /// Two holes cross or touch, or one lies in the other.
    #[error("has holes that overlap or touch, holes {0} and {1}")]
    Overlap(usize, usize),
}

impl InvalidRings {
    /// The number of the ring that is to be changed: 0 is the outline.
    pub fn ring(self) -> usize {
        match self {
            InvalidRings::Outline => 0,
            InvalidRings::Hole(hole) | InvalidRings::NotInside(hole) | InvalidRings::Overlap(_, hole) => hole,
        }
    }
}

impl Area {
    /// An area without holes that applies at all heights and at all times.
    pub fn new(name: impl Into<String>, kind: AreaKind, corners: Vec<Ned>) -> Area {
        Area {
            name: name.into(),
            kind,
            corners,
            holes: Vec::new(),
            floor_m: None,
            ceiling_m: None,
            from_utc_ms: None,
            until_utc_ms: None,
            hours: None,
            ground: Ground::default(),
        }
    }

    /// The rings of its border: the outline, then each hole.
    pub fn rings(&self) -> impl Iterator<Item = &[Ned]> {
        std::iter::once(&self.corners).chain(&self.holes).map(Vec::as_slice)
    }

    /// Whether it is one that may be flown over and not landed in.
    pub fn only_bars_landings(&self) -> bool {
        let is_low = self.floor_m.is_none() && self.ceiling_m == Some(NO_LANDING_TO_M);
        self.kind == AreaKind::KeepOut && is_low && self.ground != Ground::Nobody
    }

    /// The same with people below.
    pub(crate) fn among_people(&self) -> Area {
        Area { ground: Ground::People, ..self.clone() }
    }

    /// Whether it only bars landings, and what comes down there may harm as much: a ditch, or a load, in water.
    pub fn takes(&self, accepts: Harm) -> bool {
        self.only_bars_landings() && self.ground.harm() <= accepts
    }

    /// Where it is: the same on every machine, and whatever corner or hole is listed first.
    pub fn extent(&self) -> Extent {
        let tenth_mm = |m: f64| (m * 1e4).round() as i64;
        let canonical = |ring: &[Ned]| {
            let mut ring: Vec<_> = ring.iter().map(|it| (tenth_mm(it.north_m), tenth_mm(it.east_m))).collect();
            let first = (0..ring.len()).min_by_key(|it| ring[*it]).unwrap_or_default();
            ring.rotate_left(first);
            if ring.last() < ring.get(1) {
                ring[1..].reverse();
            }
            ring
        };
        let mut rings: Vec<_> = self.rings().map(canonical).collect();
        rings[1..].sort();
        let has_holes = !self.holes.is_empty();
        let form: &[u8] = if has_holes { b"kittiwake outline 2\0" } else { b"kittiwake outline 1\0" };
        let mut hash = Sha256::new_with_prefix(form);
        for ring in rings {
            if has_holes {
                hash.update((ring.len() as u64).to_le_bytes());
            }
            for (north, east) in ring {
                hash.update(north.to_le_bytes());
                hash.update(east.to_le_bytes());
            }
        }
        Extent {
            outline: hash.finalize().into(),
            floor_tenth_mm: self.floor_m.map(tenth_mm),
            ceiling_tenth_mm: self.ceiling_m.map(tenth_mm),
        }
    }

    /// The polygon; x is east, y is north.
    pub fn polygon(&self) -> Polygon<f64> {
        let ring = |ring: &Vec<Ned>| LineString::from_iter(ring.iter().map(|it| (it.east_m, it.north_m)));
        Polygon::new(ring(&self.corners), self.holes.iter().map(ring).collect())
    }

    /// Whether the area applies at this moment of UTC.
    pub fn is_active(&self, utc_ms: i64) -> bool {
        self.from_utc_ms.is_none_or(|from| from <= utc_ms)
            && self.until_utc_ms.is_none_or(|until| utc_ms < until)
            && self.hours.as_ref().is_none_or(|hours| hours.covers(utc_ms))
    }

    /// Whether it applies at every moment: it has neither a window nor hours that leave some out.
    pub fn always_applies(&self) -> bool {
        self.from_utc_ms.is_none()
            && self.until_utc_ms.is_none()
            && self.hours.as_ref().is_none_or(WeeklyHours::is_whole_week)
    }

    /// The windows in which it applies and that are not over at this moment of UTC, ascending: each with its beginning, which is
    /// `utc_ms` or later, and its end, if it has one. Hours more than two weeks ahead are one window with the rest of the time.
    pub fn windows_after(&self, utc_ms: i64) -> impl Iterator<Item = (i64, Option<i64>)> {
        let begins = self.from_utc_ms.map_or(utc_ms, |from| from.max(utc_ms));
        let ends = self.until_utc_ms;
        let unbroken = self.hours.is_none().then_some((begins, i64::MAX));
        let weekly = self.hours.iter().flat_map(move |hours| hours.windows_after(begins));
        let windows = unbroken.into_iter().chain(weekly);
        windows.take_while(move |(from, _)| ends.is_none_or(|ends| *from < ends)).map(move |(from, until)| {
            let until = ends.map_or(until, |ends| ends.min(until));
            (from, Some(until).filter(|it| *it < i64::MAX || ends.is_some()))
        })
    }

    /// Whether some height between the two lies in the altitude band. The band is closed below and above.
    pub fn touches_heights(&self, a_m: f64, b_m: f64) -> bool {
        self.floor_m.is_none_or(|floor| floor <= a_m.max(b_m))
            && self.ceiling_m.is_none_or(|ceiling| a_m.min(b_m) <= ceiling)
    }

    /// Whether `point` is inside, altitude band included. The border does not count as inside.
    pub fn contains(&self, point: Ned) -> bool {
        self.touches_heights(point.height_m(), point.height_m()) && self.covers(point)
    }

    /// Whether some of the area is at `point` or straight below it, down to any depth.
    pub fn is_at_or_below(&self, point: Ned) -> bool {
        self.touches_heights(point.height_m(), f64::NEG_INFINITY) && self.covers(point)
    }

    /// Whether `point` is inside, whatever the heights.
    pub(crate) fn covers(&self, point: Ned) -> bool {
        !self.is_beyond(0.0, point, point) && self.polygon().contains(&geo::Point::new(point.east_m, point.north_m))
    }

    /// Whether the straight way from `from` to `to` goes through the inside. Conservative in height:
    /// the whole leg counts as flown at all heights between its ends.
    pub fn is_crossed(&self, from: Ned, to: Ned) -> bool {
        if !self.touches_heights(from.height_m(), to.height_m()) {
            return false;
        }
        let polygon = self.polygon();
        self.crossings(from, to).windows(2).any(|pair| {
            let middle = from.towards(to, (pair[0] + pair[1]) / 2.0);
            polygon.contains(&geo::Point::new(middle.east_m, middle.north_m))
        })
    }

    /// Fractions of the way from `from` to `to` at which the horizontal path meets the border,
    /// ascending, with 0 and 1 added at the ends, so that each neighbouring pair is a stretch
    /// that is wholly inside or wholly outside.
    pub fn crossings(&self, from: Ned, to: Ned) -> Vec<f64> {
        if self.is_beyond(0.0, from, to) { vec![0.0, 1.0] } else { Outline::new(self).crossings(from, to) }
    }

    /// Whether the bounding boxes of the way and the area are more than `distance_m` apart: a cheap check that settles most pairs.
    pub(crate) fn is_beyond(&self, distance_m: f64, from: Ned, to: Ned) -> bool {
        let apart = |of: fn(&Ned) -> f64| {
            let (low, high) = (of(&from).min(of(&to)) - distance_m, of(&from).max(of(&to)) + distance_m);
            self.corners.iter().all(|it| of(it) < low) || self.corners.iter().all(|it| of(it) > high)
        };
        apart(|it| it.north_m) || apart(|it| it.east_m)
    }

    /// Distance over ground from `point` to the border, that of the nearest hole included, from inside or outside.
    pub fn distance_to_border_m(&self, point: Ned) -> f64 {
        Outline::new(self).distance_to_border_m(point)
    }

    /// Whether the rings make a polygon: see [`Area::check_rings`].
    pub fn is_simple(&self) -> bool {
        self.check_rings().is_ok()
    }

    /// Each ring has at least three corners, none twice, and no two sides that cross. Each hole lies inside the outline, and no hole
    /// touches another ring.
    ///
    /// # Errors
    /// The first ring that is wrong.
    pub fn check_rings(&self) -> Result<(), InvalidRings> {
        let mut checked = Area { holes: Vec::new(), ..self.clone() };
        if !is_simple_ring(&sides(&self.corners)) {
            return Err(InvalidRings::Outline);
        }
        self.holes.iter().try_for_each(|hole| checked.add_hole(hole.clone()))
    }

    /// The area gets one more hole, if its rings make a polygon with it.
    ///
    /// # Errors
    /// What is wrong with the hole.
    pub fn add_hole(&mut self, hole: Vec<Ned>) -> Result<(), InvalidRings> {
        let (number, of_hole) = (self.holes.len() + 1, sides(&hole));
        if !is_simple_ring(&of_hole) {
            return Err(InvalidRings::Hole(number));
        }
        let do_meet = |ring: &[Ned]| sides(ring).iter().any(|a| of_hole.iter().any(|b| a.intersects(b)));
        // Rings that do not meet lie in each other with all of their corners, or with none.
        let lies_in = |inner: &[Ned], outer: &[Ned]| Area::new("", self.kind, outer.to_vec()).covers(inner[0]);
        if do_meet(&self.corners) || !lies_in(&hole, &self.corners) {
            return Err(InvalidRings::NotInside(number));
        }
        let overlaps = |other: &Vec<Ned>| do_meet(other) || lies_in(other, &hole) || lies_in(&hole, other);
        if let Some(other) = self.holes.iter().position(overlaps) {
            return Err(InvalidRings::Overlap(other + 1, number));
        }
        self.holes.push(hole);
        Ok(())
    }
}

/// The rings of a polygon: its outline, then each hole.
pub(crate) fn rings(polygon: &Polygon<f64>) -> impl Iterator<Item = &LineString<f64>> {
    std::iter::once(polygon.exterior()).chain(polygon.interiors())
}

fn is_simple_ring(sides: &[Line<f64>]) -> bool {
    let count = sides.len();
    let is_apart = |i: usize, j: usize| {
        let are_neighbours = j == i + 1 || (i == 0 && j == count - 1);
        if are_neighbours { !overlaps(sides[i], sides[j]) } else { !sides[i].intersects(&sides[j]) }
    };
    3 <= count && (0..count).all(|i| (i + 1..count).all(|j| is_apart(i, j)))
}

/// The sides of a ring; x is east, y is north.
fn sides(ring: &[Ned]) -> Vec<Line<f64>> {
    let coord = |it: &Ned| Coord { x: it.east_m, y: it.north_m };
    let ends = ring.iter().zip(ring.iter().cycle().skip(1));
    ends.map(|(a, b)| Line::new(coord(a), coord(b))).collect()
}

/// Whether two neighbouring edges fold back onto each other.
fn overlaps(a: Line<f64>, b: Line<f64>) -> bool {
    use geo::line_intersection::{LineIntersection, line_intersection};
    matches!(line_intersection(a, b), Some(LineIntersection::Collinear { intersection }) if intersection.start != intersection.end)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[(f64, f64)]) -> Area {
        Area { ceiling_m: Some(100.0), ..Area::new("a", AreaKind::Permission, ring(corners)) }
    }

    fn ring(corners: &[(f64, f64)]) -> Vec<Ned> {
        corners.iter().map(|&(north, east)| Ned::new(north, east, 0.0)).collect()
    }

    /// A square with its south-western corner there.
    fn square(north: f64, east: f64, side: f64) -> Vec<Ned> {
        ring(&[(north, east), (north + side, east), (north + side, east + side), (north, east + side)])
    }

    #[test]
    fn an_area_applies_from_the_first_moment_of_its_window_until_before_the_last() {
        let square = area(&[(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)]);
        let window = Area { from_utc_ms: Some(1_000), until_utc_ms: Some(2_000), ..square };
        let moments = [999, 1_000, 1_500, 1_999, 2_000, 2_001];
        assert_eq!(moments.map(|it| window.is_active(it)), [false, true, true, true, false, false]);
    }

    #[test]
    fn an_area_applies_at_its_hours_within_its_window() {
        #[track_caller]
        fn check(window: (Option<i64>, Option<i64>), at: i64, expected: &[(i64, Option<i64>)]) {
            let square = area(&[(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)]);
            let hours = WeeklyHours::parse(&["Mon,Tue 08:00-18:00"]).unwrap();
            let area = Area { from_utc_ms: window.0, until_utc_ms: window.1, hours: Some(hours), ..square };
            let found: Vec<_> = area.windows_after(at).take(2).collect();
            assert_eq!(found, expected);
            let applies_now = expected.first().is_some_and(|it| it.0 == at);
            assert_eq!(area.is_active(at), applies_now, "{area:?} at {at}");
            assert!(!area.always_applies());
        }
        // Hours after Monday 1970-01-05.
        let at = |hours: i64| (4 * 24 + hours) * 3_600_000;
        check((None, None), at(0), &[(at(8), Some(at(18))), (at(32), Some(at(42)))]);
        check((None, None), at(9), &[(at(9), Some(at(18))), (at(32), Some(at(42)))]);
        check((Some(at(10)), Some(at(33))), at(0), &[(at(10), Some(at(18))), (at(32), Some(at(33)))]);
        check((Some(at(19)), Some(at(30))), at(0), &[]);
        check((None, Some(at(10))), at(11), &[]);
    }

    #[test]
    fn an_area_without_hours_has_one_window() {
        #[track_caller]
        fn check(window: (Option<i64>, Option<i64>), expected: &[(i64, Option<i64>)]) {
            let square = area(&[(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)]);
            let area = Area { from_utc_ms: window.0, until_utc_ms: window.1, ..square };
            assert_eq!(area.windows_after(1000).collect::<Vec<_>>(), expected);
        }
        check((None, None), &[(1000, None)]);
        check((Some(500), Some(2000)), &[(1000, Some(2000))]);
        check((Some(1500), None), &[(1500, None)]);
        check((None, Some(1000)), &[]);
        check((None, Some(i64::MAX)), &[(1000, Some(i64::MAX))]);
    }

    #[test]
    fn a_way_through_an_area_crosses_it_even_with_both_ends_outside() {
        #[track_caller]
        fn check(from: (f64, f64, f64), to: (f64, f64, f64), expected: bool) {
            let square = area(&[(-90.0, 110.0), (90.0, 110.0), (90.0, 290.0), (-90.0, 290.0)]);
            let at = |(north, east, height): (f64, f64, f64)| Ned::new(north, east, -height);
            assert_eq!(square.is_crossed(at(from), at(to)), expected, "{from:?} to {to:?}");
        }
        check((0.0, 0.0, 10.0), (0.0, 500.0, 10.0), true);
        check((0.0, 0.0, 10.0), (0.0, 100.0, 10.0), false);
        check((0.0, 150.0, 10.0), (0.0, 160.0, 10.0), true);
        // Along the border is not inside.
        check((90.0, 0.0, 10.0), (90.0, 500.0, 10.0), false);
        // Above the ceiling.
        check((0.0, 0.0, 120.0), (0.0, 500.0, 120.0), false);
        check((0.0, 0.0, 120.0), (0.0, 500.0, 90.0), true);
    }

    #[test]
    fn an_extent_is_that_of_the_place_and_of_no_other() {
        let base = area(&[(0.0, 0.0), (10.0, 0.0), (10.0, 10.5)]);
        let hex: String = base.extent().outline.iter().map(|it| format!("{it:02x}")).collect();
        assert_eq!(hex, "de4862abc50faa59535d3b35a24f57877c8ff4c0f1185810b47478c36dc90656", "the form is fixed");
        let of = |corners: &[(f64, f64)]| area(corners).extent();
        for same in [
            area(&[(10.0, 10.5), (0.0, -0.0), (10.0, 0.0)]),
            area(&[(10.0, 10.5), (10.0, 0.0), (0.0, 0.0)]),
            area(&[(0.000_04, 0.0), (10.0, 0.0), (10.0, 10.5)]),
            Area { name: "b".into(), until_utc_ms: Some(1), ..base.clone() },
        ] {
            assert_eq!(same.extent(), base.extent(), "{same:?}");
        }
        let other = [
            of(&[(0.0, 0.0), (10.0, 0.0), (10.0, 10.6)]),
            of(&[(0.0, 0.0), (10.0, 0.0), (10.0, 10.5), (0.0, 10.5)]),
            of(&[(0.0, 0.0), (0.0, 10.0), (10.5, 10.0)]),
            Area { floor_m: Some(0.0), ..base.clone() }.extent(),
            Area { ceiling_m: None, ..base.clone() }.extent(),
            Area { ceiling_m: Some(100.1), ..base.clone() }.extent(),
        ];
        assert!(!other.contains(&base.extent()), "{other:?}");
    }

    /// 100 m by 100 m, with two holes.
    fn holed() -> Area {
        let holes = vec![square(20.0, 20.0, 20.0), square(60.0, 60.0, 20.0)];
        Area { holes, ..Area::new("a", AreaKind::Permission, square(0.0, 0.0, 100.0)) }
    }

    #[test]
    fn a_hole_is_outside() {
        #[track_caller]
        fn check(north: f64, east: f64, is_inside: bool, border_m: f64) {
            let (area, at) = (holed(), Ned::new(north, east, 0.0));
            assert_eq!((area.contains(at), area.distance_to_border_m(at)), (is_inside, border_m));
        }
        check(10.0, 10.0, true, 10.0);
        check(30.0, 35.0, false, 5.0);
        check(70.0, 62.0, false, 2.0);
        check(30.0, 45.0, true, 5.0);
        check(50.0, -8.0, false, 8.0);
        check(20.0, 30.0, false, 0.0);
        let at = |east: f64| Ned::new(30.0, east, 0.0);
        assert_eq!(holed().crossings(at(30.0), at(130.0)), [0.0, 0.1, 0.7, 1.0]);
        assert!(!holed().is_crossed(at(22.0), at(38.0)) && holed().is_crossed(at(30.0), at(41.0)));
    }

    #[test]
    fn an_extent_knows_the_holes_in_any_order() {
        let (hole, other) = (square(20.0, 20.0, 20.0), square(60.0, 60.0, 20.0));
        let reversed: Vec<Ned> = hole.iter().rev().copied().collect();
        let with = |holes: Vec<Vec<Ned>>| Area { holes, ..holed() }.extent();
        let hex: String = holed().extent().outline.iter().map(|it| format!("{it:02x}")).collect();
        assert_eq!(hex, "071c18a4eb92782d1a369dbef27cb879ebfe381b8038868f1fed8d98f2bcf677", "the form is fixed");
        assert_eq!(with(vec![other.clone(), reversed]), holed().extent());
        // The same corners in one ring are another outline.
        let split = [&hole[..], &other[..]].concat();
        for different in [vec![], vec![hole.clone()], vec![other.clone()], vec![split]] {
            assert_ne!(with(different), holed().extent());
        }
    }

    #[test]
    fn holes_lie_inside_and_apart() {
        #[track_caller]
        fn check(holes: Vec<Vec<Ned>>, expected: Result<(), InvalidRings>) {
            assert_eq!(Area { holes, ..holed() }.check_rings(), expected);
        }
        let good = || square(20.0, 20.0, 20.0);
        check(vec![], Ok(()));
        check(vec![good(), square(60.0, 60.0, 20.0)], Ok(()));
        check(vec![good(), ring(&[(60.0, 60.0), (70.0, 60.0)])], Err(InvalidRings::Hole(2)));
        check(vec![vec![]], Err(InvalidRings::Hole(1)));
        check(vec![ring(&[(20.0, 20.0), (30.0, 30.0), (30.0, 20.0), (20.0, 30.0)])], Err(InvalidRings::Hole(1)));
        check(vec![good(), square(200.0, 20.0, 20.0)], Err(InvalidRings::NotInside(2)));
        check(vec![square(90.0, 20.0, 20.0)], Err(InvalidRings::NotInside(1)));
        // It touches the outline from inside; it is the outline; it is round it.
        check(vec![square(80.0, 20.0, 20.0)], Err(InvalidRings::NotInside(1)));
        check(vec![square(0.0, 0.0, 100.0)], Err(InvalidRings::NotInside(1)));
        check(vec![square(-10.0, -10.0, 120.0)], Err(InvalidRings::NotInside(1)));
        check(vec![good(), square(30.0, 30.0, 20.0)], Err(InvalidRings::Overlap(1, 2)));
        check(vec![good(), square(25.0, 25.0, 5.0)], Err(InvalidRings::Overlap(1, 2)));
        check(vec![square(25.0, 25.0, 5.0), square(60.0, 60.0, 20.0), good()], Err(InvalidRings::Overlap(1, 3)));
        // They touch at a corner.
        check(vec![good(), square(40.0, 40.0, 20.0)], Err(InvalidRings::Overlap(1, 2)));
    }

    #[test]
    fn a_self_crossing_polygon_is_not_simple() {
        assert!(area(&[(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)]).is_simple());
        assert!(!area(&[(0.0, 0.0), (10.0, 10.0), (10.0, 0.0), (0.0, 10.0)]).is_simple());
        assert!(!area(&[(0.0, 0.0), (10.0, 0.0)]).is_simple());
        assert!(!area(&[(0.0, 0.0), (10.0, 0.0), (5.0, 0.0)]).is_simple());
    }
}
