//! The points at which a way may turn, climb or descend.
//!
//! Round an area a way turns at its corners. Over or under it a way is level, and climbs and descends beside it: where the leg by
//! which the area was met comes to it and leaves it. The heights to try are those of the two ends, and the ones just over and under
//! the areas that were met.

use std::collections::BTreeSet;

use domain::airspace::is_at_heights;
use domain::area::Area;
use domain::corners::{Corner, corners};
use domain::geometry::Ned;
use domain::way::{Exempt, Turns, beyond, footholds};

use super::legs::Obstacles;

/// The index of the start among the nodes.
pub(super) const START: usize = 0;
/// The index of the goal.
pub(super) const GOAL: usize = 1;

/// Heights that are tried in one search at most, the ends' among them. (ENG: each may double the search; the areas of one map have
/// few different ceilings.)
const MOST_HEIGHTS: usize = 6;

/// From a start and a goal whose heights differ by more than this, ways at both heights are tried, in metres.
const SAME_HEIGHT_M: f64 = 1.0;

/// The nodes of a search, of which there are more with each area that is met.
pub(super) struct Nodes<'a> {
    obstacles: &'a Obstacles<'a>,
    heights: Vec<f64>,
    /// Areas whose corners have joined.
    met: BTreeSet<usize>,
    /// Areas whose heights have joined.
    crossed: BTreeSet<usize>,
    /// Where the way may climb and descend. There is a node at each of the heights.
    columns: Vec<(Ned, Place)>,
    /// [`START`], [`GOAL`], then the others.
    nodes: Vec<Node>,
}

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
        let Obstacles { from, to, .. } = *obstacles;
        let columns = vec![(from, Place::Start), (to, Place::Goal)];
        let nodes = columns.iter().map(|&(at, place)| Node { at, place }).collect();
        let (met, crossed) = (BTreeSet::new(), BTreeSet::new());
        let mut this = Nodes { obstacles, heights: Vec::new(), met, crossed, columns, nodes };
        this.add_height(to.height_m());
        if SAME_HEIGHT_M < (from.height_m() - to.height_m()).abs() {
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

    /// Whether a cheapest way may have this leg: it climbs or descends only from the start, to the goal, or beside areas, and
    /// meets corners as `turns` says.
    pub(super) fn may_join(&self, from: usize, to: usize, turns: Turns) -> bool {
        let (a, b) = (&self.nodes[from], &self.nodes[to]);
        let is_corner = |node: &Node| matches!(node.place, Place::Corner(_));
        let may_climb = from == START || to == GOAL || !(is_corner(a) || is_corner(b));
        let touches = |node: &Node| match node.place {
            Place::Corner(corner) => corner.is_touched_along(a.at, b.at),
            Place::Start | Place::Goal | Place::Beside => true,
        };
        (may_climb || a.at.down_m == b.at.down_m) && (turns == Turns::Any || (touches(a) && touches(b)))
    }

    /// The corners of these areas join, unless they have already.
    pub(super) fn meet(&mut self, zones: &BTreeSet<usize>) {
        let Obstacles { from, to, margin_m, .. } = *self.obstacles;
        for zone in zones {
            if !self.met.insert(*zone) {
                continue;
            }
            let area = self.obstacles.area(*zone);
            for height_m in self.heights.clone() {
                self.add_corners(area, height_m);
            }
            for foothold in [from, to].into_iter().flat_map(|end| footholds(end, &[area], margin_m)) {
                self.nodes.push(Node { at: foothold, place: Place::Beside });
            }
        }
    }

    /// The leg from `a` to `b` meets these areas: the heights over and under them join, and the points where it comes to them
    /// and leaves them, unless they have already.
    pub(super) fn cross(&mut self, zones: &BTreeSet<usize>, a: Ned, b: Ned) {
        let Obstacles { margin_m, among, .. } = *self.obstacles;
        let limits = among.config.flight_limits();
        let clearance_m = among.config.vertical_margin_m.get() + among.config.vertical_tolerance_m.get();
        for zone in zones {
            if !self.crossed.insert(*zone) {
                continue;
            }
            let area = self.obstacles.area(*zone);
            let heights: Vec<f64> = beyond(area, clearance_m).filter(|it| limits.permits(*it)).collect();
            heights.iter().for_each(|it| self.add_height(*it));
            if heights.is_empty() {
                continue;
            }
            let corners = corners(&area.corners, margin_m).into_iter().map(|it| it.at).collect();
            let fractions = Area { corners, ..area.clone() }.crossings(a, b);
            let mut beside = fractions.into_iter().filter(|it| 0.0 < *it && *it < 1.0);
            let (first, last) = (beside.next(), beside.next_back());
            for place in [first, last].into_iter().flatten().map(|it| a.towards(b, it)) {
                self.columns.push((place, Place::Beside));
                self.nodes
                    .extend(self.heights.iter().map(|it| Node { at: place.at_height(*it), place: Place::Beside }));
            }
        }
    }

    /// Ways at this height are looked at as well, unless they are already, or there are enough others.
    fn add_height(&mut self, height_m: f64) {
        if self.heights.contains(&height_m) || self.heights.len() == MOST_HEIGHTS {
            return;
        }
        self.heights.push(height_m);
        let columns = self.columns.iter().map(|(at, place)| Node { at: at.at_height(height_m), place: *place });
        // The ends themselves are there.
        let (start, goal) = (self.nodes[START].at, self.nodes[GOAL].at);
        self.nodes.extend(columns.filter(|it| it.at != start && it.at != goal));
        for zone in self.met.clone() {
            self.add_corners(self.obstacles.area(zone), height_m);
        }
    }

    /// The corners of `area`, if it has to be flown round at this height.
    fn add_corners(&mut self, area: &Area, height_m: f64) {
        let Obstacles { from, margin_m, among, .. } = *self.obstacles;
        let level = from.at_height(height_m);
        if is_at_heights(area, level, level, among.airspace.rule.vertical_margin_m) {
            let node = |it: Corner| Node { at: it.at.at_height(height_m), place: Place::Corner(it) };
            self.nodes.extend(corners(&area.corners, margin_m).into_iter().map(node));
        }
    }
}
