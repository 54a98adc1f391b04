//! The shortest level way round areas that may not be entered.
//!
//! A visibility graph over the corners of the areas, grown by a margin, but only of those that turn out to be in the way: the
//! search begins without any, and each area that a promising leg touches joins. Among hundreds of areas a way meets a few.
//! Legs are looked at only when they are the most promising ones (A* with lazy evaluation of the edges: Dellin and
//! Srinivasa, A Unifying Formalism for Shortest Path Problems with Expensive Edge Evaluations, ICAPS 2016), and among them
//! only tangents of the areas. Where too much is in the way the search is content with a way that is up to a tenth longer than the
//! shortest; where that leaves none, and among few areas at once, the corners of all are tried, and legs in all directions.

use std::cell::Cell;
use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};

use crate::airspace::stays_within;
use crate::area::Area;
use crate::corners::{Corner, corners};
use crate::geometry::Ned;
use crate::outline::Outline;
use crate::way::{Exempt, footholds};

/// The part of the margin that legs must keep: the corners lie a little farther out, so that rounding does not bar the leg
/// along a side.
pub const KEPT: f64 = 0.9;
/// Ways are compared in whole tenths of a millimetre, so that equal ones do not fall by rounding.
const PER_METRE: f64 = 1e4;

/// Areas with no more corners than this together are searched among everything.
const FEW_CORNERS: usize = 100;
/// Among areas with more corners than this together the exact search by tangents would only give up: its effort is saved, and a way
/// costs up to a tenth more than the best. (Measured: among 1,000 areas of 20 corners half of the time went into it.)
const MANY_CORNERS: usize = 5_000;
/// Every turn among all corners.
const EVERYTHING: Effort = Effort { turns: Turns::Any, factor: 1.0, most_legs: 20_000 };
/// With how much effort a way is searched among more of them, in this order. A passage that is narrower than two margins may be
/// flown by turns that are no tangents, so those are tried last.
const EFFORTS: [Effort; 3] = [
    Effort { turns: Turns::Taut, factor: 1.0, most_legs: 1_000 },
    Effort { turns: Turns::Taut, factor: 1.1, most_legs: 20_000 },
    Effort { factor: 1.1, ..EVERYTHING },
];

/// How a way is searched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Which legs meet at a corner.
    pub turns: Turns,
    /// The way is at most this many times as long, or as costly, as the best.
    pub factor: f64,
    /// The search gives up after this number of legs.
    pub most_legs: u32,
}

impl Effort {
    /// The efforts with which a way is searched among these areas, in this order.
    pub fn among<'a>(areas: impl Iterator<Item = &'a Area>) -> Vec<Effort> {
        let corners: usize = areas.map(|it| it.rings().map(<[Ned]>::len).sum::<usize>()).sum();
        let few = (corners <= FEW_CORNERS).then_some(EVERYTHING);
        let is_exact = |it: &Effort| it.factor == 1.0;
        few.into_iter().chain(EFFORTS.into_iter().filter(|it| corners <= MANY_CORNERS || !is_exact(it))).collect()
    }
}

/// A search among areas at one height.
pub(super) struct Level<'a> {
    /// Those at this height that may not be entered.
    areas: Vec<&'a Area>,
    /// Of the same areas.
    outlines: Vec<Outline>,
    /// Distance kept to their borders, in metres.
    margin_m: f64,
    /// Heights this close to a floor or a ceiling count as inside, in metres.
    vertical_margin_m: f64,
    /// Legs that may still be looked at; without any left there is no way.
    legs_left: &'a Cell<u32>,
}

impl<'a> Level<'a> {
    /// A search among `areas` at one height. It counts `legs_left` down, and finds nothing once that is 0.
    pub(super) fn new(
        areas: Vec<&'a Area>,
        margin_m: f64,
        vertical_margin_m: f64,
        legs_left: &'a Cell<u32>,
    ) -> Level<'a> {
        let outlines = areas.iter().map(|it| Outline::new(it)).collect();
        Level { areas, outlines, margin_m, vertical_margin_m, legs_left }
    }

    /// The points to fly to from `from`, the last one is `to`; `None` if there is no way.
    pub(super) fn shortest(&self, from: Ned, to: Ned) -> Option<Vec<Ned>> {
        let efforts = Effort::among(self.areas.iter().copied());
        efforts.into_iter().find_map(|effort| Search::new(self, from, to, effort).shortest())
    }

    fn is_clear_of(&self, area: usize, from: Ned, to: Ned, exempt: Exempt) -> bool {
        let (area, outline, kept_m) = (self.areas[area], &self.outlines[area], KEPT * self.margin_m);
        outline.is_beyond(kept_m, from, to)
            || outline.is_aside(kept_m, from, to)
            || (stays_within(area, outline, from, to, self.vertical_margin_m).is_empty()
                && outline.keeps_clear(from, to, kept_m, exempt))
    }
}

/// A point at which a way may turn.
struct Point {
    at: Ned,
    /// Absent for the ends.
    corner: Option<Corner>,
    /// The point before it and the length up to it, once they are settled.
    settled: Option<(usize, u64)>,
}

/// A leg that may be looked at: the least length of a way with it, the length up to its end, its end and its start.
type Promise = Reverse<(u64, u64, usize, usize)>;

struct Search<'a> {
    level: &'a Level<'a>,
    effort: Effort,
    looked_at: u32,
    /// [`START`], [`GOAL`], then the corners.
    points: Vec<Point>,
    met: BTreeSet<usize>,
    open: BinaryHeap<Promise>,
}

impl<'a> Search<'a> {
    fn new(level: &'a Level<'a>, from: Ned, to: Ned, effort: Effort) -> Search<'a> {
        let points = [from, to].map(|at| Point { at, corner: None, settled: None }).into();
        Search { level, effort, looked_at: 0, points, met: BTreeSet::new(), open: BinaryHeap::new() }
    }

    fn shortest(mut self) -> Option<Vec<Ned>> {
        if self.effort.turns == Turns::Any {
            self.meet(0..self.level.areas.len());
        }
        self.settle(START, START, 0);
        while let Some(Reverse((_, length, here, before))) = self.open.pop() {
            if self.points[here].settled.is_some() {
                continue;
            }
            self.looked_at += 1;
            self.level.legs_left.set(self.level.legs_left.get().checked_sub(1)?);
            if self.effort.most_legs < self.looked_at {
                return None;
            }
            let (a, b) = (self.points[before].at, self.points[here].at);
            let exempt = Exempt { start: before == START, end: here == GOAL };
            let is_touched = |area: &usize| !self.level.is_clear_of(*area, a, b, exempt);
            let touched: Vec<usize> = (0..self.level.areas.len()).filter(is_touched).collect();
            if !touched.is_empty() {
                self.meet(touched);
                continue;
            }
            if here == GOAL {
                self.points[GOAL].settled = Some((before, length));
                return Some(self.way());
            }
            self.settle(here, before, length);
        }
        None
    }

    /// The shortest way to `here` is known: the legs from there may be looked at.
    fn settle(&mut self, here: usize, before: usize, length: u64) {
        self.points[here].settled = Some((before, length));
        (0..self.points.len()).for_each(|there| self.promise(here, there));
    }

    fn promise(&mut self, here: usize, there: usize) {
        let Some((_, length)) = self.points[here].settled else { return };
        let (a, b) = (&self.points[here], &self.points[there]);
        let touches = |corner: Option<Corner>| corner.is_none_or(|it| it.is_touched_along(a.at, b.at));
        if b.settled.is_some() || (self.effort.turns == Turns::Taut && !(touches(a.corner) && touches(b.corner))) {
            return;
        }
        let tenths = |a: Ned, b: Ned| (a.distance_m(b) * PER_METRE).ceil() as u64;
        let length = length + tenths(a.at, b.at);
        let rest = (self.effort.factor * tenths(b.at, self.points[GOAL].at) as f64) as u64;
        self.open.push(Reverse((length + rest, length, there, here)));
    }

    /// The corners of these areas join, unless they have already, as ends of legs from all that is settled. That stays so: a
    /// shorter way round such an area would have been tried straight through it first.
    fn meet(&mut self, areas: impl IntoIterator<Item = usize>) {
        let old = self.points.len();
        let (from, to, margin_m) = (self.points[START].at, self.points[GOAL].at, self.level.margin_m);
        for area in areas {
            if !self.met.insert(area) {
                continue;
            }
            let area = self.level.areas[area];
            let point = |at, corner| Point { at, corner, settled: None };
            self.points.extend(corners(area, margin_m).map(|it| point(it.at.at_height(to.height_m()), Some(it))));
            let beside = [from, to].into_iter().flat_map(|end| footholds(end, &[area], margin_m));
            self.points.extend(beside.map(|at| point(at, None)));
        }
        for there in old..self.points.len() {
            (0..old).for_each(|here| self.promise(here, there));
        }
    }

    fn way(&self) -> Vec<Ned> {
        let before = |it: &usize| self.points[*it].settled.map(|(before, _)| before).filter(|it| *it != START);
        let mut way: Vec<Ned> = std::iter::successors(Some(GOAL), before).map(|it| self.points[it].at).collect();
        way.reverse();
        way
    }
}

/// Which legs meet at a corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Turns {
    /// Those of a way that cannot be cut short there.
    Taut,
    /// All: a place between two areas may be so narrow that one of their corners is too near to the other area.
    Any,
}

/// The index of the start among the points.
const START: usize = 0;
/// The index of the goal.
const GOAL: usize = 1;

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use proptest::prelude::*;

    use super::*;
    use crate::area::AreaKind;

    fn area(centre: (f64, f64), radius_m: f64, corners: usize) -> Area {
        let corner = |corner: usize| {
            let (north, east) = (TAU * corner as f64 / corners as f64).sin_cos();
            Ned::new(centre.0 + radius_m * north, centre.1 + radius_m * east, 0.0)
        };
        Area::new(format!("{centre:?}"), AreaKind::KeepOut, (0..corners).map(corner).collect())
    }

    fn level<'a>(areas: &'a [Area], legs_left: &'a Cell<u32>) -> Level<'a> {
        Level::new(areas.iter().collect(), 10.0, 2.0, legs_left)
    }

    fn length_m(from: Ned, way: &[Ned]) -> f64 {
        std::iter::once(&from).chain(way).zip(way).map(|(a, b)| a.distance_m(*b)).sum()
    }

    fn any_area() -> impl Strategy<Value = Area> {
        let radius_m = prop_oneof![4 => 20.0..150.0, 1 => 300.0..800.0];
        let hole = proptest::option::weighted(0.4, 0.3..0.95);
        ((-400.0..400.0, -400.0..400.0), radius_m, 3..9usize, hole).prop_map(|(centre, radius_m, corners, hole)| {
            let ring = |part: f64| area(centre, part * radius_m, corners).corners;
            Area { holes: hole.into_iter().map(ring).collect(), ..area(centre, radius_m, corners) }
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn among_few_areas_the_way_is_the_shortest_and_a_search_by_tangents_keeps_its_margins(
            areas in proptest::collection::vec(any_area(), 0..7),
            from in (-500.0..500.0, -500.0..500.0),
            to in (-500.0..500.0, -500.0..500.0),
        ) {
            let (from, to) = (Ned::new(from.0, from.1, -10.0), Ned::new(to.0, to.1, -10.0));
            let legs_left = Cell::new(u32::MAX);
            let level = level(&areas, &legs_left);
            let search = |effort| Search::new(&level, from, to, effort).shortest();
            let best = search(Effort { most_legs: u32::MAX, ..EVERYTHING });
            prop_assert_eq!(&level.shortest(from, to), &best);
            for taut in EFFORTS[..2].iter().filter_map(|it| search(*it)) {
                let way: Vec<Ned> = std::iter::once(from).chain(taut).collect();
                let best_m = length_m(from, &best.clone().expect("there is a way"));
                prop_assert!(best_m < length_m(from, &way[1..]) + 0.01);
                for (index, leg) in way.windows(2).enumerate() {
                    let exempt = Exempt { start: index == 0, end: index == way.len() - 2 };
                    prop_assert!((0..areas.len()).all(|it| level.is_clear_of(it, leg[0], leg[1], exempt)), "{way:?}");
                }
            }
        }
    }

    #[test]
    fn among_many_corners_no_effort_is_spent_on_the_exact_search() {
        #[track_caller]
        fn check(areas: usize, corners: usize, expected: &[f64]) {
            let areas: Vec<Area> = (0..areas).map(|it| area((0.0, 300.0 * it as f64), 100.0, corners)).collect();
            let factors: Vec<f64> = Effort::among(areas.iter()).iter().map(|it| it.factor).collect();
            assert_eq!(factors, expected);
        }
        check(5, 20, &[1.0, 1.0, 1.1, 1.1]);
        check(50, 100, &[1.0, 1.1, 1.1]);
        check(51, 100, &[1.1, 1.1]);
    }

    #[test]
    fn a_way_among_hundreds_of_areas_is_found_at_little_cost() {
        let areas: Vec<Area> = (0..400)
            .map(|it| {
                area(
                    (300.0 * f64::from(it / 20), 300.0 * f64::from(it % 20) + 75.0 * f64::from(it / 20 % 4)),
                    110.0,
                    20,
                )
            })
            .collect();
        let (from, to) = (Ned::new(-300.0, -300.0, -10.0), Ned::new(6200.0, 6300.0, -10.0));
        let legs_left = Cell::new(u32::MAX);
        let way = level(&areas, &legs_left).shortest(from, to).expect("there is a way");
        assert!(length_m(from, &way) < 1.1 * from.distance_m(to), "{way:?}");
        assert!(u32::MAX - legs_left.get() < super::super::MOST_LEGS, "{}", u32::MAX - legs_left.get());
    }
}
