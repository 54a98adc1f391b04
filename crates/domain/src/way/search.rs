//! The cheapest way through the air: a visibility graph over the areas that apply, grown by a margin, searched for the least flight
//! time plus expected wait for permissions. The one search: of plans, responses, alternates and forecasts.
//!
//! Each leg is judged at the time when it is flown. Costs are whole milliseconds and ties fall by the order of the areas, so the same
//! question gives the same way. Areas are flown round, over or under, whatever takes the least time.
//!
//! Only the areas that turn out to be in the way have a part in a search: it begins without any corners, and each area that a
//! promising leg touches joins. Where too much is in the way the search is content with a way that costs up to a tenth more than the
//! cheapest; where that leaves none, and among few areas at once, the corners of all are tried, and ways that could be cut short.

use std::cell::Cell;
use std::collections::BTreeSet;
use std::time::Duration;

use crate::airspace::{Airspace, soonest};
use crate::area::{Area, AreaKind};
use crate::area_map::{AreaMap, MARGINS};
use crate::geometry::Ned;
use crate::way::{FlightLimits, Leaving, leaving};

mod graph;
mod kept_legs;
mod legs;
mod nodes;
#[cfg(test)]
mod tests;

use graph::Graph;
pub(crate) use kept_legs::KeptLegs;
use legs::Obstacles;

/// The part of the margin that legs must keep: the corners lie a little farther out, so that rounding does not bar the leg
/// along a side.
pub const KEPT: f64 = 0.9;

/// From where to where, and when.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trip {
    /// In the air.
    pub from: Ned,
    /// Where it ends.
    pub to: Ned,
    /// When it begins, from now on.
    pub begins: Duration,
    /// `Some`: it ends with a landing at `to`, after a flight that is preferably at this height, in metres above the origin. The vehicle
    /// climbs or descends to it first. `None`: it ends in the air.
    pub lands_from_m: Option<f64>,
}

/// What it takes to enter an area that is barred.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Entry {
    /// Asking for its permission.
    Ask {
        /// The wait that is to be expected, in seconds.
        wait_s: f64,
    },
    /// No way leads through it.
    Closed,
    /// A way leads through it at a price that nobody would pay for a detour: to find out what is in the way.
    Forced,
}

/// Whether there are ways for which `area` is open although it applies: with its permission, or, where it only bars landings, for who comes down
/// there all the same.
fn may_open(area: &Area) -> bool {
    area.kind == AreaKind::Permission || area.only_bars_landings()
}

/// Areas that are open by `may_open`, by their index: their permission was asked for before.
pub type Asked = BTreeSet<usize>;

/// What a search knows and keeps to.
#[derive(Debug, Clone, Copy)]
pub struct Among<'a> {
    /// The areas, and the rule.
    pub rule: Airspace<'a>,
    /// Of the same areas.
    pub map: &'a AreaMap,
    /// By the index of the area.
    pub entries: &'a [Entry],
    /// Areas that count as open.
    pub asked: &'a Asked,
    /// Speeds, heights and distances.
    pub limits: &'a FlightLimits,
    /// Legs that may still be looked at; without any left there is no way.
    pub legs_left: &'a Cell<u32>,
}

/// A way in straight legs.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedWay {
    /// From the start to the goal, both included.
    pub points: Vec<Ned>,
    /// When each point is reached, waits that are to be expected included.
    pub at: Vec<Duration>,
    /// The number of legs that lead out of an area in which the vehicle must not be.
    pub legs_out: usize,
    /// The areas that are entered after asking, or by force, in the order of the way.
    pub entered: Vec<usize>,
}

/// Why no way was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoWay {
    /// There is none.
    Closed,
    /// A search has given up before it had looked at everything.
    GaveUp,
}

/// Milliseconds.
const PROHIBITIVE_MS: u64 = 10_000_000_000;

/// Areas with no more corners than this together are searched among everything.
const FEW_CORNERS: usize = 100;
/// Among areas with more corners than this together the exact search by tangents would only give up: its effort is saved, and a way
/// costs up to a tenth more than the best. (Measured: among 1,000 areas of 20 corners half of the time went into it.)
const MANY_CORNERS: usize = 5_000;
/// Every turn among all corners.
const EVERYTHING: Effort = Effort { turns: Turns::Any, factor: 1.0, most_legs: 20_000 };
/// With how much effort a way is searched among more of them, in this order. A passage that is narrower than two margins may be
/// flown by turns that are not tangents, so those are tried last.
const EFFORTS: [Effort; 3] = [
    Effort { turns: Turns::Taut, factor: 1.0, most_legs: 1_000 },
    Effort { turns: Turns::Taut, factor: 1.1, most_legs: 20_000 },
    Effort { factor: 1.1, ..EVERYTHING },
];

/// How a way is searched.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Effort {
    /// Which legs meet at a corner.
    turns: Turns,
    /// The way costs at most this many times as much as the best.
    factor: f64,
    /// The search gives up after this number of legs.
    most_legs: u32,
}

/// Which legs meet at a corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Turns {
    /// Those of a way that cannot be cut short there.
    Taut,
    /// All: a place between two areas may be so narrow that one of their corners is too near to the other area.
    Any,
}

impl Effort {
    /// The efforts with which a way is searched among these areas, in this order.
    fn among<'a>(areas: impl Iterator<Item = &'a Area>) -> Vec<Effort> {
        let corners: usize = areas.map(|it| it.rings().map(<[Ned]>::len).sum::<usize>()).sum();
        let few = (corners <= FEW_CORNERS).then_some(EVERYTHING);
        let is_exact = |it: &Effort| it.factor == 1.0;
        few.into_iter().chain(EFFORTS.into_iter().filter(|it| corners <= MANY_CORNERS || !is_exact(it))).collect()
    }
}

/// The cheapest way: first out of areas in which the vehicle must not be, by the quickest way.
///
/// # Errors
/// If there is none, or none was found.
pub fn find(trip: Trip, among: Among) -> Result<TimedWay, NoWay> {
    let speeds = &among.limits.speeds;
    let must_leave = trip.begins.is_zero() && among.map.is_trespassed(&among.rule, trip.from);
    let out = match must_leave.then(|| leaving(trip.from, &among.rule, among.limits)) {
        None => Vec::new(),
        Some(Leaving::Flies(out)) => out,
        Some(Leaving::Stays { .. } | Leaving::NoWay) => return Err(NoWay::Closed),
    };
    let (mut points, mut at) = (vec![trip.from], vec![trip.begins]);
    for there in &out {
        at.push(at[at.len() - 1].saturating_add(speeds.time(points[points.len() - 1], *there)));
        points.push(*there);
    }
    let (Some(from), Some(begins)) = (points.pop(), at.pop()) else { return Err(NoWay::Closed) };
    let mut why = NoWay::Closed;
    for part in 0..MARGINS.len() {
        match cheapest(&Obstacles::new(Trip { from, begins, ..trip }, part, among)) {
            Ok(way) => {
                points.extend(&way.points);
                at.extend(&way.at);
                return Ok(TimedWay { points, at, legs_out: out.len(), entered: way.entered });
            }
            Err(NoWay::GaveUp) => why = NoWay::GaveUp,
            Err(NoWay::Closed) => {}
        }
    }
    Err(why)
}

/// The cheapest way, or one that is little dearer where there is too much in the way to find it in time.
fn cheapest(obstacles: &Obstacles) -> Result<TimedWay, NoWay> {
    if ends_in_closed_area(obstacles) {
        return Err(NoWay::Closed);
    }
    let mut why = NoWay::Closed;
    for effort in Effort::among(obstacles.all().map(|area| obstacles.area(area))) {
        match Graph::new(obstacles, effort).search() {
            Ok(way) => return Ok(way),
            Err(NoWay::GaveUp) => why = NoWay::GaveUp,
            Err(NoWay::Closed) => {}
        }
    }
    Err(why)
}

/// Whether a closed area bars the goal until long after any way would be there: to look at every way would show nothing else.
fn ends_in_closed_area(obstacles: &Obstacles) -> bool {
    let Obstacles { among, trip: Trip { from, to, begins, lands_from_m }, .. } = *obstacles;
    let flight = among.limits.speeds.time(from, to.at_height(from.height_m()));
    // A landing comes down last, perhaps for minutes.
    let top_m = lands_from_m.map(|it| it.max(from.height_m()));
    let down = top_m.map_or(Duration::ZERO, |it| among.limits.speeds.time(to.at_height(it), to));
    let (sooner, later) = (soonest(begins.saturating_add(flight)), latest_arrival(begins, flight.saturating_add(down)));
    let bars = |area: usize| {
        obstacles.may_bar(area)
            && among.entries[area] == Entry::Closed
            && obstacles.covers(area, to)
            && among.rule.bars_throughout(obstacles.area(area), sooner, later)
    };
    among.map.along(to, to).into_iter().any(bars)
}

/// No way that takes longer is worth to be searched for the sake of an area that is over then.
fn latest_arrival(begins: Duration, flight: Duration) -> Duration {
    const MORE: Duration = Duration::from_secs(60);
    begins.saturating_add(flight).saturating_add(flight).saturating_add(MORE)
}
