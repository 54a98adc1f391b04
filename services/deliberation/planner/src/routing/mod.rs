//! The cheapest way through the air: a visibility graph over the areas that apply, grown by a margin,
//! searched for the least flight time plus expected wait for permissions.
//!
//! Each leg is judged at the time when it is flown. Costs are whole milliseconds and ties fall by the
//! order of the areas, so the same request gives the same way. Areas are flown round, over or under, whatever takes the least time.
//!
//! Only the areas that turn out to be in the way have a part in a search: it begins without any corners, and each area that a
//! promising leg touches joins. Where too much is in the way the search is content with a way that costs up to a tenth more than the
//! cheapest; where that leaves none, and among few areas at once, the corners of all are tried, and ways that could be cut short.
//! `domain::way` searches the ways of responses with the same efforts.

use std::cell::Cell;
use std::time::Duration;

use domain::geometry::Ned;
use domain::way::{Effort, Leaving, leaving};

use crate::airspace::{Access, Airspace, Asked};
use crate::area_map::MARGINS;
use crate::config::Config;

mod graph;
mod kept_legs;
mod legs;
mod nodes;
#[cfg(test)]
mod tests;

use graph::Graph;
pub(crate) use kept_legs::KeptLegs;
use legs::Obstacles;

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
    /// A search has given up before it had looked at everything.
    gave_up: &'a Cell<bool>,
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
    let gave_up = Cell::new(false);
    let search = |open| search(from, to, begins, Among { airspace, asked, open, config, gave_up: &gave_up });
    search(Open::Nothing).map(|(way, _)| way).ok_or_else(|| {
        let closed = |open| {
            let (_, entered) = search(open)?;
            entered.into_iter().find_map(|zone| match &airspace.zones[zone].access {
                Access::Closed { reason } => Some(reason.clone()),
                Access::Ask { .. } => None,
            })
        };
        let blocker = [Open::Permissions, Open::Everything].into_iter().find_map(closed);
        NoWay(blocker.unwrap_or_else(|| match gave_up.get() {
            false => "no way keeps clear of every area".into(),
            true => "no way was found: too many areas are in the way, or they have too many corners".into(),
        }))
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
        now = now.saturating_add(config.speeds().time(leg.0, leg.1));
        points.push(leg.1);
        at.push(now);
    }
    let start = points.pop()?;
    at.pop();
    let (way, entered) = (0..MARGINS.len()).find_map(|part| {
        let obstacles = Obstacles::new(start, to, part, among);
        cheapest(&obstacles, now)
    })?;
    points.extend(way.iter().map(|(point, _)| *point));
    at.extend(way.iter().map(|(_, at)| *at));
    Some((Way { points, at, legs_out: out.len() }, entered))
}

/// The points with the times at which they are reached, and the zones entered.
type TimedWay = (Vec<(Ned, Duration)>, Vec<usize>);

/// The cheapest way, or one that is little dearer where there is too much in the way to find it in time.
fn cheapest(obstacles: &Obstacles, begins: Duration) -> Option<TimedWay> {
    let efforts = Effort::among(obstacles.all().map(|zone| obstacles.area(zone)));
    efforts.into_iter().find_map(|effort| Graph::new(obstacles, begins, effort).search())
}
