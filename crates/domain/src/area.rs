//! Areas: polygons with an altitude band, a time window and hours, entered with a permission or not at all.

use geo::{Contains, Distance, Euclidean, Intersects, Line, Polygon};
use sha2::{Digest, Sha256};

use crate::geometry::Ned;
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

/// Where an area is, as a grant names it: no other area of the same name has the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent {
    /// The SHA-256 of the corners in canonical form: see docs/formats.md.
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
    /// The corners in order, not closed; the heights are not used.
    pub corners: Vec<Ned>,
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
}

impl Area {
    /// Whether it is one that may be flown over and not landed in.
    pub fn only_bars_landings(&self) -> bool {
        self.kind == AreaKind::KeepOut && self.floor_m.is_none() && self.ceiling_m == Some(NO_LANDING_TO_M)
    }

    /// Where it is: the same on every machine, and whatever corner is listed first.
    pub fn extent(&self) -> Extent {
        let tenth_mm = |m: f64| (m * 1e4).round() as i64;
        let mut ring: Vec<_> = self.corners.iter().map(|it| (tenth_mm(it.north_m), tenth_mm(it.east_m))).collect();
        let first = (0..ring.len()).min_by_key(|it| ring[*it]).unwrap_or_default();
        ring.rotate_left(first);
        if ring.last() < ring.get(1) {
            ring[1..].reverse();
        }
        let mut hash = Sha256::new_with_prefix(b"kittiwake outline 1\0");
        for (north, east) in ring {
            hash.update(north.to_le_bytes());
            hash.update(east.to_le_bytes());
        }
        Extent {
            outline: hash.finalize().into(),
            floor_tenth_mm: self.floor_m.map(tenth_mm),
            ceiling_tenth_mm: self.ceiling_m.map(tenth_mm),
        }
    }

    /// The polygon; x is east, y is north.
    pub fn polygon(&self) -> Polygon<f64> {
        Polygon::new(self.corners.iter().map(|it| (it.east_m, it.north_m)).collect(), vec![])
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
        !self.is_beside(point, point) && self.polygon().contains(&geo::Point::new(point.east_m, point.north_m))
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
        if self.is_beside(from, to) { vec![0.0, 1.0] } else { Outline::new(self).crossings(from, to) }
    }

    /// Whether the bounding boxes of the way and the area do not touch: a cheap check that settles most pairs.
    pub(crate) fn is_beside(&self, from: Ned, to: Ned) -> bool {
        self.is_beyond(0.0, from, to)
    }

    /// Whether the bounding boxes of the way and the area are more than `distance_m` apart.
    pub(crate) fn is_beyond(&self, distance_m: f64, from: Ned, to: Ned) -> bool {
        let apart = |of: fn(&Ned) -> f64| {
            let (low, high) = (of(&from).min(of(&to)) - distance_m, of(&from).max(of(&to)) + distance_m);
            self.corners.iter().all(|it| of(it) < low) || self.corners.iter().all(|it| of(it) > high)
        };
        apart(|it| it.north_m) || apart(|it| it.east_m)
    }

    /// Distance over ground from `point` to the border, from inside or outside.
    pub fn distance_to_border_m(&self, point: Ned) -> f64 {
        Euclidean.distance(&geo::Point::new(point.east_m, point.north_m), self.polygon().exterior())
    }

    /// Whether the corners make a simple polygon: at least three, none twice, no two edges crossing.
    pub fn is_simple(&self) -> bool {
        let ring: Vec<_> = self.polygon().exterior().lines().collect();
        let count = ring.len();
        if count < 3 {
            return false;
        }
        (0..count).all(|i| {
            (i + 1..count).all(|j| {
                let neighbours = j == i + 1 || (i == 0 && j == count - 1);
                if neighbours { !overlaps(ring[i], ring[j]) } else { !ring[i].intersects(&ring[j]) }
            })
        })
    }
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
        Area {
            name: "a".into(),
            kind: AreaKind::Permission,
            corners: corners.iter().map(|&(north, east)| Ned::new(north, east, 0.0)).collect(),
            floor_m: None,
            ceiling_m: Some(100.0),
            from_utc_ms: None,
            until_utc_ms: None,
            hours: None,
        }
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

    #[test]
    fn a_self_crossing_polygon_is_not_simple() {
        assert!(area(&[(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)]).is_simple());
        assert!(!area(&[(0.0, 0.0), (10.0, 10.0), (10.0, 0.0), (0.0, 10.0)]).is_simple());
        assert!(!area(&[(0.0, 0.0), (10.0, 0.0)]).is_simple());
        assert!(!area(&[(0.0, 0.0), (10.0, 0.0), (5.0, 0.0)]).is_simple());
    }
}
