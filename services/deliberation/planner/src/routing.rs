//! The cheapest way through the air: a visibility graph over the barred areas, grown by a margin,
//! searched for the least flight time plus expected wait for permissions.
//!
//! Costs are whole milliseconds and ties fall by the order of the areas, so the same request gives
//! the same way. Areas are flown round, not over or under.

use std::cell::OnceCell;

use domain::geometry::Ned;
use domain::route;
use geo::{Distance, Euclidean, Line, Point, Polygon};
use pathfinding::directed::astar::astar;

use crate::airspace::{Access, Airspace, Asked};
use crate::config::Config;
use crate::way_out::way_out;
use domain::corners::corners;

/// A way in straight legs.
#[derive(Debug, Clone, PartialEq)]
pub struct Way {
    /// From the start to the goal, both included.
    pub points: Vec<Ned>,
    /// The first leg leads out of an area the vehicle is in without permission.
    pub leads_out: bool,
}

/// Why there is no way, for the mission report.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct NoWay(pub String);

/// Where two areas are closer to each other than twice the margin, these fractions of it are tried.
const MARGINS: [f64; 4] = [1.0, 0.5, 0.25, 0.125];

/// The part of the margin that legs must keep; the corners lie a little farther out, so that rounding
/// does not bar the leg along a side.
const KEPT: f64 = 0.9;

/// The cheapest way from `from` to `to` for a plan that has asked for `asked` before.
pub fn find(from: Ned, to: Ned, airspace: &Airspace, asked: &Asked, config: &Config) -> Result<Way, NoWay> {
    search(from, to, airspace, asked, config).ok_or_else(|| {
        let blocker = [false, true].into_iter().find_map(|keep_out_too| {
            let way = search(from, to, &airspace.opened(keep_out_too), asked, config)?;
            let entered = way.points.windows(2).flat_map(|leg| airspace.first_entries(leg[0], leg[1], asked));
            entered.map(|(_, index)| &airspace.zones[index].access).find_map(|it| match it {
                Access::Closed { reason } => Some(reason.clone()),
                Access::Held | Access::Ask { .. } => None,
            })
        });
        NoWay(blocker.unwrap_or_else(|| "no way keeps clear of every area".into()))
    })
}

fn search(from: Ned, to: Ned, airspace: &Airspace, asked: &Asked, config: &Config) -> Option<Way> {
    if airspace.trespassed(from, asked).is_empty() {
        return Some(Way { points: search_from_outside(from, to, airspace, asked, config)?, leads_out: false });
    }
    let out = way_out(from, airspace, asked, config)?;
    let mut points = search_from_outside(out, to, airspace, asked, config)?;
    points.insert(0, from);
    Some(Way { points, leads_out: true })
}

fn search_from_outside(from: Ned, to: Ned, airspace: &Airspace, asked: &Asked, config: &Config) -> Option<Vec<Ned>> {
    MARGINS.into_iter().find_map(|it| Graph::new(from, to, airspace, asked, config, it * config.margin_m()).search())
}

/// The visibility graph: the two ends and the corners of the grown areas, with edges found when
/// they are needed.
struct Graph<'a> {
    airspace: &'a Airspace<'a>,
    config: &'a Config,
    /// The barred zones at the heights that are flown.
    barred: Vec<(usize, Polygon)>,
    /// Legs keep this distance from what they do not enter.
    kept_m: f64,
    /// [`START`], [`GOAL`], then the corners.
    nodes: Vec<Ned>,
    edges: Vec<OnceCell<Vec<Edge>>>,
}

/// The index of the start among the nodes.
const START: usize = 0;
/// The index of the goal.
const GOAL: usize = 1;

struct Edge {
    to: usize,
    flight_ms: u64,
    /// Zones to be asked for on it.
    enters: Vec<usize>,
    /// Zones it passes nearer than the margin; allowed once they have been asked for.
    grazes: Vec<usize>,
}

enum Passage {
    Clear,
    Enters,
    Grazes,
}

impl<'a> Graph<'a> {
    fn new(from: Ned, to: Ned, airspace: &'a Airspace, asked: &Asked, config: &'a Config, margin_m: f64) -> Graph<'a> {
        let mut nodes = vec![from, to];
        let mut barred = Vec::new();
        for (index, zone) in airspace.barred(asked) {
            if !zone.area.touches_heights(from.height_m(), to.height_m()) {
                continue;
            }
            nodes.extend(corners(&zone.area.corners, margin_m).into_iter().map(|it| it.at_height(to.height_m())));
            barred.push((index, zone.area.polygon()));
        }
        let edges = nodes.iter().map(|_| OnceCell::new()).collect();
        Graph { airspace, config, barred, kept_m: margin_m * KEPT, nodes, edges }
    }

    fn search(&self) -> Option<Vec<Ned>> {
        let start = (START, Asked::new());
        let to_goal_ms = |node: &usize| {
            let distance_m = self.nodes[*node].distance_m(self.nodes[GOAL]);
            (self.config.flight_time_s(distance_m) * 1e3).floor() as u64
        };
        let (path, _) = astar(
            &start,
            |(node, asked)| self.successors(*node, asked),
            |(node, _)| to_goal_ms(node),
            |(node, _)| *node == GOAL,
        )?;
        Some(path.into_iter().map(|(node, _)| self.nodes[node]).collect())
    }

    fn successors(&self, node: usize, asked: &Asked) -> Vec<((usize, Asked), u64)> {
        let edges = self.edges[node].get_or_init(|| self.edges_from(node));
        let usable = edges.iter().filter(|it| it.grazes.iter().all(|zone| asked.contains(zone)));
        usable
            .map(|it| {
                let mut asked = asked.clone();
                let newly = it.enters.iter().filter(|zone| asked.insert(**zone));
                let wait_ms: u64 = newly.map(|zone| self.wait_ms(*zone)).sum();
                ((it.to, asked), it.flight_ms + wait_ms)
            })
            .collect()
    }

    fn edges_from(&self, node: usize) -> Vec<Edge> {
        (GOAL..self.nodes.len()).filter(|to| *to != node).filter_map(|to| self.edge(node, to)).collect()
    }

    /// `None` where a closed zone is in the way.
    fn edge(&self, from: usize, to: usize) -> Option<Edge> {
        let distance_m = self.nodes[from].distance_m(self.nodes[to]);
        // A leg more costs something, so that no point is flown to without need.
        let flight_ms = (self.config.flight_time_s(distance_m) * 1e3).ceil() as u64 + 1;
        let mut edge = Edge { to, flight_ms, enters: Vec::new(), grazes: Vec::new() };
        for (index, polygon) in &self.barred {
            let is_closed = matches!(self.airspace.zones[*index].access, Access::Closed { .. });
            match self.passage(*index, polygon, from, to) {
                Passage::Clear => {}
                Passage::Enters | Passage::Grazes if is_closed => return None,
                Passage::Enters => edge.enters.push(*index),
                Passage::Grazes => edge.grazes.push(*index),
            }
        }
        Some(edge)
    }

    fn passage(&self, zone: usize, polygon: &Polygon, from: usize, to: usize) -> Passage {
        let (here, there) = (self.nodes[from], self.nodes[to]);
        let area = self.airspace.zones[zone].area;
        if !route::entries(area, here, there).is_empty() {
            return Passage::Enters;
        }
        let over_ground = |it: Ned| Point::new(it.east_m, it.north_m);
        let is_near = |it: Ned| Euclidean.distance(&over_ground(it), polygon) < self.kept_m;
        // Where it starts and where it is to go is not the way's choice, be it near a border.
        let ends_near = (from == START && is_near(here)) || (to == GOAL && is_near(there));
        let leg = Line::new(over_ground(here), over_ground(there));
        let grazes = !ends_near
            && area.touches_heights(here.height_m(), there.height_m())
            && Euclidean.distance(&leg, polygon) < self.kept_m;
        if grazes { Passage::Grazes } else { Passage::Clear }
    }

    fn wait_ms(&self, zone: usize) -> u64 {
        match self.airspace.zones[zone].access {
            Access::Ask { wait_s, .. } => (wait_s * 1e3).ceil() as u64,
            Access::Held | Access::Closed { .. } => 0,
        }
    }
}
