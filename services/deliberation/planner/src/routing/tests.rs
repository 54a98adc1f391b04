//! The way that is found costs as much as one that is searched among everything, and is found among hundreds of areas.

use std::f64::consts::TAU;
use std::time::Duration;

use domain::airspace::Grants;
use domain::area::{Area, AreaKind};
use domain::time::{Now, Pace};
use domain::way::{Exempt, Turns};
use proptest::prelude::*;

use super::*;
use crate::airspace::Closures;
use crate::permissions::Permissions;

/// A regular polygon with rounded-off regularity: each corner at a distance of its own.
fn area(index: usize, kind: AreaKind, centre: (f64, f64), radius_m: f64, corners: usize) -> Area {
    let corner = |corner: usize| {
        let angle = TAU * corner as f64 / corners as f64;
        let distance_m = radius_m * (1.0 - 0.2 * ((corner * 7 + index) % 3) as f64 / 2.0);
        Ned::new(centre.0 + distance_m * angle.cos(), centre.1 + distance_m * angle.sin(), 0.0)
    };
    Area {
        name: format!("area {index}"),
        kind,
        corners: (0..corners).map(corner).collect(),
        floor_m: None,
        ceiling_m: None,
        from_utc_ms: None,
        until_utc_ms: None,
    }
}

/// Searches among these areas, and hands over the obstacles.
fn among<T>(areas: &[Area], from: Ned, to: Ned, search: impl FnOnce(&Obstacles) -> T) -> T {
    let (grants, asked, config) = (Grants::new(), Asked::new(), Config::for_tests());
    let clock = (Now::default(), Pace::REAL_TIME);
    let airspace = Airspace::new(areas, &grants, &Permissions::default(), &Closures::new(), clock, &config);
    let gave_up = Cell::new(false);
    let among = Among { airspace: &airspace, asked: &asked, open: Open::Nothing, config: &config, gave_up: &gave_up };
    search(&Obstacles::new(from, to, config.margin_m(), among))
}

fn any_area(index: usize) -> impl Strategy<Value = Area> {
    let kind = prop_oneof![Just(AreaKind::KeepOut), Just(AreaKind::Permission)];
    (kind, (-400.0..400.0, -400.0..400.0), 20.0..150.0, 3..9usize)
        .prop_map(move |(kind, centre, radius_m, corners)| area(index, kind, centre, radius_m, corners))
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
            let search = |effort| Graph::new(obstacles, Duration::ZERO, false, effort).search();
            let any = |most_legs| search(Effort { turns: Turns::Any, factor: 1.0, most_legs });
            let best = any(u32::MAX);
            prop_assert_eq!(&cheapest(obstacles, Duration::ZERO, false), &best);
            let taut = search(Effort { turns: Turns::Taut, factor: 1.0, most_legs: u32::MAX });
            for way in taut.iter().map(|it| &it.0) {
                // A leg more costs a millisecond.
                let best = best.as_ref().and_then(|it| it.0.last()).expect("there is a way").1;
                prop_assert!(best < way.last().expect("it has an end").1 + Duration::from_millis(20), "{way:?}");
                for (index, leg) in way.windows(2).enumerate() {
                    let exempt = Exempt { start: index == 0, end: index == way.len() - 2 };
                    let touched = obstacles.leg(leg[0].0, leg[1].0, exempt);
                    let is_closed = |zone: &usize| obstacles.area(*zone).kind == AreaKind::KeepOut;
                    prop_assert!(!touched.stays.iter().any(|it| is_closed(&it.0)) && !touched.near.iter().any(is_closed));
                }
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
        let way = cheapest(obstacles, Duration::ZERO, false).expect("there is a way").0;
        let touches = |ends: &[(Ned, Duration)]| {
            let leg = obstacles.leg(ends[0].0, ends[1].0, Exempt { start: false, end: false });
            !leg.near.is_empty() || !leg.stays.is_empty()
        };
        assert!(!way.windows(2).any(touches), "{way:?}");
        let flown_m: f64 = way.windows(2).map(|it| it[0].0.distance_m(it[1].0)).sum();
        assert!(flown_m < 1.2 * from.distance_m(to), "{flown_m}");
    });
}
