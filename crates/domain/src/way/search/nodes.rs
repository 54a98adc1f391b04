//! The points at which a way may turn, climb or descend.
//!
//! Round an area, and in its holes, a way turns at its corners. Over or under it a way is level, and climbs and descends beside it: where the leg by
//! which the area was met comes to it and leaves it. The heights to try are those of the two ends, and the ones just over and under
//! the areas and the ground that were met. Where that gives no way, it climbs and descends at corners, too. Beside ground that is too high it climbs, descends and turns as well. A way that ends with a landing goes straight up or down first, to one of these heights, and last, over its
//! goal.

use std::collections::BTreeSet;

use super::legs::Obstacles;
use super::{Trip, Turns};
use crate::airspace::is_at_heights;
use crate::area::Area;
use crate::corners::{Corner, GrownRing};
use crate::geometry::Ned;
use crate::known_ground::{AROUND_M, Hill};
use crate::way::{Exempt, beyond, footholds};

/// The index of the start among the nodes.
pub(super) const START: usize = 0;
/// The index of the goal.
pub(super) const GOAL: usize = 1;

/// Heights that are tried in one search at most, the ends' among them. (ENG: each may double the search; the areas of one map have
/// few different ceilings.)
const MOST_HEIGHTS: usize = 6;

/// The nodes of a search, of which there are more with each area that is met.
pub(super) struct Nodes<'a> {
    obstacles: &'a Obstacles<'a>,
    heights: Vec<f64>,
    /// Areas whose corners have joined.
    met: BTreeSet<usize>,
    /// Areas whose heights have joined.
    crossed: BTreeSet<usize>,
    /// Ground that was too high for a leg, and whose height has joined.
    hills: Vec<Hill>,
    /// Where the way may climb and descend. There is a node at each of the heights.
    columns: Vec<(Ned, Place)>,
    /// [`START`], [`GOAL`], then the others.
    nodes: Vec<Node>,
    /// Those of them that are not corners.
    open: Vec<usize>,
    /// The others.
    rings: Vec<Ring<'a>>,
}

/// The corners of one ring of an area, its outline or a hole, at one height: nodes that follow each other.
struct Ring<'a> {
    height_m: f64,
    first: usize,
    corners: &'a [Corner],
    /// The middle of a circle around them, and its radius in metres.
    centre: Ned,
    radius_m: f64,
}

/// The nodes and rings that there are at a moment.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Extent {
    open: usize,
    rings: usize,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    at: Ned,
    place: Place,
}

/// What is at a node, whatever its height.
#[derive(Debug, Clone, Copy)]
enum Place {
    Start,
    Goal,
    /// A corner of an area that is flown round.
    Corner(Corner),
    /// Beside an area.
    Beside,
}

impl<'a> Nodes<'a> {
    pub(super) fn new(obstacles: &'a Obstacles<'a>) -> Nodes<'a> {
        let Trip { from, to, lands_from_m, .. } = obstacles.trip;
        let (met, crossed) = (BTreeSet::new(), BTreeSet::new());
        let (nodes, open, rings) = (Vec::new(), Vec::new(), Vec::new());
        let (heights, hills, columns) = (Vec::new(), Vec::new(), Vec::new());
        let mut this = Nodes { obstacles, heights, met, crossed, hills, columns, nodes, open, rings };
        for (at, place) in [(from, Place::Start), (to, Place::Goal)] {
            this.columns.push((at, place));
            this.add_open(at, place);
        }
        this.add_height(obstacles.level_m);
        let may_stay_level = lands_from_m.is_none() || obstacles.among.limits.permits(from.height_m());
        if !obstacles.begins_level() && may_stay_level {
            this.add_height(from.height_m());
        }
        this
    }

    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    pub(super) fn at(&self, node: usize) -> Ned {
        self.nodes[node].at
    }

    /// Where the vehicle is and where it is to be is not the choice of a way, at no height.
    pub(super) fn exempt(&self, from: usize, to: usize) -> Exempt {
        let (from, to) = (self.nodes[from].place, self.nodes[to].place);
        Exempt { start: matches!(from, Place::Start), end: matches!(to, Place::Goal) }
    }

    /// What there is now.
    pub(super) fn extent(&self) -> Extent {
        Extent { open: self.open.len(), rings: self.rings.len() }
    }

    /// The nodes that are not corners, and of the rings those to which a leg from `from` may lead, but for those of
    /// `known`.
    pub(super) fn since(&self, known: Extent, from: usize, turns: Turns) -> (&[usize], impl Iterator<Item = usize>) {
        let Node { at, place } = self.nodes[from];
        let may_lead_to = move |ring: &Ring| {
            let may_turn = match place {
                Place::Corner(corner) => turns == Turns::Any || corner.may_lead_into(ring.centre, ring.radius_m),
                Place::Start | Place::Goal | Place::Beside => true,
            };
            may_turn && (from == START || ring.height_m == at.height_m())
        };
        let rings = known.rings..self.rings.len();
        (&self.open[known.open..], rings.filter(move |it| may_lead_to(&self.rings[*it])))
    }

    /// A circle over the ground around the corners of a ring: its middle, at their height, and its radius in metres.
    pub(super) fn around(&self, ring: usize) -> (Ned, f64) {
        (self.rings[ring].centre, self.rings[ring].radius_m)
    }

    /// Of the corners of a ring, those at which a cheapest way from `from` may turn: the area is on one side of the leg.
    pub(super) fn touched_from(&self, from: usize, ring: usize, turns: Turns) -> impl Iterator<Item = usize> {
        let (Ring { first, corners, .. }, a) = (&self.rings[ring], self.nodes[from].at);
        let is_touched = move |corner: &Corner| turns == Turns::Any || corner.is_touched_along(a, corner.at);
        let nodes = corners.iter().zip(*first..).filter(move |it| is_touched(it.0)).map(|it| it.1);
        nodes.filter(move |to| self.may_join(from, *to, turns))
    }

    /// Whether a leg leads straight up or down over one of the ends.
    pub(super) fn is_over(&self, end: usize, from: usize, to: usize) -> bool {
        let other = if from == end { to } else { from };
        (from == end || to == end)
            && match self.nodes[other].place {
                Place::Start => end == START,
                Place::Goal => end == GOAL,
                Place::Corner(_) | Place::Beside => false,
            }
    }

    /// Whether a cheapest way may have this leg, whose end meets the corner there, if any, as `turns` says: it climbs or descends only
    /// from the start, to the goal, beside areas, or straight up or down at a corner, and meets the corner where it begins as `turns` says.
    pub(super) fn may_join(&self, from: usize, to: usize, turns: Turns) -> bool {
        let (a, b) = (&self.nodes[from], &self.nodes[to]);
        let is_corner = |node: &Node| matches!(node.place, Place::Corner(_));
        let is_level = a.at.down_m == b.at.down_m;
        let is_straight_up = a.at.at_height(0.0) == b.at.at_height(0.0);
        let lands = self.obstacles.trip.lands_from_m.is_some();
        let may_climb = match (from, to) {
            (START, GOAL) if lands => false,
            (_, GOAL) if lands => return self.is_over(GOAL, from, to),
            (START, _) if lands && !self.obstacles.begins_level() => self.is_over(START, from, to),
            (START, _) | (_, GOAL) => true,
            _ => is_straight_up || !(is_corner(a) || is_corner(b)),
        };
        let leaves = match a.place {
            Place::Corner(corner) => turns == Turns::Any || corner.is_touched_along(a.at, b.at),
            Place::Start | Place::Goal | Place::Beside => true,
        };
        from != to && leaves && (may_climb || is_level)
    }

    /// The corners of these areas join, unless they have already.
    pub(super) fn meet(&mut self, zones: impl IntoIterator<Item = usize>) {
        let Obstacles { trip: Trip { from, to, .. }, margin_m, .. } = *self.obstacles;
        for zone in zones {
            if !self.met.insert(zone) {
                continue;
            }
            for height_m in self.heights.clone() {
                self.add_corners(zone, height_m);
            }
            for foothold in
                [from, to].into_iter().flat_map(|end| footholds(end, &[self.obstacles.area(zone)], margin_m))
            {
                // At the heights of the corners, too: the vehicle may be a little lower or higher than it flies.
                self.add_column(foothold, Place::Beside);
            }
        }
    }

    /// The leg from `a` to `b` meets these areas: the heights over and under them join, and the points where it comes to them
    /// and leaves them, unless they have already.
    pub(super) fn cross(&mut self, zones: &[usize], a: Ned, b: Ned) {
        let Obstacles { among, trip, .. } = *self.obstacles;
        let clearance_m = among.rule.vertical_margin_m + among.limits.height_clearance_m;
        // Over the goal a leg comes to no border: the straight way there does.
        let a = if a.horizontal_distance_m(b) == 0.0 { trip.from.at_height(b.height_m()) } else { a };
        for zone in zones {
            if !self.crossed.insert(*zone) {
                continue;
            }
            let area = self.obstacles.area(*zone);
            let heights: Vec<f64> = beyond(area, clearance_m).filter(|it| among.limits.permits(*it)).collect();
            heights.iter().for_each(|it| self.add_height(*it));
            if heights.is_empty() {
                continue;
            }
            let mut rings = self.obstacles.grown(*zone).iter().map(|it| it.ring.clone());
            let (corners, holes) = (rings.next().unwrap_or_default(), rings.collect());
            let fractions = Area { corners, holes, ..area.clone() }.crossings(a, b);
            let mut beside = fractions.into_iter().filter(|it| 0.0 < *it && *it < 1.0);
            let (first, last) = (beside.next(), beside.next_back());
            for place in [first, last].into_iter().flatten().map(|it| a.towards(b, it)) {
                self.add_column(place, Place::Beside);
            }
        }
    }

    /// At each corner of the areas that were met the way may climb and descend as well.
    pub(super) fn climb_at_corners(&mut self) {
        for zone in self.met.clone() {
            for corner in self.obstacles.grown(zone).iter().flat_map(|it| &it.corners) {
                self.add_column(corner.at, Place::Corner(*corner));
            }
        }
    }

    /// Whether there is more than one height.
    pub(super) fn may_climb(&self) -> bool {
        1 < self.heights.len()
    }

    /// Whether the leg from `a` to `b` is clear of the ground. The heights over ground that it is too low for join, and points beside it,
    /// unless they have already.
    pub(super) fn clear(&mut self, a: Ned, b: Ned) -> bool {
        let hills: Vec<Hill> = self.obstacles.hills(a, b).collect();
        for hill in &hills {
            if self.hills.contains(hill) {
                continue;
            }
            self.hills.push(*hill);
            if hill.clear_m <= self.obstacles.among.limits.highest_m {
                self.add_height(hill.clear_m);
            }
            for place in hill.at.into_iter().flat_map(|at| beside(at, a, b)) {
                self.add_column(place, Place::Beside);
            }
        }
        hills.is_empty()
    }

    fn add_column(&mut self, at: Ned, place: Place) {
        self.columns.push((at, place));
        for height_m in self.heights.clone() {
            self.add_open(at.at_height(height_m), place);
        }
    }

    /// Ways at this height are looked at as well, unless they are already, or there are enough others.
    fn add_height(&mut self, height_m: f64) {
        if self.heights.contains(&height_m) || self.heights.len() == MOST_HEIGHTS {
            return;
        }
        self.heights.push(height_m);
        // The ends themselves are there.
        let (start, goal) = (self.nodes[START].at, self.nodes[GOAL].at);
        for (at, place) in self.columns.clone() {
            let at = at.at_height(height_m);
            if at != goal && (at != start || matches!(place, Place::Goal)) {
                self.add_open(at, place);
            }
        }
        for zone in self.met.clone() {
            self.add_corners(zone, height_m);
        }
    }

    fn add_open(&mut self, at: Ned, place: Place) {
        self.open.push(self.nodes.len());
        self.nodes.push(Node { at, place });
    }

    /// The corners of an area, if it has to be flown round at this height.
    fn add_corners(&mut self, zone: usize, height_m: f64) {
        let Obstacles { trip, among, .. } = *self.obstacles;
        let level = trip.from.at_height(height_m);
        if !is_at_heights(self.obstacles.area(zone), level, level, among.rule.vertical_margin_m) {
            return;
        }
        for GrownRing { corners, .. } in self.obstacles.grown(zone).iter().filter(|it| !it.corners.is_empty()) {
            let extent = |of: fn(&Ned) -> f64| {
                let all = corners.iter().map(|it| of(&it.at));
                all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), it| (it.min(low), it.max(high)))
            };
            let (north_m, east_m) = (extent(|it| it.north_m), extent(|it| it.east_m));
            let centre = Ned::new((north_m.0 + north_m.1) / 2.0, (east_m.0 + east_m.1) / 2.0, -height_m);
            let radius_m = corners.iter().map(|it| it.at.horizontal_distance_m(centre)).fold(0.0, f64::max);
            self.rings.push(Ring { height_m, first: self.nodes.len(), corners, centre, radius_m });
            let node = |it: &Corner| Node { at: it.at.at_height(height_m), place: Place::Corner(*it) };
            self.nodes.extend(corners.iter().map(node));
        }
    }
}

/// Points from which a leg does not lead over the ground around `place`: before it and behind it on the way from `a` to `b`, and at the
/// corners of a square around it.
fn beside(place: Ned, a: Ned, b: Ned) -> Vec<Ned> {
    /// A little farther away, so that rounding does not bar a leg along it.
    const BESIDE_M: f64 = AROUND_M + 1.0;
    let (north_m, east_m) = (b.north_m - a.north_m, b.east_m - a.east_m);
    let length_m = north_m.hypot(east_m);
    if length_m == 0.0 {
        return Vec::new();
    }
    let (north, east) = (north_m / length_m, east_m / length_m);
    let along_m = (place.north_m - a.north_m) * north + (place.east_m - a.east_m) * east;
    let aside_m = (place.north_m - a.north_m) * east - (place.east_m - a.east_m) * north;
    let point = |along_m: f64, aside_m: f64| {
        Ned::new(a.north_m + along_m * north + aside_m * east, a.east_m + along_m * east - aside_m * north, a.down_m)
    };
    let half_m = (BESIDE_M * BESIDE_M - aside_m * aside_m).max(0.0).sqrt();
    let on_way = [along_m - half_m, along_m + half_m].into_iter().filter(|it| 0.0 < *it && *it < length_m);
    let corners = [(-BESIDE_M, -BESIDE_M), (-BESIDE_M, BESIDE_M), (BESIDE_M, -BESIDE_M), (BESIDE_M, BESIDE_M)];
    let corners = corners.into_iter().map(|(along, aside)| point(along_m + along, aside_m + aside));
    on_way.map(|along_m| point(along_m, 0.0)).chain(corners).collect()
}
