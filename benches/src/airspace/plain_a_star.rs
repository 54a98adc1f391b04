//! What the planner is measured against: A* over the full visibility graph, as the textbooks have it. Every leg from a settled node to
//! any other one is looked at, against every area; nothing is kept. It flies level, and does not know the time.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use domain::airspace::stays;
use domain::area::{Area, AreaKind};
use domain::corners::corners;
use domain::geometry::Ned;
use domain::way::{Exempt, KEPT, keeps_clear};

use crate::world::World;

/// Metres to the borders, as shipped.
const MARGIN_M: f64 = 10.0;
/// Metres above the ground, as shipped.
const HEIGHT_M: f64 = 10.0;
/// What a permission costs, in metres: the wait that is to be expected, at the speed of plans, as shipped.
const WAIT_M: f64 = 20.0;

/// The number of legs of the cheapest way.
pub(crate) fn legs(world: World, areas: &[Area]) -> usize {
    let ends = [world.start().at_height(HEIGHT_M), world.goal().at_height(HEIGHT_M)];
    let turns = areas.iter().flat_map(|it| corners(it, MARGIN_M)).map(|it| it.at.at_height(HEIGHT_M));
    let nodes: Vec<Ned> = ends.into_iter().chain(turns).collect();
    let mut settled = vec![None; nodes.len()];
    let mut open = BinaryHeap::from([Reverse((0, 0, 0, 0))]);
    let millimetres = |metres: f64| (metres * 1e3) as u64;
    while let Some(Reverse((_, cost, node, before))) = open.pop() {
        if settled[node].is_some() {
            continue;
        }
        settled[node] = Some(before);
        if node == 1 {
            let way = std::iter::successors(Some(1), |it| settled[*it].filter(|before| before != it));
            return way.count() - 1;
        }
        for next in (0..nodes.len()).filter(|it| settled[*it].is_none()) {
            let Some(leg_m) = cost_m(nodes[node], nodes[next], areas) else { continue };
            let cost = cost + millimetres(leg_m);
            open.push(Reverse((cost + millimetres(nodes[next].distance_m(nodes[1])), cost, next, node)));
        }
    }
    panic!("there is a way")
}

/// What the leg costs; `None` if it must not be flown.
fn cost_m(here: Ned, there: Ned, areas: &[Area]) -> Option<f64> {
    let exempt = Exempt { start: false, end: false };
    let mut cost_m = here.distance_m(there);
    for area in areas {
        let enters = !stays(area, here, there, 2.0).is_empty();
        if enters && area.kind == AreaKind::Permission {
            cost_m += WAIT_M;
        } else if enters || !keeps_clear(area, here, there, KEPT * MARGIN_M, exempt) {
            return None;
        }
    }
    Some(cost_m)
}
