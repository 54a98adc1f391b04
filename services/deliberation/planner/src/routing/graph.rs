//! A* over the corners of the areas that were met, with legs looked at only when they are the most promising ones (lazy
//! evaluation of the edges: Dellin and Srinivasa, A Unifying Formalism for Shortest Path Problems with Expensive Edge
//! Evaluations, ICAPS 2016), and among them only those that may be part of a cheapest way (the tangents of the areas).

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};
use std::time::Duration;

use domain::airspace::{latest, soonest};
use domain::area::AreaKind;
use domain::way::{Effort, Turns};

use super::legs::{Leg, Obstacles};
use super::nodes::{GOAL, Nodes, START};
use super::{Open, PROHIBITIVE_MS, TimedWay};
use crate::airspace::{Access, Asked};

/// The visibility graph: the two ends, and the points at which ways past the areas that were met so far may turn, climb or descend.
pub(super) struct Graph<'a> {
    obstacles: &'a Obstacles<'a>,
    begins: Duration,
    effort: Effort,
    nodes: Nodes<'a>,
    /// By node, labels that no other one there is as good as.
    settled: Vec<Vec<usize>>,
    legs: BTreeMap<(usize, usize), Leg>,
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
    /// A node that is reached, by the index of its label.
    Reached(usize),
    /// A leg that may be barred, or dearer than its flight: from this label to this node.
    Perhaps(usize, usize),
}

impl<'a> Graph<'a> {
    pub(super) fn new(obstacles: &'a Obstacles<'a>, begins: Duration, effort: Effort) -> Graph<'a> {
        Graph {
            obstacles,
            begins,
            effort,
            nodes: Nodes::new(obstacles),
            settled: Vec::new(),
            legs: BTreeMap::new(),
            labels: Vec::new(),
            open: BinaryHeap::new(),
            expanded: Vec::new(),
        }
    }

    /// The way of the least cost, or up to the stated factor more, if enough legs may be looked at.
    pub(super) fn search(mut self) -> Option<TimedWay> {
        if self.effort.turns == Turns::Any {
            self.nodes.meet(&self.obstacles.all());
        }
        self.settled.resize(self.nodes.len(), Vec::new());
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
                    self.settled[node].push(index);
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
        if *node == to || !self.nodes.may_join(*node, to, self.effort.turns) {
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
        let leg = self.obstacles.leg(self.nodes.at(from), self.nodes.at(to), self.nodes.exempt(from, to));
        let touched: BTreeSet<usize> = leg.stays.iter().map(|it| it.0).chain(leg.near.iter().copied()).collect();
        self.legs.insert((from, to), leg);
        let old = self.nodes.len();
        self.nodes.meet(&touched);
        self.nodes.cross(&touched, self.nodes.at(from), self.nodes.at(to));
        self.settled.resize(self.nodes.len(), Vec::new());
        for to in old..self.nodes.len() {
            for at in 0..self.expanded.len() {
                self.perhaps(self.expanded[at], to);
            }
        }
    }

    /// Whether a settled label of `node` is as good as one at this cost: no way on from there is cheaper, since what only it has
    /// asked for can still be asked for on the way.
    fn is_settled(&self, node: usize, asked: &Asked, cost_ms: u64) -> bool {
        let wait_ms = |zone: &usize| match self.obstacles.among.airspace.zones[*zone].access {
            Access::Ask { wait_s, .. } => (wait_s * 1e3).ceil() as u64,
            Access::Closed { .. } => PROHIBITIVE_MS,
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
        let points = along.iter().map(|label| (self.nodes.at(label.node), label.at)).collect();
        (points, along.iter().flat_map(|label| label.entered.clone()).collect())
    }

    /// What the rest of the way costs at least, times the factor that it may cost too much.
    fn least_ms(&self, node: usize) -> u64 {
        let rest_s = self.obstacles.among.config.speeds().time_s(self.nodes.at(node), self.nodes.at(GOAL));
        (self.effort.factor * rest_s * 1e3).floor() as u64
    }

    /// A leg more costs something, so that no point is flown to without need, and so does one to another height than the
    /// goal's, which is the one that was chosen to be flown at.
    fn flight_ms(&self, from: usize, to: usize) -> u64 {
        let time_s = self.obstacles.among.config.speeds().time_s(self.nodes.at(from), self.nodes.at(to));
        let is_elsewhere = self.nodes.at(to).down_m != self.nodes.at(GOAL).down_m;
        (time_s * 1e3).ceil() as u64 + 1 + u64::from(is_elsewhere)
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
