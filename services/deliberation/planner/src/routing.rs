//! The cheapest way through the air: a visibility graph over the areas that apply, grown by a margin,
//! searched for the least flight time plus expected wait for permissions.
//!
//! Each leg is judged at the time when it is flown. Costs are whole milliseconds and ties fall by the
//! order of the areas, so the same request gives the same way. Areas are flown round; the way out of one
//! may lead over or under it.

use std::cell::OnceCell;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::time::Duration;

use domain::airspace::{Stay, latest, part_at_heights, soonest, stays};
use domain::area::{Area, AreaKind};
use domain::corners::corners;
use domain::geometry::Ned;
use domain::way::{Exempt, Leaving, footholds, keeps_clear, leaving};
use geo::{BoundingRect, Coord, Intersects, Line, Rect};

use crate::airspace::{Access, Airspace, Asked};
use crate::config::Config;

/// A way in straight legs.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Way {
    /// From the start to the goal, both included.
    pub points: Vec<Ned>,
    /// When each point is reached, waits that are to be expected included.
    pub at: Vec<Duration>,
    /// The number of legs that lead out of an area in which the vehicle must not be.
    pub legs_out: usize,
}

/// Why there is no way, for the mission report.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub(crate) struct NoWay(pub String);

/// Where there is no way that keeps the margin, half of it is tried: two areas may be that close to each other.
const MARGINS: [f64; 2] = [1.0, 0.5];

/// The part of the margin that legs must keep; the corners lie a little farther out, so that rounding
/// does not bar the leg along a side.
const KEPT: f64 = 0.9;

/// From a start and a goal whose heights differ by more than this, ways at both heights are tried, in metres.
const SAME_HEIGHT_M: f64 = 1.0;

/// A search gives up after this number of ways: the mission manager awaits an answer within a second.
const MOST_LABELS: usize = 200_000;

/// What may be opened to find out what is in the way, at a price that nobody would pay for a detour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Open {
    Nothing,
    Permissions,
    Everything,
}

/// Among which areas a way is searched, and by a plan that has asked for what before.
#[derive(Debug, Clone, Copy)]
struct Among<'a> {
    airspace: &'a Airspace<'a>,
    asked: &'a Asked,
    open: Open,
    config: &'a Config,
}

/// Milliseconds.
const PROHIBITIVE_MS: u64 = 10_000_000_000;

/// The cheapest way from `from`, where the vehicle is in the air after `begins`, to `to`, for a plan that has asked for
/// `asked` before.
pub(crate) fn find(
    from: Ned,
    to: Ned,
    begins: Duration,
    airspace: &Airspace,
    asked: &Asked,
    config: &Config,
) -> Result<Way, NoWay> {
    let search = |open| search(from, to, begins, Among { airspace, asked, open, config });
    search(Open::Nothing).map(|(way, _)| way).ok_or_else(|| {
        let closed = |open| {
            let (_, entered) = search(open)?;
            entered.into_iter().find_map(|zone| match &airspace.zones[zone].access {
                Access::Closed { reason } => Some(reason.clone()),
                Access::Ask { .. } => None,
            })
        };
        let blocker = [Open::Permissions, Open::Everything].into_iter().find_map(closed);
        NoWay(blocker.unwrap_or_else(|| "no way keeps clear of every area".into()))
    })
}

/// The way, and the zones that are entered on it after asking.
fn search(from: Ned, to: Ned, begins: Duration, among: Among) -> Option<(Way, Vec<usize>)> {
    let Among { airspace, config, .. } = among;
    let must_leave = begins.is_zero() && airspace.is_trespassed(from);
    let out = match must_leave.then(|| leaving(from, &airspace.rule, &config.flight_limits())) {
        None => Vec::new(),
        Some(Leaving::Flies(out)) => out,
        Some(Leaving::Stays { .. } | Leaving::NoWay) => return None,
    };
    let (mut points, mut at) = (vec![from], vec![begins]);
    let mut now = begins;
    for leg in out.iter().scan(from, |here, there| Some((std::mem::replace(here, *there), *there))) {
        now = now.saturating_add(config.flight_time(leg.0.distance_m(leg.1)));
        points.push(leg.1);
        at.push(now);
    }
    let start = points.pop()?;
    at.pop();
    // From over or under an area both heights are as good; else the goal's is preferred.
    let heights = if out.is_empty() { [false, true] } else { [true, false] };
    let (way, entered) = heights.into_iter().find_map(|both_heights| {
        MARGINS.into_iter().find_map(|margin| {
            let margin_m = margin * config.margin_m();
            Graph::new(start, to, now, both_heights, margin_m, among).search()
        })
    })?;
    points.extend(way.iter().map(|(point, _)| *point));
    at.extend(way.iter().map(|(_, at)| *at));
    Some((Way { points, at, legs_out: out.len() }, entered))
}

/// The points with the times at which they are reached, and the zones entered.
type TimedWay = (Vec<(Ned, Duration)>, Vec<usize>);

/// The visibility graph: the two ends and the corners of the grown areas, with legs found when they are needed.
struct Graph<'a> {
    among: Among<'a>,
    begins: Duration,
    margin_m: f64,
    /// Zones that may be in the way, each with the rectangle outside of which a leg keeps the margin from it.
    zones: Vec<(usize, Rect<f64>)>,
    /// [`START`], [`GOAL`], then the corners.
    nodes: Vec<Ned>,
    legs: Vec<OnceCell<Vec<Leg>>>,
}

/// The index of the start among the nodes.
const START: usize = 0;
/// The index of the goal.
const GOAL: usize = 1;

/// What a leg has to do with the areas, whatever the time.
struct Leg {
    to: usize,
    time: Duration,
    /// Zones whose inside it touches.
    stays: Vec<(usize, Vec<Stay>)>,
    /// Zones that it passes nearer than the margin.
    near: Vec<usize>,
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

impl<'a> Graph<'a> {
    fn new(from: Ned, to: Ned, begins: Duration, both_heights: bool, margin_m: f64, among: Among<'a>) -> Graph<'a> {
        let Among { airspace, asked, .. } = among;
        let differ = SAME_HEIGHT_M < (from.height_m() - to.height_m()).abs();
        let mut heights = vec![to.height_m()];
        let mut nodes = vec![from, to];
        if both_heights && differ {
            heights.push(from.height_m());
            nodes.extend([from.at_height(to.height_m()), to.at_height(from.height_m())]);
        }
        let is_asked = |zone: &usize| airspace.zones[*zone].area.kind == AreaKind::Permission && asked.contains(zone);
        let touches = |zone: &usize| touches_heights(airspace, *zone, from, to);
        let zones: Vec<usize> = (0..airspace.zones.len()).filter(|zone| !is_asked(zone) && touches(zone)).collect();
        let areas: Vec<&Area> = zones.iter().map(|zone| airspace.zones[*zone].area).collect();
        let turns: Vec<Ned> = areas.iter().flat_map(|area| corners(&area.corners, margin_m)).collect();
        for height_m in heights {
            nodes.extend(turns.iter().map(|turn| turn.at_height(height_m)));
        }
        nodes.extend(footholds(from, &areas, margin_m));
        nodes.extend(footholds(to, &areas, margin_m));
        let legs = nodes.iter().map(|_| OnceCell::new()).collect();
        let bounded = |zone: usize| Some((zone, bounds(airspace.zones[zone].area, margin_m)?));
        let zones = zones.into_iter().filter_map(bounded).collect();
        Graph { among, begins, margin_m, zones, nodes, legs }
    }

    /// A* by the least cost.
    fn search(&self) -> Option<TimedWay> {
        let start =
            Label { node: START, asked: Asked::new(), cost_ms: 0, at: self.begins, before: None, entered: Vec::new() };
        let mut labels = vec![start];
        let mut settled: Vec<Vec<usize>> = self.nodes.iter().map(|_| Vec::new()).collect();
        let mut open = BinaryHeap::from([Reverse((self.least_ms(START), 0))]);
        while let Some(Reverse((_, index))) = open.pop() {
            if MOST_LABELS < labels.len() {
                return None;
            }
            let here = &mut settled[labels[index].node];
            if here.iter().any(|other| self.is_as_good(&labels[*other], &labels[index])) {
                continue;
            }
            here.push(index);
            if labels[index].node == GOAL {
                return Some(self.way_to(&labels, index));
            }
            let legs = self.legs[labels[index].node].get_or_init(|| self.legs_from(labels[index].node));
            for leg in legs {
                if let Some(label) = self.fly(leg, &labels[index], index) {
                    open.push(Reverse((label.cost_ms + self.least_ms(label.node), labels.len())));
                    labels.push(label);
                }
            }
        }
        None
    }

    /// Whether no way on from `label` is cheaper than the same way on from `settled`, which is at the same node and was no
    /// dearer: what only `label` has asked for can still be asked for on the way.
    fn is_as_good(&self, settled: &Label, label: &Label) -> bool {
        let wait_ms = |zone: &usize| match self.among.airspace.zones[*zone].access {
            Access::Ask { wait_s, .. } => (wait_s * 1e3).ceil() as u64,
            Access::Closed { .. } => PROHIBITIVE_MS,
        };
        let missing_ms: u64 = label.asked.difference(&settled.asked).map(wait_ms).sum();
        settled.cost_ms + missing_ms <= label.cost_ms
    }

    fn way_to(&self, labels: &[Label], goal: usize) -> TimedWay {
        let back = std::iter::successors(Some(goal), |index| labels[*index].before);
        let mut along: Vec<&Label> = back.map(|index| &labels[index]).collect();
        along.reverse();
        let points = along.iter().map(|label| (self.nodes[label.node], label.at)).collect();
        (points, along.iter().flat_map(|label| label.entered.clone()).collect())
    }

    fn least_ms(&self, node: usize) -> u64 {
        (self.among.config.flight_time_s(self.nodes[node].distance_m(self.nodes[GOAL])) * 1e3).floor() as u64
    }

    fn legs_from(&self, node: usize) -> Vec<Leg> {
        (GOAL..self.nodes.len()).filter(|to| *to != node).map(|to| self.leg(node, to)).collect()
    }

    fn leg(&self, from: usize, to: usize) -> Leg {
        let (here, there) = (self.nodes[from], self.nodes[to]);
        let time = self.among.config.flight_time(here.distance_m(there));
        // Where it starts and where it is to go is not the way's choice, be it near a border.
        let exempt = Exempt { start: from == START, end: to == GOAL };
        let mut leg = Leg { to, time, stays: Vec::new(), near: Vec::new() };
        let line = Line::new((here.east_m, here.north_m), (there.east_m, there.north_m));
        for (zone, bounds) in &self.zones {
            if !bounds.intersects(&line) {
                continue;
            }
            let (zone, area) = (*zone, self.among.airspace.zones[*zone].area);
            let inside = stays(area, here, there, self.among.airspace.rule.vertical_margin_m);
            if !inside.is_empty() {
                leg.stays.push((zone, inside));
            } else if let Some((low, high)) =
                part_at_heights(area, here, there, self.among.airspace.rule.vertical_margin_m)
            {
                let exempt = Exempt { start: exempt.start && low == here, end: exempt.end && high == there };
                if !keeps_clear(area, low, high, KEPT * self.margin_m, exempt) {
                    leg.near.push(zone);
                }
            }
        }
        leg
    }

    /// The label at the end of `leg`; `None` if it must not be flown then.
    fn fly(&self, leg: &Leg, from: &Label, index: usize) -> Option<Label> {
        let at = |fraction: f64| from.at.saturating_add(leg.time.mul_f64(fraction));
        let is_asked = |zone: usize| self.among.asked.contains(&zone) || from.asked.contains(&zone);
        let bars = |zone: usize, enters: f64, leaves: f64| {
            let area = self.among.airspace.zones[zone].area;
            let is_free = area.kind == AreaKind::Permission && is_asked(zone);
            !is_free && self.among.airspace.rule.bars(area, soonest(at(enters)), latest(at(leaves))).is_some()
        };
        if leg.near.iter().any(|zone| bars(*zone, 0.0, 1.0) && !self.opens(*zone)) {
            return None;
        }
        let (mut wait_ms, mut wait_s, mut entered) = (0, 0.0_f64, Vec::new());
        for (zone, stays) in &leg.stays {
            if !stays.iter().any(|stay| bars(*zone, stay.enters, stay.leaves)) || from.asked.contains(zone) {
                continue;
            }
            match self.among.airspace.zones[*zone].access {
                Access::Ask { wait_s: expected_s, .. } => {
                    wait_ms += (expected_s * 1e3).ceil() as u64;
                    wait_s += expected_s;
                }
                Access::Closed { .. } if self.opens(*zone) => wait_ms += PROHIBITIVE_MS,
                Access::Closed { .. } => return None,
            }
            entered.push(*zone);
        }
        let mut asked = from.asked.clone();
        asked.extend(&entered);
        // A leg more costs something, so that no point is flown to without need.
        let flight_ms = (leg.time.as_secs_f64() * 1e3).ceil() as u64 + 1;
        let wait = Duration::try_from_secs_f64(wait_s).unwrap_or(Duration::MAX);
        Some(Label {
            node: leg.to,
            asked,
            cost_ms: from.cost_ms + flight_ms + wait_ms,
            at: at(1.0).saturating_add(wait),
            before: Some(index),
            entered,
        })
    }

    /// Whether a closed zone counts as one that can be entered.
    fn opens(&self, zone: usize) -> bool {
        match self.among.open {
            Open::Nothing => false,
            Open::Permissions => self.among.airspace.zones[zone].area.kind == AreaKind::Permission,
            Open::Everything => true,
        }
    }
}

/// The rectangle around `area` and the margin.
fn bounds(area: &Area, margin_m: f64) -> Option<Rect<f64>> {
    let around = area.polygon().bounding_rect()?;
    let margin = Coord { x: margin_m, y: margin_m };
    Some(Rect::new(around.min() - margin, around.max() + margin))
}

fn touches_heights(airspace: &Airspace, zone: usize, a: Ned, b: Ned) -> bool {
    let margin_m = airspace.rule.vertical_margin_m;
    let (low_m, high_m) = (a.height_m().min(b.height_m()), a.height_m().max(b.height_m()));
    airspace.zones[zone].area.touches_heights(low_m - margin_m, high_m + margin_m)
}
