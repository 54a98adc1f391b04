//! Airspace belongs to the ground: an area that the control tower has closed, or that a data set has set, stays whatever a mission lists.
//! A mission only adds areas. A tower opens its own by a grant, and a later edition of a data set replaces the earlier one.

use std::collections::{BTreeMap, BTreeSet};

use domain::area::{Area, AreaKind};
use domain::feed::{Feed, TOWER};
use domain::file::MOST_MISTAKES;
use domain::geodesy::LocalFrame;
use domain::geometry::Ned;
use domain::mission::Mission;
use domain::mission::bounds::{MOST_AREAS, MOST_CORNERS};
use domain::state::State;
use domain::time::Now;

use crate::mission_planner::MissionPlanner;
use crate::mission_planner::origin::{Misfit, misfit};
use crate::mission_request::Reply;

/// The areas that the control tower has denied or revoked last, or may have, each with the number of that decision, which is its time.
pub(crate) type Closed = BTreeMap<String, u64>;

/// Places that differ by no more are the same, in metres. (The page writes a mission to a centimetre.)
const SAME_M: f64 = 0.01;

/// `mission` with the areas of the present one that stay whatever it lists, and a sentence about those that it does not list. `is_renewed`:
/// a data set of the present mission is replaced.
pub(crate) fn with_lasting_areas(
    planner: &MissionPlanner,
    closed: &Closed,
    mut mission: Mission,
    is_renewed: impl Fn(&Feed) -> bool,
) -> Result<(Mission, Option<String>), Reply> {
    let listed: BTreeMap<String, usize> =
        mission.areas.iter().enumerate().map(|(index, it)| (it.name.clone(), index)).collect();
    let data_sets = planner.mission().feeds.iter().filter(|it| it.is_data_set());
    let of_data_sets: BTreeMap<&str, &Feed> =
        data_sets.flat_map(|feed| feed.areas.iter().map(move |it| (it.as_str(), feed))).collect();
    // Its edition is the latest decision.
    let edition = closed.values().max().and_then(|it| i64::try_from(*it).ok());
    let tower = Feed { name: TOWER.into(), issued_utc_ms: edition, ..Feed::default() };
    let (mut sources, mut added) = (BTreeMap::new(), Vec::new());
    for area in areas(planner, &mission) {
        let at = listed.get(&area.name);
        let source = match of_data_sets.get(area.name.as_str()) {
            Some(feed) if !is_renewed(feed) => *feed,
            // The data set says itself where it is.
            Some(_) if at.is_some() => continue,
            _ if closed.contains_key(&area.name) => &tower,
            _ => continue,
        };
        let feed = sources.entry(&source.name).or_insert_with(|| Feed { areas: Vec::new(), ..source.clone() });
        feed.areas.push(area.name.clone());
        match at {
            None => {
                added.push(area.name.clone());
                mission.areas.push(area);
            }
            Some(at) if is_same(&mission.areas[*at], &area) => mission.areas[*at] = area,
            Some(_) => {
                let feed = format!("feed `{}`", source.name);
                let of = if source.is_data_set() { &feed } else { "the control tower" };
                let name = &area.name;
                return Err(Reply::new(format!(
                    "area `{name}` is another one than that of {of}: leave it as it is, or give it another name"
                )));
            }
        }
    }
    for mut feed in sources.into_values() {
        match mission.feeds.iter_mut().find(|it| it.name == feed.name) {
            Some(listed) => {
                let stay: BTreeSet<String> = feed.areas.iter().cloned().collect();
                feed.areas.extend(listed.areas.drain(..).filter(|it| !stay.contains(it)));
                *listed = feed;
            }
            None => mission.feeds.push(feed),
        }
    }
    within_bounds(&mission)?;
    Ok((mission, in_words(&added)))
}

/// The present areas, in the local frame of `mission`.
fn areas(planner: &MissionPlanner, mission: &Mission) -> Vec<Area> {
    let areas = planner.mission().areas.iter().cloned();
    let tolerance_m = planner.rules().config.origin_tolerance_m.get();
    let apart = misfit(planner.mission().origin, mission.origin, tolerance_m);
    let Some(Misfit::Elsewhere { mission: from, vehicle: to, .. }) = apart else { return areas.collect() };
    let (from, to) = (LocalFrame::at(from), LocalFrame::at(to));
    let moved = |ring: &Vec<Ned>| ring.iter().map(|it| to.local(from.lat_lon(*it))).collect();
    areas.map(|it| Area { corners: moved(&it.corners), holes: it.holes.iter().map(moved).collect(), ..it }).collect()
}

/// A sentence about areas that a mission does not list, if there are any.
fn in_words(added: &[String]) -> Option<String> {
    let named = added[..added.len().min(MOST_MISTAKES)].join(", ");
    match added.len().saturating_sub(MOST_MISTAKES) {
        _ if added.is_empty() => None,
        0 => Some(format!("not listed, and stays: {named}")),
        more => Some(format!("not listed, and stays: {named} and {more} more areas")),
    }
}

/// Whether the two are one area, as far as a text tells.
fn is_same(a: &Area, b: &Area) -> bool {
    let near = |a: f64, b: f64| (a - b).abs() <= SAME_M;
    let same_height = |a: Option<f64>, b: Option<f64>| match (a, b) {
        (Some(a), Some(b)) => near(a, b),
        (a, b) => a == b,
    };
    let same_ring = |(a, b): (&[Ned], &[Ned])| {
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| near(a.north_m, b.north_m) && near(a.east_m, b.east_m))
    };
    let same_rings = || a.holes.len() == b.holes.len() && a.rings().zip(b.rings()).all(same_ring);
    let same_heights = same_height(a.floor_m, b.floor_m) && same_height(a.ceiling_m, b.ceiling_m);
    a.kind == b.kind
        && (a.extent() == b.extent() || same_heights && same_rings())
        && (a.from_utc_ms, a.until_utc_ms, &a.hours) == (b.from_utc_ms, b.until_utc_ms, &b.hours)
}

/// A mission has no more areas and corners than one file may have.
fn within_bounds(mission: &Mission) -> Result<(), Reply> {
    let areas = mission.areas.len();
    let corners: usize = mission.areas.iter().flat_map(Area::rings).map(<[_]>::len).sum();
    if MOST_AREAS < areas || MOST_CORNERS < corners {
        return Err(Reply::new(format!(
            "the mission would have {areas} areas with {corners} corners, at most {MOST_AREAS} with {MOST_CORNERS} are allowed"
        )));
    }
    Ok(())
}

/// What `mission` adds to the areas of `present` so that the vehicle is inside without a permission: for each whether a data set has set it,
/// and the words.
pub(crate) fn added_over_the_vehicle(
    present: &Mission,
    mission: &Mission,
    state: &State,
    now: Now,
) -> Vec<(bool, String)> {
    let is_barred = |it: &&Area| match it.kind {
        AreaKind::KeepOut => true,
        AreaKind::Permission => state.flying && !state.permissions.contains(&it.name),
    };
    let around = mission.areas.iter().filter(|it| it.is_active(now.utc_ms) && it.contains(state.position));
    let added = around.filter(is_barred).filter(|it| !present.areas.contains(it));
    let in_words = |it: &Area| match it.kind {
        AreaKind::KeepOut => format!("the vehicle is inside keep-out area `{}`", it.name),
        AreaKind::Permission => format!("the vehicle is inside area `{}` without a permission", it.name),
    };
    added.map(|it| (mission.feed_of(&it.name).is_some(), in_words(it))).collect()
}
