//! Which place to land at is in reach, with what charge above the reserve: straight, in the true wind, through air that is open on the way.
//!
//! It looks for less than the vehicle could: no way round an area, no permission that might still be granted. What it finds, the
//! vehicle had.

use std::time::Duration;

use domain::energy::Wind;
use domain::geometry::Ned;
use domain::quantity::Fraction;
use domain::speeds::Speeds;
use domain::time::Time;
use kittiwake_proto::v1;

use super::View;
use crate::inside::is_inside;

/// How often it looks.
const EVERY: Duration = Duration::from_secs(2);
/// The greatest distance between two points of a way that are looked at, and on both sides beside it: the margin of the shipped
/// configuration, and what a sample misses.
const SAMPLE_M: f64 = 10.0;
const BESIDE_M: f64 = 15.0;
/// Over the highest place of the mission, and over the ground. (The planner's `takeoff_height_m`.)
const OVER_M: f64 = 10.0;
/// As far as the height of a flight is allowed.
const HIGHEST_M: f64 = 110.0;
/// A grant must hold that much longer. (The mission manager's `permission_margin_s`.)
const GRANT_LEAD_S: f64 = 30.0;
/// The shipped speeds.
const SPEEDS: Speeds = Speeds { airspeed_m_s: 15.0, ..Speeds::calm(10.0, 3.0, 1.5) };

/// The best place, and what is left above the reserve there, 0 to 1.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Best {
    pub(super) place: String,
    pub(super) position: Ned,
    pub(super) margin: f64,
}

#[derive(Debug, Default)]
pub(super) struct Reach {
    looked: Option<Time>,
    pub(super) best: Option<Best>,
}

impl Reach {
    /// Looks again, if it is time to.
    pub(super) fn look(&mut self, view: &View<'_>) {
        let now = view.heard.now.time;
        if view.truth.standing || self.looked.is_some_and(|it| now < it + EVERY) {
            return;
        }
        self.looked = Some(now);
        let places = places(view.mission);
        let highest_m = places.iter().map(|(_, it)| it.height_m()).fold(0.0, f64::max);
        let margin = |(place, position): (String, Ned)| {
            let margin = margin(view, position, highest_m + OVER_M)?;
            Some(Best { place, position, margin })
        };
        self.best = places.into_iter().filter_map(margin).max_by(|a, b| a.margin.total_cmp(&b.margin));
    }
}

/// Home, the sites to land at, and the objectives on the ground.
fn places(mission: &v1::MissionStatus) -> Vec<(String, Ned)> {
    let sites = mission.sites.iter().filter(|it| it.kind() == v1::SiteKind::Landing).map(|it| (&it.name, it.position));
    let grounds = mission.objectives.iter().filter(|it| !it.flying).map(|it| (&it.name, it.position));
    let named = sites.chain(grounds).filter_map(|(name, it)| Some((name.clone(), Ned::try_from(it?).ok()?)));
    std::iter::once(("home".to_owned(), Ned::default())).chain(named).collect()
}

/// What is left above the reserve after a landing there, 0 to 1; `None` if it cannot be flown so.
fn margin(view: &View<'_>, place: Ned, least_m: f64) -> Option<f64> {
    let (from, wind) = (view.truth.position, view.truth.wind);
    let speeds = Speeds { wind: Wind::Towards { north_m_s: wind.north_m_s, east_m_s: wind.east_m_s }, ..SPEEDS };
    let height_m = from.height_m().max(least_m);
    if HIGHEST_M < height_m || !speeds.hold_in_wind() {
        return None;
    }
    let way = [from.at_height(height_m), place.at_height(height_m), place];
    let time_s = speeds.time_along_s(from, &way);
    if !is_open(view, from, &way, time_s) {
        return None;
    }
    let energy = view.energy.taking(view.truth.drain.max(1.0));
    let used_wh = energy.landing_flight_wh(from, &way, &speeds, speeds.wind);
    let charge = Fraction::try_from(view.truth.charge.clamp(0.0, 1.0)).ok()?;
    let reserve = view.energy.budget(charge).reserve.get();
    Some(energy.charge_after(charge, used_wh) - reserve).filter(|it| 0.0 <= *it)
}

fn is_open(view: &View<'_>, from: Ned, way: &[Ned], time_s: f64) -> bool {
    let utc_ms = view.heard.now.utc_ms;
    let moments = [0.0, time_s / 2.0, time_s, 1.25 * time_s + GRANT_LEAD_S].map(|it| utc_ms + (it * 1000.0) as i64);
    let closed: Vec<_> =
        view.heard.areas.iter().filter(|area| moments.iter().any(|it| view.is_closed(area, *it))).collect();
    let starts = std::iter::once(&from).chain(way);
    let legs = starts.zip(way);
    legs.flat_map(|(a, b)| samples(*a, *b)).all(|at| closed.iter().all(|area| !is_inside(area, at)))
}

/// Points of a leg, and beside it.
fn samples(from: Ned, to: Ned) -> impl Iterator<Item = Ned> {
    let count = (from.distance_m(to) / SAMPLE_M).ceil().max(1.0);
    let along = (0..=count as u32).map(move |it| from.towards(to, f64::from(it) / count));
    let beside = [(0.0, 0.0), (BESIDE_M, 0.0), (-BESIDE_M, 0.0), (0.0, BESIDE_M), (0.0, -BESIDE_M)];
    along.flat_map(move |at| {
        beside.map(|(north, east)| Ned { north_m: at.north_m + north, east_m: at.east_m + east, ..at })
    })
}
