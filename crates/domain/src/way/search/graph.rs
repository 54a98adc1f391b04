//! A* over the corners of the areas that were met, with legs looked at only when they are the most promising ones (lazy
//! evaluation of the edges: Dellin and Srinivasa, A Unifying Formalism for Shortest Path Problems with Expensive Edge
//! Evaluations, ICAPS 2016), and among them only those that may be part of a cheapest way (the tangents of the areas).

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::time::Duration;

use super::legs::{Obstacles, Touched};
use super::nodes::{Extent, GOAL, Nodes, START};
use super::{Asked, EVERYTHING, Effort, Entry, NoWay, PROHIBITIVE_MS, TimedWay, Turns, may_open};
use crate::airspace::{latest, soonest};
use crate::geometry::Ned;

/// A way that lands begins at another height than the preferred one only if it saves this much time.
const WORTH_ANOTHER_HEIGHT_S: f64 = 20.0;

/// The visibility graph: the two ends, and the points at which ways past the areas that were met so far may turn, climb or descend.
pub(super) struct Graph<'a> {
    obstacles: &'a Obstacles<'a>,
    effort: Effort,
    nodes: Nodes<'a>,
    /// By node, labels that no other one there is as good as.
    settled: Vec<Vec<usize>>,
    /// By node, what the rest of the way costs at least, times the factor that it may cost too much.
    least_ms: Vec<u64>,
    labels: Vec<Label>,
    open: BinaryHeap<Reverse<(u64, Next)>>,
    /// Labels from which legs begin.
    expanded: Vec<usize>,
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
    /// Legs from this label to the corners of this ring may be looked at.
    Around(usize, usize),
    /// A node that is reached, by the index of its label.
    Reached(usize),
    /// A leg that may be barred, or dearer than its flight: from this label to this node.
    Perhaps(usize, usize),
}

impl<'a> Graph<'a> {
    pub(super) fn new(obstacles: &'a Obstacles<'a>, effort: Effort) -> Graph<'a> {
        Graph {
            obstacles,
            effort,
            nodes: Nodes::new(obstacles),
            settled: Vec::new(),
            least_ms: Vec::new(),
            labels: Vec::new(),
            open: BinaryHeap::new(),
            expanded: Vec::new(),
        }
    }

    /// The way of the least cost, or up to the stated factor more, if enough legs may be looked at.
    pub(super) fn search(mut self) -> Result<TimedWay, NoWay> {
        if self.effort.turns == Turns::Any {
            self.nodes.meet(self.obstacles.all());
        }
        self.note_nodes();
        let at = self.obstacles.trip.begins;
        let start = Label { node: START, asked: Asked::new(), cost_ms: 0, at, before: None, entered: vec![] };
        self.reach(start);
        let mut looked_at = 0;
        let mut climbs_at_corners = false;
        loop {
            let Some(Reverse((_, next))) = self.open.pop() else {
                // It takes a node for each corner and height: among many corners, too many.
                if climbs_at_corners || self.effort != EVERYTHING || !self.nodes.may_climb() {
                    return Err(NoWay::Closed);
                }
                climbs_at_corners = true;
                self.climb_at_corners();
                continue;
            };
            match next {
                Next::Around(index, ring) => self.around(index, ring),
                Next::Perhaps(from, to) => {
                    let Label { node, asked, cost_ms, .. } = &self.labels[from];
                    if self.is_settled(to, asked, cost_ms + self.flight_ms(*node, to)) {
                        continue;
                    }
                    looked_at += 1;
                    let legs_left = self.obstacles.among.legs_left;
                    let left = legs_left.get().checked_sub(1);
                    legs_left.set(left.unwrap_or(0));
                    if self.effort.most_legs < looked_at || left.is_none() {
                        return Err(NoWay::GaveUp);
                    }
                    if let Some(label) = self.look_at(from, to) {
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
                        return Ok(self.way_to(index));
                    }
                    self.settled[node].push(index);
                    self.expanded.push(index);
                    self.look_around(index, Extent::default());
                }
            }
        }
    }

    /// Nothing is left to look at: the way may climb and descend at all corners, which takes many nodes.
    fn climb_at_corners(&mut self) {
        let before = self.nodes.extent();
        self.nodes.climb_at_corners();
        self.look_at_nodes_since(before);
    }

    fn reach(&mut self, label: Label) {
        self.open.push(Reverse((label.cost_ms + self.least_ms[label.node], Next::Reached(self.labels.len()))));
        self.labels.push(label);
    }

    /// Legs from all labels that were expanded may be looked at, to nodes that have joined since.
    fn look_at_nodes_since(&mut self, before: Extent) {
        if self.settled.len() < self.nodes.len() {
            self.note_nodes();
            for at in 0..self.expanded.len() {
                self.look_around(self.expanded[at], before);
            }
        }
    }

    /// Legs from the label `index` may be looked at, to all nodes but those that there were before.
    fn look_around(&mut self, index: usize, before: Extent) {
        let Label { node, cost_ms, .. } = self.labels[index];
        let (open, rings) = self.nodes.since(before, node, self.effort.turns);
        for to in open {
            if self.nodes.may_join(node, *to, self.effort.turns)
                && let Some(next) = self.perhaps(index, *to)
            {
                self.open.push(next);
            }
        }
        let at = self.nodes.at(node);
        let speed_m_s = self.obstacles.among.limits.speeds.cruise_m_s;
        for ring in rings {
            // No way by a point in a circle is shorter than one by the nearest points to both ends.
            let (centre, radius_m) = self.nodes.around(ring);
            let beside_s = |end: Ned| (end.horizontal_distance_m(centre) - radius_m).max(0.0) / speed_m_s;
            let least_s = beside_s(at) + self.effort.factor * beside_s(self.nodes.at(GOAL));
            let least_ms = cost_ms + (least_s * 1e3).floor() as u64;
            self.open.push(Reverse((least_ms, Next::Around(index, ring))));
        }
    }

    /// Legs from the label `index` to the corners of a ring may be looked at.
    fn around(&mut self, index: usize, ring: usize) {
        let node = self.labels[index].node;
        for to in self.nodes.touched_from(node, ring, self.effort.turns) {
            if let Some(next) = self.perhaps(index, to) {
                self.open.push(next);
            }
        }
    }

    /// The leg from the label `index` to the node `to` may be looked at, unless nothing is gained by it.
    fn perhaps(&self, index: usize, to: usize) -> Option<Reverse<(u64, Next)>> {
        let Label { node, asked, cost_ms, .. } = &self.labels[index];
        let cost_ms = cost_ms + self.flight_ms(*node, to);
        (!self.is_settled(to, asked, cost_ms)).then(|| Reverse((cost_ms + self.least_ms[to], Next::Perhaps(index, to))))
    }

    /// The label at `to` after the leg from the label `index`; `None` if it must not be flown then. Areas that are met by this have
    /// their corners join, as goals of all legs that begin anywhere up to now: what was settled before stays so, since a cheaper way
    /// round such an area would have been tried straight through it first.
    fn look_at(&mut self, index: usize, to: usize) -> Option<Label> {
        let from = self.labels[index].node;
        let (here, there) = (self.nodes.at(from), self.nodes.at(to));
        let touched = self.obstacles.touched(here, there, self.nodes.exempt(from, to));
        let mut met = touched.areas();
        met.retain(|it| self.obstacles.may_bar(*it));
        let before = self.nodes.extent();
        self.nodes.meet(met.iter().copied());
        self.nodes.cross(&met, here, there);
        let is_high_enough = self.nodes.clear(here, there);
        self.look_at_nodes_since(before);
        is_high_enough.then(|| self.fly(index, to, &touched)).flatten()
    }

    /// Whether a settled label of `node` is as good as one at this cost: no way on from there is cheaper, since what only it has
    /// asked for can still be asked for on the way.
    fn is_settled(&self, node: usize, asked: &Asked, cost_ms: u64) -> bool {
        let wait_ms = |zone: &usize| match self.obstacles.among.entries[*zone] {
            Entry::Ask { wait_s } => (wait_s * 1e3).ceil() as u64,
            Entry::Forced | Entry::Closed => PROHIBITIVE_MS,
        };
        self.settled[node].iter().map(|index| &self.labels[*index]).any(|other| {
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
        TimedWay {
            points: along.iter().map(|it| self.nodes.at(it.node)).collect(),
            at: along.iter().map(|it| it.at).collect(),
            legs_out: 0,
            entered: along.iter().flat_map(|it| it.entered.clone()).collect(),
        }
    }

    /// There are more nodes.
    fn note_nodes(&mut self) {
        let Obstacles { among, trip, .. } = self.obstacles;
        for node in self.least_ms.len()..self.nodes.len() {
            let (here, goal) = (self.nodes.at(node), self.nodes.at(GOAL));
            // A landing costs nothing, or little.
            let goal = if trip.lands_from_m.is_some() { goal.at_height(here.height_m()) } else { goal };
            let rest_s = among.limits.speeds.time_s(here, goal);
            self.least_ms.push((self.effort.factor * rest_s * 1e3).floor() as u64);
        }
        self.settled.resize(self.nodes.len(), Vec::new());
    }

    /// A leg more costs something, so that no point is flown to without need, and so does one to another height than the one that was
    /// chosen to be flown at. A landing from that height, and the climb to it before the way to one, cost nothing: all ways have them.
    fn flight_ms(&self, from: usize, to: usize) -> u64 {
        let Obstacles { among, trip, level_m, .. } = self.obstacles;
        let is_elsewhere = self.nodes.at(to).height_m() != *level_m;
        let time_s = among.limits.speeds.time_s(self.nodes.at(from), self.nodes.at(to));
        let cost_s = match (from, to) {
            (_, GOAL) if trip.lands_from_m.is_some() => {
                let higher_m = self.nodes.at(from).height_m() - level_m;
                return (higher_m.max(0.0) / among.limits.speeds.descent_m_s * 1e3).ceil() as u64 + 1;
            }
            (START, _) if trip.lands_from_m.is_none() || self.obstacles.begins_level() => time_s,
            (START, _) if is_elsewhere => WORTH_ANOTHER_HEIGHT_S + time_s,
            (START, _) => 0.0,
            _ => time_s,
        };
        (cost_s * 1e3).ceil() as u64 + 1 + u64::from(is_elsewhere)
    }

    /// The label at `to` after the leg from the label `index`, which touches that; `None` if it must not be flown then.
    fn fly(&self, index: usize, to: usize, touched: &Touched) -> Option<Label> {
        let Touched::Areas { stays, near } = touched else { return None };
        let (from, obstacles) = (&self.labels[index], self.obstacles);
        let time = obstacles.time(self.nodes.at(from.node), self.nodes.at(to));
        let super::Among { rule, entries, asked: planned, .. } = obstacles.among;
        let at = |fraction: f64| from.at.saturating_add(time.mul_f64(fraction));
        let is_asked = |zone: usize| planned.contains(&zone) || from.asked.contains(&zone);
        let bars = |zone: usize, enters: f64, leaves: f64| {
            let area = obstacles.area(zone);
            let is_free = may_open(area) && is_asked(zone);
            !is_free && rule.bars(area, soonest(at(enters)), latest(at(leaves))).is_some()
        };
        if near.iter().any(|zone| bars(*zone, 0.0, 1.0) && entries[*zone] != Entry::Forced) {
            return None;
        }
        let (mut wait_ms, mut wait_s, mut entered) = (0, 0.0_f64, Vec::new());
        for (zone, stays) in stays {
            if !stays.iter().any(|stay| bars(*zone, stay.enters, stay.leaves)) || from.asked.contains(zone) {
                continue;
            }
            match entries[*zone] {
                Entry::Ask { wait_s: expected_s } => {
                    wait_ms += (expected_s * 1e3).ceil() as u64;
                    wait_s += expected_s;
                }
                Entry::Forced => wait_ms += PROHIBITIVE_MS,
                Entry::Closed => return None,
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
