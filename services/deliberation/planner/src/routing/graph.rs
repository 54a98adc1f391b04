//! A* over the corners of the areas that were met, with legs looked at only when they are the most promising ones (lazy
//! evaluation of the edges: Dellin and Srinivasa, A Unifying Formalism for Shortest Path Problems with Expensive Edge
//! Evaluations, ICAPS 2016), and among them only those that may be part of a cheapest way (the tangents of the areas).

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};
use std::time::Duration;

use domain::airspace::{latest, soonest};
use domain::area::AreaKind;
use domain::corners::{Corner, corners};
use domain::geometry::Ned;
use domain::way::{Effort, Exempt, Turns, footholds};

use super::legs::{Leg, Obstacles};
use super::{Open, PROHIBITIVE_MS, TimedWay};
use crate::airspace::{Access, Asked};

/// From a start and a goal whose heights differ by more than this, ways at both heights are tried, in metres.
const SAME_HEIGHT_M: f64 = 1.0;

/// The index of the start among the nodes.
const START: usize = 0;
/// The index of the goal.
const GOAL: usize = 1;

/// The visibility graph: the two ends, and the corners of the areas that were met so far.
pub(super) struct Graph<'a> {
    obstacles: &'a Obstacles<'a>,
    begins: Duration,
    effort: Effort,
    heights: Vec<f64>,
    met: BTreeSet<usize>,
    /// [`START`], [`GOAL`], then the corners.
    nodes: Vec<Node>,
    legs: BTreeMap<(usize, usize), Leg>,
    labels: Vec<Label>,
    open: BinaryHeap<Reverse<(u64, Next)>>,
    /// Labels from which legs begin.
    expanded: Vec<usize>,
}

/// A point at which a way may turn.
struct Node {
    at: Ned,
    /// Absent for the ends.
    corner: Option<Corner>,
    /// Labels that no other one is as good as.
    settled: Vec<usize>,
}

/// A node that was reached, after asking for zones.
struct Label {
    node: usize,
    asked: Asked,
    cost_ms: u64,
    at: Duration,
    before: Option<usize>,
    entered: Vec<usize>,
}

/// What may be looked at next; the cheapest first, then what was found first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Next {
    /// A node that is reached, by the index of its label.
    Reached(usize),
    /// A leg that may be barred, or dearer than its flight: from this label to this node.
    Perhaps(usize, usize),
}

impl<'a> Graph<'a> {
    pub(super) fn new(obstacles: &'a Obstacles<'a>, begins: Duration, both_heights: bool, effort: Effort) -> Graph<'a> {
        let Obstacles { from, to, .. } = *obstacles;
        let differ = SAME_HEIGHT_M < (from.height_m() - to.height_m()).abs();
        let mut heights = vec![to.height_m()];
        let mut ends = vec![from, to];
        if both_heights && differ {
            heights.push(from.height_m());
            ends.extend([from.at_height(to.height_m()), to.at_height(from.height_m())]);
        }
        let node = |at| Node { at, corner: None, settled: Vec::new() };
        Graph {
            obstacles,
            begins,
            effort,
            heights,
            met: BTreeSet::new(),
            nodes: ends.into_iter().map(node).collect(),
            legs: BTreeMap::new(),
            labels: Vec::new(),
            open: BinaryHeap::new(),
            expanded: Vec::new(),
        }
    }

    /// The way of the least cost, or up to the stated factor more, if enough legs may be looked at.
    pub(super) fn search(mut self) -> Option<TimedWay> {
        if self.effort.turns == Turns::Any {
            self.meet(&self.obstacles.all());
        }
        let start =
            Label { node: START, asked: Asked::new(), cost_ms: 0, at: self.begins, before: None, entered: vec![] };
        self.reach(start);
        let mut looked_at = 0;
        while let Some(Reverse((_, next))) = self.open.pop() {
            match next {
                Next::Perhaps(from, to) => {
                    let Label { node, asked, cost_ms, .. } = &self.labels[from];
                    if self.is_settled(to, asked, cost_ms + self.flight_ms(*node, to)) {
                        continue;
                    }
                    looked_at += 1;
                    if self.effort.most_legs < looked_at {
                        self.obstacles.among.gave_up.set(true);
                        return None;
                    }
                    self.look_at(from, to);
                    if let Some(label) = self.fly(from, to) {
                        self.reach(label);
                    }
                }
                Next::Reached(index) => {
                    let Label { node, asked, cost_ms, .. } = &self.labels[index];
                    if self.is_settled(*node, asked, *cost_ms) {
                        continue;
                    }
                    let node = *node;
                    if node == GOAL {
                        return Some(self.way_to(index));
                    }
                    self.nodes[node].settled.push(index);
                    self.expanded.push(index);
                    (GOAL..self.nodes.len()).for_each(|to| self.perhaps(index, to));
                }
            }
        }
        None
    }

    fn reach(&mut self, label: Label) {
        self.open.push(Reverse((label.cost_ms + self.least_ms(label.node), Next::Reached(self.labels.len()))));
        self.labels.push(label);
    }

    /// The leg from the label `index` to the node `to` may be looked at.
    fn perhaps(&mut self, index: usize, to: usize) {
        let Label { node, asked, cost_ms, .. } = &self.labels[index];
        if *node == to || !self.is_taut(*node, to) {
            return;
        }
        let cost_ms = cost_ms + self.flight_ms(*node, to);
        if !self.is_settled(to, asked, cost_ms) {
            self.open.push(Reverse((cost_ms + self.least_ms(to), Next::Perhaps(index, to))));
        }
    }

    /// Finds out what the leg touches. Areas that are met by this have their corners join, as goals of all legs that begin
    /// anywhere up to now: what was settled before stays so, since a cheaper way round such an area would have been tried
    /// straight through it first.
    fn look_at(&mut self, index: usize, to: usize) {
        let from = self.labels[index].node;
        if self.legs.contains_key(&(from, to)) {
            return;
        }
        let exempt = Exempt { start: from == START, end: to == GOAL };
        let leg = self.obstacles.leg(self.nodes[from].at, self.nodes[to].at, exempt);
        let touched: BTreeSet<usize> = leg.stays.iter().map(|it| it.0).chain(leg.near.iter().copied()).collect();
        self.legs.insert((from, to), leg);
        let old = self.nodes.len();
        self.meet(&touched);
        for to in old..self.nodes.len() {
            for at in 0..self.expanded.len() {
                self.perhaps(self.expanded[at], to);
            }
        }
    }

    /// The corners of these areas join, unless they have already.
    fn meet(&mut self, zones: &BTreeSet<usize>) {
        let Obstacles { from, to, margin_m, .. } = *self.obstacles;
        for zone in zones.iter().filter(|it| self.met.insert(**it)) {
            let area = self.obstacles.area(*zone);
            let node = |at, corner| Node { at, corner, settled: Vec::new() };
            let corners = corners(&area.corners, margin_m);
            for height_m in &self.heights {
                self.nodes.extend(corners.iter().map(|it| node(it.at.at_height(*height_m), Some(*it))));
            }
            let beside = [from, to].into_iter().flat_map(|end| footholds(end, &[area], margin_m));
            self.nodes.extend(beside.map(|at| node(at, None)));
        }
    }

    /// Whether a settled label of `node` is as good as one at this cost: no way on from there is cheaper, since what only it has
    /// asked for can still be asked for on the way.
    fn is_settled(&self, node: usize, asked: &Asked, cost_ms: u64) -> bool {
        let wait_ms = |zone: &usize| match self.obstacles.among.airspace.zones[*zone].access {
            Access::Ask { wait_s, .. } => (wait_s * 1e3).ceil() as u64,
            Access::Closed { .. } => PROHIBITIVE_MS,
        };
        self.nodes[node].settled.iter().map(|index| &self.labels[*index]).any(|other| {
            other.cost_ms <= cost_ms && {
                let missing_ms: u64 = asked.difference(&other.asked).map(wait_ms).sum();
                other.cost_ms + missing_ms <= cost_ms
            }
        })
    }

    fn way_to(&self, goal: usize) -> TimedWay {
        let back = std::iter::successors(Some(goal), |index| self.labels[*index].before);
        let mut along: Vec<&Label> = back.map(|index| &self.labels[index]).collect();
        along.reverse();
        let points = along.iter().map(|label| (self.nodes[label.node].at, label.at)).collect();
        (points, along.iter().flat_map(|label| label.entered.clone()).collect())
    }

    /// What the rest of the way costs at least, times the factor that it may cost too much.
    fn least_ms(&self, node: usize) -> u64 {
        let distance_m = self.nodes[node].at.distance_m(self.nodes[GOAL].at);
        (self.effort.factor * self.obstacles.among.config.flight_time_s(distance_m) * 1e3).floor() as u64
    }

    /// Whether a cheapest way may have this leg.
    fn is_taut(&self, from: usize, to: usize) -> bool {
        let (from, to) = (&self.nodes[from], &self.nodes[to]);
        let touches = |corner: Option<Corner>| corner.is_none_or(|it| it.is_touched_along(from.at, to.at));
        self.effort.turns == Turns::Any || (touches(from.corner) && touches(to.corner))
    }

    /// A leg more costs something, so that no point is flown to without need.
    fn flight_ms(&self, from: usize, to: usize) -> u64 {
        let time = self.obstacles.among.config.flight_time(self.nodes[from].at.distance_m(self.nodes[to].at));
        (time.as_secs_f64() * 1e3).ceil() as u64 + 1
    }

    /// The label at `to` after the leg from the label `index`, which was looked at; `None` if it must not be flown then.
    fn fly(&self, index: usize, to: usize) -> Option<Label> {
        let from = &self.labels[index];
        let leg = self.legs.get(&(from.node, to))?;
        let obstacles = self.obstacles;
        let (airspace, planned) = (obstacles.among.airspace, obstacles.among.asked);
        let at = |fraction: f64| from.at.saturating_add(leg.time.mul_f64(fraction));
        let is_asked = |zone: usize| planned.contains(&zone) || from.asked.contains(&zone);
        let bars = |zone: usize, enters: f64, leaves: f64| {
            let area = airspace.zones[zone].area;
            let is_free = area.kind == AreaKind::Permission && is_asked(zone);
            !is_free && airspace.rule.bars(area, soonest(at(enters)), latest(at(leaves))).is_some()
        };
        if leg.near.iter().any(|zone| bars(*zone, 0.0, 1.0) && !opens(obstacles, *zone)) {
            return None;
        }
        let (mut wait_ms, mut wait_s, mut entered) = (0, 0.0_f64, Vec::new());
        for (zone, stays) in &leg.stays {
            if !stays.iter().any(|stay| bars(*zone, stay.enters, stay.leaves)) || from.asked.contains(zone) {
                continue;
            }
            match airspace.zones[*zone].access {
                Access::Ask { wait_s: expected_s, .. } => {
                    wait_ms += (expected_s * 1e3).ceil() as u64;
                    wait_s += expected_s;
                }
                Access::Closed { .. } if opens(obstacles, *zone) => wait_ms += PROHIBITIVE_MS,
                Access::Closed { .. } => return None,
            }
            entered.push(*zone);
        }
        let mut asked = from.asked.clone();
        asked.extend(&entered);
        let wait = Duration::try_from_secs_f64(wait_s).unwrap_or(Duration::MAX);
        Some(Label {
            node: to,
            asked,
            cost_ms: from.cost_ms + self.flight_ms(from.node, to) + wait_ms,
            at: at(1.0).saturating_add(wait),
            before: Some(index),
            entered,
        })
    }
}

/// Whether a closed zone counts as one that can be entered.
fn opens(obstacles: &Obstacles, zone: usize) -> bool {
    match obstacles.among.open {
        Open::Nothing => false,
        Open::Permissions => obstacles.area(zone).kind == AreaKind::Permission,
        Open::Everything => true,
    }
}
