//! The way that is found costs as much as one that is searched among everything, and is found among hundreds of areas.

use std::f64::consts::TAU;

use proptest::prelude::*;

use super::*;
use crate::airspace::{Clock, Grants, is_at_heights, stays};
use crate::area::AreaKind;
use crate::energy::Wind;
use crate::known_ground::LEVEL;
use crate::speeds::Speeds;
use crate::time::Pace;
use crate::way::{Exempt, keeps_clear};

mod brute_force;
mod holes;
mod kept;
mod landings;

const LIMITS: FlightLimits = FlightLimits {
    speeds: Speeds { airspeed_m_s: 15.0, ..Speeds::calm(10.0, 3.0, 1.5) },
    least_height_m: 5.0,
    return_height_m: 15.0,
    highest_m: 120.0,
    clearance_m: 20.0,
    margin_m: 10.0,
    height_clearance_m: 2.0,
};

const CLOCK: Clock = Clock { utc_ms: 1_000_000, pace: Pace::REAL_TIME };

/// Through the air, at once.
fn trip(from: Ned, to: Ned) -> Trip {
    Trip { from, to, begins: Duration::ZERO, lands_from_m: None }
}

/// Permission areas are asked for.
fn entries(areas: &[Area]) -> Vec<Entry> {
    let entry = |it: &Area| match it.kind {
        AreaKind::Permission => Entry::Ask { wait_s: 2.0 },
        AreaKind::KeepOut => Entry::Closed,
    };
    areas.iter().map(entry).collect()
}

/// A regular polygon with rounded-off regularity: each corner at a distance of its own.
fn area(index: usize, kind: AreaKind, centre: (f64, f64), radius_m: f64, corners: usize) -> Area {
    let corner = |corner: usize| {
        let angle = TAU * corner as f64 / corners as f64;
        let distance_m = radius_m * (1.0 - 0.2 * ((corner * 7 + index) % 3) as f64 / 2.0);
        Ned::new(centre.0 + distance_m * angle.cos(), centre.1 + distance_m * angle.sin(), 0.0)
    };
    Area::new(format!("area {index}"), kind, (0..corners).map(corner).collect())
}

/// Searches among these areas, and hands over the obstacles.
fn among<T>(areas: &[Area], from: Ned, to: Ned, search: impl FnOnce(&Obstacles) -> T) -> T {
    among_keeping(0, areas, from, to, search)
}

/// The same for ways that keep this part of the margin.
fn among_keeping<T>(part: usize, areas: &[Area], from: Ned, to: Ned, search: impl FnOnce(&Obstacles) -> T) -> T {
    among_in_wind(Wind::CALM, part, areas, trip(from, to), search)
}

/// The same in a wind.
fn among_in_wind<T>(wind: Wind, part: usize, areas: &[Area], trip: Trip, search: impl FnOnce(&Obstacles) -> T) -> T {
    let (grants, asked, map) = (Grants::new(), Asked::new(), AreaMap::new(areas));
    let limits = &FlightLimits { speeds: Speeds { wind, ..LIMITS.speeds }, ..LIMITS };
    let (entries, legs_left) = (&*entries(areas), &Cell::new(u32::MAX));
    let rule = Airspace {
        areas,
        grants: &grants,
        clock: CLOCK,
        lead: Duration::from_secs(30),
        vertical_margin_m: 2.0,
        ground: &LEVEL,
    };
    let among = Among { rule, map: &map, entries, asked: &asked, limits, legs_left };
    search(&Obstacles::new(trip, part, among))
}

/// Whether the leg enters an area of which `is_counted`, or passes one nearer than the margin: looked at area by area, without any map.
fn is_barred(obstacles: &Obstacles, here: Ned, there: Ned, exempt: Exempt, is_counted: impl Fn(&Area) -> bool) -> bool {
    let (vertical_m, kept_m) = (obstacles.among.rule.vertical_margin_m, KEPT * obstacles.margin_m);
    let is_touched = |area: &Area| {
        let is_near = is_at_heights(area, here, there, vertical_m) && !keeps_clear(area, here, there, kept_m, exempt);
        is_near || !stays(area, here, there, vertical_m).is_empty()
    };
    obstacles.all().map(|it| obstacles.area(it)).any(|it| is_counted(it) && is_touched(it))
}

/// When the vehicle is there.
fn takes_s(way: &TimedWay) -> f64 {
    way.at.last().map_or(0.0, Duration::as_secs_f64)
}

fn is_keep_out(area: &Area) -> bool {
    area.kind == AreaKind::KeepOut
}

/// Some have a hole, and some are so large that both ends of a way may lie in it.
fn any_area(index: usize) -> impl Strategy<Value = Area> {
    let kind = prop_oneof![Just(AreaKind::KeepOut), Just(AreaKind::Permission)];
    let radius_m = prop_oneof![4 => 20.0..150.0, 1 => 300.0..800.0];
    let hole = proptest::option::weighted(0.4, 0.3..0.95);
    (kind, (-400.0..400.0, -400.0..400.0), radius_m, 3..9usize, hole).prop_map(
        move |(kind, centre, radius_m, corners, hole)| {
            // The large ones are passed by a way only if they have a hole.
            let hole = hole.or((150.0 < radius_m).then_some(0.8));
            let ring = |part: f64| area(index, kind, centre, part * radius_m, corners).corners;
            Area { holes: hole.into_iter().map(ring).collect(), ..area(index, kind, centre, radius_m, corners) }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn among_few_areas_the_way_is_the_cheapest_and_a_search_by_tangents_keeps_its_margins(
        areas in (0..7usize).prop_flat_map(|count| (0..count).map(any_area).collect::<Vec<_>>()),
        from in (-500.0..500.0, -500.0..500.0),
        to in (-500.0..500.0, -500.0..500.0),
    ) {
        let (from, to) = (Ned::new(from.0, from.1, -10.0), Ned::new(to.0, to.1, -10.0));
        among(&areas, from, to, |obstacles| {
            let search = |effort| Graph::new(obstacles, effort).search();
            let any = |most_legs| search(Effort { turns: Turns::Any, factor: 1.0, most_legs });
            let best = any(u32::MAX);
            prop_assert_eq!(cheapest(obstacles).ok(), best.clone().ok());
            let taut = search(Effort { turns: Turns::Taut, factor: 1.0, most_legs: u32::MAX });
            for way in taut.iter() {
                // A leg more costs a millisecond.
                let best_s = best.as_ref().map(takes_s).expect("there is a way");
                prop_assert!(best_s < takes_s(way) + 0.02, "{way:?}");
                for (index, leg) in way.points.windows(2).enumerate() {
                    let exempt = Exempt { start: index == 0, end: index == way.points.len() - 2 };
                    prop_assert!(!is_barred(obstacles, leg[0], leg[1], exempt, is_keep_out), "{way:?}");
                }
            }
            Ok(())
        })?;
    }
}

/// With a floor, a ceiling, both or none.
fn any_volume(index: usize) -> impl Strategy<Value = Area> {
    let height_m = || proptest::option::of(0.0..130.0);
    (any_area(index), height_m(), height_m()).prop_map(|(area, a_m, b_m)| {
        let (floor_m, ceiling_m) = match (a_m, b_m) {
            (Some(a_m), Some(b_m)) => (Some(f64::min(a_m, b_m)), Some(f64::max(a_m, b_m))),
            either => either,
        };
        Area { floor_m, ceiling_m, ..area }
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn over_and_under_no_way_costs_more_than_round_and_none_leads_through(
        volumes in (0..6usize).prop_flat_map(|count| (0..count).map(any_volume).collect::<Vec<_>>()),
        from in (-500.0..500.0, -500.0..500.0, 5.0..60.0),
        to in (-500.0..500.0, -500.0..500.0, 5.0..60.0),
    ) {
        /// A turn at the corner of an area that is not in the way at any height of the search is not tried.
        const FACTOR: f64 = 1.5;
        let at = |(north_m, east_m, height_m): (f64, f64, f64)| Ned::new(north_m, east_m, -height_m);
        let (from, to) = (at(from), at(to));
        let columns: Vec<Area> =
            volumes.iter().map(|it| Area { floor_m: None, ceiling_m: None, ..it.clone() }).collect();
        let round_s = among(&columns, from, to, |obstacles| cheapest(obstacles).as_ref().ok().map(takes_s));
        among(&volumes, from, to, |obstacles| {
            let way = cheapest(obstacles);
            if let Some(round_s) = round_s {
                let found_s = way.as_ref().map(takes_s).expect("there is a way round");
                prop_assert!(found_s <= FACTOR * round_s + 0.1, "{found_s} s, and {round_s} s round: {way:?}");
            }
            let legs = way.iter().flat_map(|it| it.points.windows(2));
            for (here, there) in legs.map(|it| (it[0], it[1])) {
                let exempt = Exempt { start: here == from, end: there == to };
                prop_assert!(!is_barred(obstacles, here, there, exempt, is_keep_out), "{way:?}");
                prop_assert!(there.height_m() == to.height_m() || there.height_m() == from.height_m() || LIMITS.permits(there.height_m()));
            }
            Ok(())
        })?;
    }
}

#[test]
fn a_way_is_found_among_a_hundred_areas_of_a_hundred_corners() {
    let keep_out = |index: usize| {
        let (row, column) = (index / 10, index % 10);
        let offset = if row.is_multiple_of(2) { 0.0 } else { 150.0 };
        area(index, AreaKind::KeepOut, (300.0 * row as f64, 300.0 * column as f64 + offset), 110.0, 100)
    };
    let areas: Vec<Area> = (0..100).map(keep_out).collect();
    let (from, to) = (Ned::new(-300.0, -300.0, -10.0), Ned::new(3100.0, 3200.0, -10.0));
    among(&areas, from, to, |obstacles| {
        let way = cheapest(obstacles).expect("there is a way").points;
        let touches =
            |ends: &[Ned]| is_barred(obstacles, ends[0], ends[1], Exempt { start: false, end: false }, |_| true);
        assert!(!way.windows(2).any(touches), "{way:?}");
        let flown_m: f64 = way.windows(2).map(|it| it[0].distance_m(it[1])).sum();
        assert!(flown_m < 1.2 * from.distance_m(to), "{flown_m}");
    });
}

#[test]
fn among_many_corners_no_effort_is_spent_on_the_exact_search() {
    #[track_caller]
    fn check(areas: usize, corners: usize, expected: &[f64]) {
        let circle = |it: usize| area(it, AreaKind::KeepOut, (0.0, 300.0 * it as f64), 100.0, corners);
        let areas: Vec<Area> = (0..areas).map(circle).collect();
        let factors: Vec<f64> = Effort::among(areas.iter()).iter().map(|it| it.factor).collect();
        assert_eq!(factors, expected);
    }
    check(5, 20, &[1.0, 1.0, 1.1, 1.1]);
    check(50, 100, &[1.0, 1.1, 1.1]);
    check(51, 100, &[1.1, 1.1]);
}

/// The points of the way among these areas, in whole metres.
fn way_among(areas: &[Area], from: Ned, to: Ned) -> Vec<(f64, f64, f64)> {
    among(areas, from, to, |obstacles| rounded(&cheapest(obstacles).expect("there is a way").points))
}

fn rounded(way: &[Ned]) -> Vec<(f64, f64, f64)> {
    way.iter().map(|it| (it.north_m.round() + 0.0, it.east_m.round() + 0.0, it.height_m().round())).collect()
}

/// From 100 m to 300 m east, to this far north and farther to the south, between these heights.
fn block(north_m: f64, floor_m: Option<f64>, ceiling_m: Option<f64>) -> Area {
    let corners = [(-north_m - 50.0, 100.0), (north_m, 100.0), (north_m, 300.0), (-north_m - 50.0, 300.0)];
    let corners = corners.map(|(north, east)| Ned::new(north, east, 0.0)).to_vec();
    Area { corners, floor_m, ceiling_m, ..area(0, AreaKind::KeepOut, (0.0, 0.0), 1.0, 3) }
}

#[test]
fn a_way_leads_over_under_or_round_whatever_takes_the_least_time() {
    #[track_caller]
    fn check(areas: &[Area], height_m: f64, expected: &[(f64, f64, f64)]) {
        let (from, to) = (Ned::new(0.0, 0.0, -height_m), Ned::new(0.0, 400.0, -height_m));
        assert_eq!(way_among(areas, from, to)[1..], *expected);
    }
    let end = |height_m| (0.0, 400.0, height_m);
    check(&[block(400.0, None, Some(40.0))], 10.0, &[(0.0, 90.0, 44.0), (0.0, 310.0, 44.0), end(10.0)]);
    check(&[block(150.0, None, Some(100.0))], 10.0, &[(160.0, 90.0, 10.0), (160.0, 310.0, 10.0), end(10.0)]);
    check(&[block(400.0, Some(50.0), None)], 60.0, &[(0.0, 90.0, 46.0), (0.0, 310.0, 46.0), end(60.0)]);
    // Over it the vehicle would fly higher than it may; under it, lower.
    let round = [(410.0, 90.0, 10.0), (410.0, 310.0, 10.0), end(10.0)];
    check(&[block(400.0, None, Some(117.0))], 10.0, &round);
    check(&[block(400.0, Some(8.0), None)], 10.0, &round);
    // One area is over the other.
    let both = [block(400.0, None, Some(40.0)), block(400.0, Some(60.0), None)];
    check(&both, 10.0, &[(0.0, 90.0, 44.0), (0.0, 310.0, 44.0), end(10.0)]);
    let no_gap = [block(400.0, None, Some(40.0)), block(400.0, Some(45.0), None)];
    check(&no_gap, 10.0, &round);
}

#[test]
fn over_is_flown_where_there_is_no_way_round() {
    // Four walls round the goal.
    let wall = |corners: [(f64, f64); 4]| Area {
        corners: corners.map(|(north, east)| Ned::new(north, east, 0.0)).to_vec(),
        ..block(1.0, None, Some(100.0))
    };
    let walls = [
        wall([(-500.0, 100.0), (500.0, 100.0), (500.0, 120.0), (-500.0, 120.0)]),
        wall([(-500.0, 600.0), (500.0, 600.0), (500.0, 620.0), (-500.0, 620.0)]),
        wall([(480.0, 90.0), (500.0, 90.0), (500.0, 630.0), (480.0, 630.0)]),
        wall([(-500.0, 90.0), (-480.0, 90.0), (-480.0, 630.0), (-500.0, 630.0)]),
    ];
    let way = way_among(&walls, Ned::new(0.0, 0.0, -10.0), Ned::new(0.0, 400.0, -10.0));
    assert!(way.contains(&(0.0, 90.0, 104.0)) && way.contains(&(0.0, 130.0, 104.0)), "{way:?}");
}
