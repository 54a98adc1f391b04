//! Ways that need no permission: out of an area, and to a place, round, over or under areas that are barred.
//!
//! For responses, which fly without a plan. Plans, which ask for permissions and wait for them, are searched by the same [`find`].

use std::cell::Cell;
use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::time::Duration;

use geo::{Closest, ClosestPoint, LineString, Point};

use crate::airspace::{Airspace, Motion};
use crate::area::{Area, AreaKind, NO_LANDING_TO_M, rings};
use crate::area_map::AreaMap;
use crate::geometry::Ned;
use crate::harm::Harm;
use crate::outline::Outline;
use crate::site::SiteKind;
use crate::speeds::Speeds;

mod search;

pub(crate) use search::KeptLegs;
pub use search::{Among, Asked, Entry, KEPT, NoWay, TimedWay, Trip, find};

/// The speeds, heights and distances of a flight without a plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlightLimits {
    /// How fast.
    pub speeds: Speeds,
    /// Below this height above the ground, in metres, the vehicle climbs before it flies anywhere.
    pub least_height_m: f64,
    /// The height above a place at which a flight comes to it from afar to land, in metres.
    pub return_height_m: f64,
    /// The greatest height of a way, in metres above the origin.
    pub highest_m: f64,
    /// Distance beyond a border at which an area counts as left, in metres.
    pub clearance_m: f64,
    /// Distance kept to the border of an area that is flown round, in metres.
    pub margin_m: f64,
    /// Distance to a floor or a ceiling, beyond the vertical margin, at which the vehicle flies past under or over an area, in metres.
    pub height_clearance_m: f64,
}

/// Directions that are tried in addition to the shortest one to each side: in a corner between two
/// areas no direction to a side may work.
const DIRECTIONS: u32 = 32;
/// Directions to sides that are tried, the nearest sides first: each takes time with every corner around, and a coastline has thousands.
const MOST_SIDES: usize = 64;
/// Distance to a floor or a ceiling, beyond the vertical margin, at which the vehicle is out of an area, in metres.
const HEIGHT_STEP_M: f64 = 1.0;
/// Heights that differ by no more than this are the same, in metres.
const SAME_HEIGHT_M: f64 = 1.0;
/// A search of a response gives up after this number of legs: it runs in the mission manager's loop, which counts as hung after a
/// second. (Measured: 2 to 10 us for a leg.)
pub const MOST_LEGS: u32 = 20_000;
/// The wait to be expected for a permission that a response asks for, in seconds: what a way round may cost at most. (ENG: as the
/// planner's.)
const EXPECTED_WAIT_S: f64 = 2.0;

impl FlightLimits {
    /// Whether a way over level ground may be at this height, in metres above the origin.
    pub fn permits(&self, height_m: f64) -> bool {
        self.least_height_m <= height_m && height_m <= self.highest_m
    }
}

/// The points to fly to from `from`, in the air, to leave every area in which the vehicle may not be: sideways, over or
/// under, by the quickest way. Empty if it is in none; `None` if there is no way out.
pub fn way_out(from: Ned, airspace: &Airspace, limits: &FlightLimits) -> Option<Vec<Ned>> {
    let trespassed: Vec<&Area> = airspace.trespassed(from).collect();
    if trespassed.is_empty() {
        return Some(Vec::new());
    }
    let motion = Motion::in_air(limits.speeds);
    let is_free = |way: &Vec<Ned>| {
        let starts = std::iter::once(&from).chain(way.iter());
        let is_high_enough = |leg| airspace.ground.hills(leg, None, limits).next().is_none();
        let legs_are_free =
            starts.zip(way).all(|(a, b)| is_high_enough((*a, *b)) && airspace.first_breach(*a, *b, motion).is_none());
        way.last().is_some_and(|end| airspace.trespassed(*end).next().is_none()) && legs_are_free
    };
    let quickest = |ways: Vec<Vec<Ned>>| {
        let free = ways.into_iter().filter(is_free);
        free.min_by(|a, b| limits.speeds.time_along_s(from, a).total_cmp(&limits.speeds.time_along_s(from, b)))
    };
    let clear_m = airspace.ground.clear_m(from, limits);
    // Low over the only free ground everything around may bar landings: the way out leads over that.
    let over_no_landing_m = clear_m.max(NO_LANDING_TO_M + airspace.vertical_margin_m + HEIGHT_STEP_M);
    let [level, higher] = [clear_m, over_no_landing_m]
        .map(|least_m| from.at_height(from.height_m().clamp(least_m, limits.highest_m.max(least_m))));
    let clearances = [limits.clearance_m, limits.clearance_m / 2.0];
    let higher = (higher != level).then_some(higher);
    let mut tries = std::iter::once(level).chain(higher).flat_map(|level| clearances.map(|it| (level, it)));
    tries.find_map(|(level, clearance_m)| {
        let sideways = directions(level, &trespassed).into_iter().filter_map(|direction| {
            let exit = exit_along(level, direction, clearance_m, airspace)?;
            Some(if level == from { vec![exit] } else { vec![level, exit] })
        });
        quickest(sideways.chain(over_and_under(from, &trespassed, airspace, limits)).collect())
    })
}

/// How a vehicle comes out of the areas in which it may not be.
#[derive(Debug, Clone, PartialEq)]
pub enum Leaving {
    /// It flies to these points; to none if it is in no such area.
    Flies(Vec<Ned>),
    /// It stays where it is: the last of them is over sooner than it could be out.
    Stays {
        /// When that is over.
        ends: Duration,
        /// How long the way out would take.
        way: Duration,
    },
    /// There is no way out.
    NoWay,
}

/// How a vehicle at `from`, in the air, comes out of every area in which it may not be: by [`way_out`], but where an area is over
/// before that is flown, the way leads away from where it was to be and ends nothing sooner.
pub fn leaving(from: Ned, airspace: &Airspace, limits: &FlightLimits) -> Leaving {
    let Some(out) = way_out(from, airspace, limits) else { return Leaving::NoWay };
    let way = Duration::try_from_secs_f64(limits.speeds.time_along_s(from, &out)).unwrap_or(Duration::MAX);
    match airspace.trespass_ends(from).filter(|ends| !out.is_empty() && *ends <= way) {
        Some(ends) => Leaving::Stays { ends, way },
        None => Leaving::Flies(out),
    }
}

/// The points to fly to from `from`, in the air, to a place where the vehicle may come straight down: nothing barred, or
/// barred before it is down, is below it there. The descent need not end inside an area for that area to count: what may not be
/// flown through is not landed in. What only bars landings counts where coming down there harms more than `accepts`. Empty if that is here; `None`
/// if there is no such place.
pub fn way_to_ground(from: Ned, accepts: Harm, airspace: &Airspace, limits: &FlightLimits) -> Option<Vec<Ned>> {
    let ground = from.at_height(airspace.ground.height_m(from).min(from.height_m()));
    let descent = limits.speeds.time(from, ground);
    let top_m = from.height_m() + airspace.vertical_margin_m;
    let reaches_down = |area: &Area| area.floor_m.is_none_or(|floor_m| floor_m <= top_m);
    let down_to_the_ground = |area: &Area| match reaches_down(area) {
        true => Area { floor_m: None, ceiling_m: None, ..area.clone() },
        false => area.clone(),
    };
    let bars = |area: &&Area| !area.takes(accepts);
    let areas: Vec<Area> = airspace.areas.iter().filter(bars).map(down_to_the_ground).collect();
    way_out(from, &Airspace { areas: &areas, lead: airspace.lead.saturating_add(descent), ..*airspace }, limits)
}

/// The heights so far over the ceiling and under the floor of `area`, where it has them.
pub fn beyond(area: &Area, clearance_m: f64) -> impl Iterator<Item = f64> {
    let (over, under) = (area.ceiling_m.map(|it| it + clearance_m), area.floor_m.map(|it| it - clearance_m));
    over.into_iter().chain(under)
}

/// Straight up over all of `areas`, and straight down below them.
fn over_and_under(from: Ned, areas: &[&Area], airspace: &Airspace, limits: &FlightLimits) -> Vec<Vec<Ned>> {
    let beyond_m = airspace.vertical_margin_m + HEIGHT_STEP_M;
    let over = areas.iter().map(|it| it.ceiling_m).collect::<Option<Vec<f64>>>();
    let over_m = over.map(|it| it.into_iter().fold(f64::NEG_INFINITY, f64::max) + beyond_m);
    let under = areas.iter().map(|it| it.floor_m).collect::<Option<Vec<f64>>>();
    let under_m = under.map(|it| it.into_iter().fold(f64::INFINITY, f64::min) - beyond_m);
    let heights = [over_m, under_m].into_iter().flatten().filter(|it| limits.permits(*it));
    heights.map(|height_m| vec![from.at_height(height_m)]).collect()
}

/// Unit vectors `(north, east)`: perpendicular to each of the nearest sides, those of holes included, then all round.
fn directions(from: Ned, areas: &[&Area]) -> Vec<(f64, f64)> {
    let here = Point::new(from.east_m, from.north_m);
    let polygons: Vec<_> = areas.iter().map(|it| it.polygon()).collect();
    let sides = polygons.iter().flat_map(rings).flat_map(LineString::lines);
    let square = sides.filter_map(|side| match side.closest_point(&here) {
        Closest::SinglePoint(it) | Closest::Intersection(it) => {
            let (north_m, east_m) = (it.y() - from.north_m, it.x() - from.east_m);
            let length_m = north_m.hypot(east_m);
            (length_m > 0.0).then(|| (length_m, (north_m / length_m, east_m / length_m)))
        }
        Closest::Indeterminate => None,
    });
    let mut square: Vec<_> = square.collect();
    square.sort_by(|a, b| a.0.total_cmp(&b.0));
    let square = square.into_iter().take(MOST_SIDES).map(|(_, direction)| direction);
    let all_round = (0..DIRECTIONS).map(|it| (TAU * f64::from(it) / f64::from(DIRECTIONS)).sin_cos());
    square.chain(all_round).collect()
}

/// The point `clearance_m` beyond the place where the ray first leaves all areas in which the vehicle must not stay.
fn exit_along(from: Ned, direction: (f64, f64), clearance_m: f64, airspace: &Airspace) -> Option<Ned> {
    /// A point this far beyond a border counts as outside, in metres.
    const BEYOND_M: f64 = 1e-3;
    let along = |distance_m: f64| {
        Ned::new(from.north_m + direction.0 * distance_m, from.east_m + direction.1 * distance_m, from.down_m)
    };
    let barred = airspace.barred(Duration::ZERO);
    let corners = barred.iter().flat_map(|it| it.corners.iter());
    let reach_m = corners.map(|it| it.horizontal_distance_m(from)).fold(0.0, f64::max) + clearance_m;
    let mut borders_m: Vec<f64> =
        barred.iter().flat_map(|it| it.crossings(from, along(reach_m))).map(|fraction| fraction * reach_m).collect();
    borders_m.sort_by(f64::total_cmp);
    let exit_m = borders_m.into_iter().find(|it| airspace.trespassed(along(it + BEYOND_M)).next().is_none())?;
    Some(along(exit_m + clearance_m))
}

/// What a search of limited effort has found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found<Way> {
    /// `None` if there is no way, or none was found with the effort.
    pub way: Option<Way>,
    /// Legs that were looked at.
    pub legs: u32,
}

/// A way that takes permissions which are not held.
#[derive(Debug, Clone, PartialEq)]
pub struct WayToAsk {
    /// The points to fly to.
    pub points: Vec<Ned>,
    /// The areas to get permission for; none if the way takes none, so that something else bars it.
    pub needs: BTreeSet<String>,
}

/// What a vehicle that flies without a plan has around it, and how it flies.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    /// The areas as they stand now.
    pub airspace: Airspace<'a>,
    /// Of the same areas.
    pub map: &'a AreaMap,
    /// Speeds, heights and distances.
    pub limits: &'a FlightLimits,
    /// The kind of place that it comes down at.
    pub ends_at: SiteKind,
}

impl Surroundings<'_> {
    /// The points to fly to from `from`, in the air, the last one over `to`, where the vehicle may come straight down; of no more
    /// than `most_legs` looked at. First out of areas in which the vehicle may not be, by the quickest way; then at the height at which
    /// `to` is approached, round, over or under barred areas, and round or over ground that is too high.
    pub fn way_within(&self, from: Ned, to: Ned, most_legs: u32) -> Found<Vec<Ned>> {
        let Found { way, legs } = self.find(from, to, most_legs, |_| Entry::Closed);
        Found { way: way.map(|(points, _)| points), legs }
    }

    /// The same with permissions that are yet to be got.
    pub fn way_if_granted(&self, from: Ned, to: Ned, most_legs: u32) -> Found<WayToAsk> {
        let entry = |area: &Area| match area.kind {
            AreaKind::Permission => Entry::Ask { wait_s: EXPECTED_WAIT_S },
            AreaKind::KeepOut => Entry::Closed,
        };
        // Were it granted, nobody would have to leave what is around the vehicle.
        let around = self.airspace.trespassed(from).filter(|it| it.kind == AreaKind::Permission);
        let around: BTreeSet<String> = around.map(|it| it.name.clone()).collect();
        let mut grants = self.airspace.grants.clone();
        grants.extend(around.iter().map(|it| (it.clone(), Duration::MAX)));
        let if_granted = Surroundings { airspace: Airspace { grants: &grants, ..self.airspace }, ..*self };
        let Found { way, legs } = if_granted.find(from, to, most_legs, entry);
        let way = way.map(|(points, needs)| WayToAsk { points, needs: &needs | &around });
        Found { way, legs }
    }

    fn find(
        &self,
        from: Ned,
        to: Ned,
        most_legs: u32,
        entry: impl Fn(&Area) -> Entry,
    ) -> Found<(Vec<Ned>, BTreeSet<String>)> {
        let Surroundings { airspace: rule, map, limits, ends_at } = *self;
        let entries: Vec<Entry> = rule.areas.iter().map(entry).collect();
        let asked: Asked = (0..rule.areas.len()).filter(|it| rule.areas[*it].takes(ends_at.harm())).collect();
        let legs_left = Cell::new(most_legs);
        let among = Among { rule, map, entries: &entries, asked: &asked, limits, legs_left: &legs_left };
        let approach_m = rule.ground.approach_m(from, to, limits);
        let trip = Trip { from, to, begins: Duration::ZERO, lands_from_m: Some(approach_m) };
        let way = find(trip, among).ok().map(|TimedWay { mut points, entered, .. }| {
            points.remove(0);
            // The landing.
            points.pop();
            (points, entered.into_iter().map(|it| rule.areas[it].name.clone()).collect())
        });
        Found { way, legs: most_legs - legs_left.get() }
    }
}

/// Which ends of a leg may be nearer to a border than the margin, because they are given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Exempt {
    /// The leg begins where the vehicle is.
    pub start: bool,
    /// The leg ends where the way is to lead.
    pub end: bool,
}

/// Whether the level leg from `from` to `to` keeps `margin_m` from `area`, but for its first and last `margin_m` where
/// those are exempt. Heights are not looked at.
pub fn keeps_clear(area: &Area, from: Ned, to: Ned, margin_m: f64, exempt: Exempt) -> bool {
    area.is_beyond(margin_m, from, to) || Outline::new(area).keeps_clear(from, to, margin_m, exempt)
}

/// Points `margin_m` away from the borders that `point` is nearer to: from there a way keeps its margin.
pub fn footholds(point: Ned, areas: &[&Area], margin_m: f64) -> Vec<Ned> {
    let here = Point::new(point.east_m, point.north_m);
    let away = |ring: &LineString| {
        let border = match ring.closest_point(&here) {
            Closest::SinglePoint(it) | Closest::Intersection(it) => it,
            Closest::Indeterminate => return None,
        };
        let (north_m, east_m) = (point.north_m - border.y(), point.east_m - border.x());
        let distance_m = north_m.hypot(east_m);
        if distance_m == 0.0 || margin_m <= distance_m {
            return None;
        }
        let scale = margin_m / distance_m;
        Some(Ned::new(border.y() + north_m * scale, border.x() + east_m * scale, point.down_m))
    };
    let polygons: Vec<_> = areas.iter().map(|it| it.polygon()).collect();
    polygons.iter().flat_map(rings).filter_map(away).collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::airspace::Grants;
    use crate::airspace::tests::{airspace, area, square};
    use crate::harm::Ground;

    pub(crate) const LIMITS: FlightLimits = FlightLimits {
        speeds: Speeds::calm(10.0, 3.0, 1.5),
        least_height_m: 5.0,
        return_height_m: 15.0,
        highest_m: 120.0,
        clearance_m: 20.0,
        margin_m: 10.0,
        height_clearance_m: 1.0,
    };

    fn at(north: f64, east: f64, height: f64) -> Ned {
        Ned::new(north, east, -height)
    }

    fn rounded(way: Option<Vec<Ned>>) -> Option<Vec<(f64, f64, f64)>> {
        let point = |it: &Ned| (it.north_m.round() + 0.0, it.east_m.round() + 0.0, it.height_m().round());
        way.map(|way| way.iter().map(point).collect())
    }

    /// The way to `to`, in whole metres.
    fn way(areas: &[Area], grants: &Grants, from: Ned, to: Ned) -> Option<Vec<(f64, f64, f64)>> {
        let map = AreaMap::new(areas);
        let around =
            Surroundings { airspace: airspace(areas, grants), map: &map, limits: &LIMITS, ends_at: SiteKind::Landing };
        rounded(around.way_within(from, to, MOST_LEGS).way)
    }

    #[test]
    fn the_way_out_is_the_quickest_of_sideways_over_and_under() {
        #[track_caller]
        fn check(area: Area, from: Ned, expected: Option<&[(f64, f64, f64)]>) {
            let (areas, grants) = ([area], Grants::new());
            assert_eq!(rounded(way_out(from, &airspace(&areas, &grants), &LIMITS)).as_deref(), expected, "{from:?}");
        }
        let endless = || Area { ceiling_m: None, ..square(AreaKind::Permission) };
        check(endless(), at(0.0, 90.0, 10.0), Some(&[]));
        check(endless(), at(0.0, 140.0, 10.0), Some(&[(0.0, 80.0, 10.0)]));
        check(endless(), at(60.0, 200.0, 10.0), Some(&[(110.0, 200.0, 10.0)]));
        // Too low to fly sideways: up first.
        check(endless(), at(0.0, 140.0, 2.0), Some(&[(0.0, 140.0, 5.0), (0.0, 80.0, 5.0)]));
        let low = || Area { ceiling_m: Some(12.0), ..endless() };
        check(low(), at(0.0, 200.0, 10.0), Some(&[(0.0, 200.0, 15.0)]));
        let high = || Area { floor_m: Some(12.0), ..endless() };
        check(high(), at(0.0, 200.0, 13.0), Some(&[(0.0, 200.0, 9.0)]));
        check(high(), at(0.0, 105.0, 60.0), Some(&[(0.0, 80.0, 60.0)]));
    }

    #[test]
    fn the_way_out_leads_into_a_hole_if_that_is_nearer() {
        // The hole is the inside of a fence; the area round it ends far away.
        let ring = |side: f64| [(-side, -side), (side, -side), (side, side), (-side, side)];
        let hole = ring(400.0).map(|(north, east)| Ned::new(north, east, 0.0)).to_vec();
        let fence = Area { holes: vec![hole], ceiling_m: None, ..area("F", AreaKind::KeepOut, &ring(140e3)) };
        let check = |from: Ned, expected: &[(f64, f64, f64)]| {
            let (areas, grants) = ([fence.clone()], Grants::new());
            let way = way_out(from, &airspace(&areas, &grants), &LIMITS);
            assert_eq!(rounded(way).as_deref(), Some(expected), "{from:?}");
        };
        check(at(0.0, 100.0, 10.0), &[]);
        check(at(30.0, 720.0, 10.0), &[(30.0, 380.0, 10.0)]);
        check(at(-401.0, 0.0, 10.0), &[(-380.0, 0.0, 10.0)]);
        check(at(0.0, 139_500.0, 10.0), &[(0.0, 140_020.0, 10.0)]);
        // Through the corner of the fence is nearest.
        let [corner] =
            way_out(at(500.0, 500.0, 10.0), &airspace(std::slice::from_ref(&fence), &Grants::new()), &LIMITS).unwrap()
                [..]
        else {
            panic!("one leg")
        };
        assert!(corner.north_m.abs() < 400.0 && corner.east_m.abs() < 400.0, "{corner}");
    }

    #[test]
    fn in_a_hole_a_way_turns_at_its_corners_and_leaves_it_over_the_area_only() {
        // A hole like a U, 400 m by 400 m, with a wall of 100 m between its arms.
        let hole = [
            (-200.0, -200.0),
            (200.0, -200.0),
            (200.0, -50.0),
            (-100.0, -50.0),
            (-100.0, 50.0),
            (200.0, 50.0),
            (200.0, 200.0),
            (-200.0, 200.0),
        ];
        let hole = hole.map(|(north, east)| Ned::new(north, east, 0.0)).to_vec();
        let outline = [(-900.0, -900.0), (900.0, -900.0), (900.0, 900.0), (-900.0, 900.0)];
        let round = |ceiling_m| Area { holes: vec![hole.clone()], ceiling_m, ..area("R", AreaKind::KeepOut, &outline) };
        let check = |ceiling_m, to: Ned, expected: Option<&[(f64, f64, f64)]>| {
            let (areas, grants) = ([round(ceiling_m)], Grants::new());
            assert_eq!(way(&areas, &grants, at(150.0, -100.0, 15.0), to).as_deref(), expected, "{to:?}");
        };
        let across = at(150.0, 100.0, 0.0);
        check(None, across, Some(&[(-110.0, -60.0, 15.0), (-110.0, 60.0, 15.0), (150.0, 100.0, 15.0)]));
        check(None, at(0.0, 1_500.0, 0.0), None);
        let over = [(146.0, -60.0, 23.0), (55.0, 910.0, 23.0), (0.0, 1_500.0, 15.0)];
        check(Some(20.0), at(0.0, 1_500.0, 0.0), Some(&over));
    }

    #[test]
    fn no_more_directions_are_tried_however_many_sides_there_are() {
        // A circle of 200 m, with the vehicle nearest to its west.
        let corner = |it: u32| {
            let (sin, cos) = (TAU * f64::from(it) / 4000.0).sin_cos();
            (200.0 * sin, 200.0 + 200.0 * cos)
        };
        let corners: Vec<_> = (0..4000).map(corner).collect();
        let coast = Area { ceiling_m: None, ..area("A", AreaKind::Permission, &corners) };
        let here = at(0.0, 50.0, 10.0);
        let directions = directions(here, &[&coast]);
        assert_eq!(directions.len(), MOST_SIDES + DIRECTIONS as usize);
        let (areas, grants) = ([coast], Grants::new());
        assert_eq!(rounded(way_out(here, &airspace(&areas, &grants), &LIMITS)), Some(vec![(0.0, -20.0, 10.0)]));
    }

    #[test]
    fn there_is_no_way_out_through_another_area() {
        let wall = area("W", AreaKind::KeepOut, &[(-500.0, 40.0), (500.0, 40.0), (500.0, 100.0), (-500.0, 100.0)]);
        let areas = [Area { ceiling_m: None, ..square(AreaKind::Permission) }, Area { ceiling_m: None, ..wall }];
        let grants = Grants::new();
        let way = rounded(way_out(at(0.0, 120.0, 10.0), &airspace(&areas, &grants), &LIMITS)).unwrap();
        assert_eq!(way, [(110.0, 120.0, 10.0)], "north, not through the wall in the west");
    }

    #[track_caller]
    fn check_way(areas: &[Area], from: Ned, expected: Option<&[(f64, f64, f64)]>) {
        let grants = Grants::new();
        assert_eq!(way(areas, &grants, from, Ned::default()).as_deref(), expected, "from {from:?}");
    }

    #[test]
    fn the_way_leads_round_over_or_under_what_may_not_be_entered() {
        let endless = || Area { ceiling_m: None, ..square(AreaKind::KeepOut) };
        check_way(&[], at(0.0, 400.0, 10.0), Some(&[(0.0, 400.0, 15.0), (0.0, 0.0, 15.0)]));
        check_way(
            &[endless()],
            at(10.0, 400.0, 15.0),
            Some(&[(100.0, 310.0, 15.0), (100.0, 90.0, 15.0), (0.0, 0.0, 15.0)]),
        );
        // Over a low one, when round it is far.
        let low_wall = Area {
            ceiling_m: Some(20.0),
            ..area("W", AreaKind::KeepOut, &[(-900.0, 100.0), (900.0, 100.0), (900.0, 300.0), (-900.0, 300.0)])
        };
        check_way(&[low_wall], at(0.0, 400.0, 15.0), Some(&[(0.0, 310.0, 23.0), (0.0, 90.0, 23.0), (0.0, 0.0, 15.0)]));
        // Under a ceiling that is lower than the preferred height.
        let roof = Area {
            floor_m: Some(12.0),
            ..area("R", AreaKind::KeepOut, &[(-5e3, -5e3), (5e3, -5e3), (5e3, 5e3), (-5e3, 5e3)])
        };
        check_way(&[Area { ceiling_m: None, ..roof }], at(0.0, 400.0, 8.0), Some(&[(0.0, 0.0, 8.0)]));
    }

    #[test]
    fn ground_is_free_where_nothing_barred_is_below() {
        #[track_caller]
        fn check(area: Area, from: Ned, expected: Option<&[(f64, f64, f64)]>) {
            let (areas, grants) = ([area], Grants::new());
            let way = way_to_ground(from, Harm::NONE, &airspace(&areas, &grants), &LIMITS);
            assert_eq!(rounded(way).as_deref(), expected, "{from:?}");
        }
        let low = || Area { ceiling_m: Some(12.0), ..square(AreaKind::KeepOut) };
        check(low(), at(0.0, 90.0, 40.0), Some(&[]));
        check(low(), at(0.0, 140.0, 40.0), Some(&[(0.0, 80.0, 40.0)]));
        let roof = || Area { floor_m: Some(60.0), ..square(AreaKind::KeepOut) };
        check(Area { ceiling_m: None, ..roof() }, at(0.0, 200.0, 40.0), Some(&[]));
        check(Area { ceiling_m: Some(90.0), ..roof() }, at(0.0, 140.0, 100.0), Some(&[(0.0, 80.0, 100.0)]));
    }

    #[test]
    fn ground_that_harms_no_more_than_is_accepted_counts_as_free() {
        let low = |ground| Area { ceiling_m: Some(crate::area::NO_LANDING_TO_M), ground, ..square(AreaKind::KeepOut) };
        let check = |ground: Ground, accepts: Harm, expected: &[(f64, f64, f64)]| {
            let (areas, grants) = ([low(ground)], Grants::new());
            let way = way_to_ground(at(0.0, 140.0, 40.0), accepts, &airspace(&areas, &grants), &LIMITS);
            assert_eq!(rounded(way).as_deref(), Some(expected), "{ground:?} {accepts}");
        };
        let aside = &[(0.0, 80.0, 40.0)];
        check(Ground::Water, Harm::NONE, aside);
        check(Ground::Water, Harm::AIRCRAFT, &[]);
        check(Ground::People, Harm::AIRCRAFT, aside);
    }

    #[test]
    fn an_area_that_is_over_before_the_vehicle_could_be_out_is_not_left() {
        #[track_caller]
        fn check(ends_s: [Option<i64>; 2], expected: Leaving) {
            let areas = ends_s.map(|ends_s| Area {
                until_utc_ms: ends_s.map(|it| 1_000_000 + it * 1000),
                ceiling_m: None,
                ..square(AreaKind::KeepOut)
            });
            let grants = Grants::new();
            let found = leaving(at(0.0, 170.0, 10.0), &airspace(&areas, &grants), &LIMITS);
            assert_eq!(found, expected, "{ends_s:?}");
        }
        let (out, way) = (Leaving::Flies(vec![at(0.0, 80.0, 10.0)]), Duration::from_secs(9));
        check([None, None], out.clone());
        check([Some(10), Some(5)], out.clone());
        check([Some(8), None], out);
        check([Some(9), Some(5)], Leaving::Stays { ends: Duration::from_secs(9), way });
        check([Some(0), Some(0)], Leaving::Flies(Vec::new()));
    }

    #[test]
    fn a_way_does_not_begin_by_leaving_what_is_over_before() {
        let over = Area { until_utc_ms: Some(1_005_000), ceiling_m: None, ..square(AreaKind::KeepOut) };
        check_way(std::slice::from_ref(&over), at(0.0, 200.0, 15.0), None);
    }

    #[test]
    fn out_comes_first_and_then_the_way() {
        let endless = Area { ceiling_m: None, ..square(AreaKind::Permission) };
        check_way(
            &[endless],
            at(0.0, 270.0, 15.0),
            Some(&[(0.0, 320.0, 15.0), (100.0, 310.0, 15.0), (100.0, 90.0, 15.0), (0.0, 0.0, 15.0)]),
        );
    }

    /// A wall is all around it: there is no way out.
    #[test]
    fn to_ask_for_the_area_around_the_vehicle_it_need_not_be_left_first() {
        let endless = |it: Area| Area { floor_m: None, ceiling_m: None, ..it };
        let port = area("P", AreaKind::Permission, &[(-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0)]);
        let wall = area("W", AreaKind::KeepOut, &[(-900.0, -900.0), (900.0, -900.0), (900.0, 900.0), (-900.0, 900.0)]);
        let wall = Area { holes: vec![port.corners.clone()], ..wall };
        let (areas, grants) = ([endless(port), endless(wall)], Grants::new());
        let map = AreaMap::new(&areas);
        let around = Surroundings {
            airspace: airspace(&areas, &grants),
            map: &map,
            limits: &LIMITS,
            ends_at: SiteKind::Landing,
        };
        let from = at(0.0, 20.0, 15.0);
        assert_eq!(around.way_within(from, Ned::default(), MOST_LEGS).way, None);
        let found = around.way_if_granted(from, Ned::default(), MOST_LEGS).way.expect("there is a way");
        assert_eq!((rounded(Some(found.points)), found.needs), (Some(vec![(0.0, 0.0, 15.0)]), ["P".to_owned()].into()));
    }

    #[test]
    fn there_is_no_way_to_a_place_inside() {
        let home = area("H", AreaKind::KeepOut, &[(-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0)]);
        check_way(&[Area { ceiling_m: Some(5.0), ..home }], at(0.0, 400.0, 15.0), None);
    }

    #[test]
    fn only_the_first_and_last_metres_may_be_near_a_border() {
        let square = square(AreaKind::KeepOut);
        let clear = |from: Ned, to: Ned| keeps_clear(&square, from, to, 10.0, Exempt { start: true, end: true });
        // Along the border 4 m from it, the whole side long.
        assert!(!clear(at(94.0, 100.0, 10.0), at(94.0, 300.0, 10.0)));
        assert!(clear(at(94.0, 100.0, 10.0), at(104.0, 100.0, 10.0)), "straight away from it");
        let from = at(94.0, 200.0, 10.0);
        assert_eq!(rounded(Some(footholds(from, &[&square], 10.0))).unwrap(), [(100.0, 200.0, 10.0)]);
        check_way(
            &[Area { ceiling_m: None, ..square }],
            at(94.0, 290.0, 15.0),
            Some(&[(100.0, 290.0, 15.0), (100.0, 90.0, 15.0), (0.0, 0.0, 15.0)]),
        );
    }
}
