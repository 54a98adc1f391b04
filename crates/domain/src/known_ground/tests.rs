//! The rule as tables of cases, and the ways that are found by it.

use super::*;
use crate::airspace::Grants;
use crate::airspace::tests::{airspace, area};
use crate::area::AreaKind;
use crate::area_map::AreaMap;
use crate::site::SiteKind;
use crate::speeds::Speeds;
use crate::way::{MOST_LEGS, Surroundings};

const LIMITS: FlightLimits = FlightLimits {
    speeds: Speeds::calm(10.0, 3.0, 1.5),
    least_height_m: 5.0,
    return_height_m: 15.0,
    highest_m: 120.0,
    clearance_m: 20.0,
    margin_m: 10.0,
    height_clearance_m: 2.0,
};

fn at(north: f64, east: f64, height: f64) -> Ned {
    Ned::new(north, east, -height)
}

/// A deck 400 m east, at 60 m; a valley 800 m east, at -40 m.
fn known() -> KnownGround {
    KnownGround::of(&[], [at(0.0, 400.0, 60.0), at(0.0, 800.0, -40.0)])
}

#[test]
fn a_place_says_how_high_the_ground_is_around_it() {
    #[track_caller]
    fn check(place: Ned, ground_m: f64, clear_m: f64) {
        let known = known();
        assert_eq!((known.height_m(place), known.clear_m(place, &LIMITS)), (ground_m, clear_m), "{place}");
    }
    check(at(0.0, 0.0, 0.0), 0.0, 5.0);
    check(at(30.0, 400.0, 0.0), 60.0, 65.0);
    check(at(60.0, 400.0, 0.0), 0.0, 5.0);
    check(at(0.0, 790.0, 0.0), -40.0, -35.0);
}

#[test]
fn where_the_vehicle_stood_the_ground_is_known() {
    let mut known = known();
    for place in [at(300.0, 0.0, 25.0), at(300.0, 3.0, 25.4), at(3.0, 400.0, 60.2)] {
        known.measure(place);
    }
    assert_eq!(known.measured, [at(300.0, 0.0, 25.0)]);
    assert_eq!(known.clear_m(at(310.0, 0.0, 0.0), &LIMITS), 30.0);
    (0..40).for_each(|it| known.measure(at(300.0, 20.0 * f64::from(it), 0.0)));
    assert_eq!(known.measured.len(), MOST_MEASURED);
}

#[test]
fn a_place_is_approached_by_the_height_of_returns_over_it_and_lower_from_near() {
    #[track_caller]
    fn check(from: Ned, place: Ned, expected_m: f64) {
        assert_eq!(known().approach_m(from, place, &LIMITS), expected_m, "from {from} to {place}");
    }
    let (home, deck, valley) = (Ned::default(), at(0.0, 400.0, 60.0), at(0.0, 800.0, -40.0));
    check(at(0.0, 100.0, 10.0), home, 15.0);
    check(at(0.0, 100.0, 40.0), home, 40.0);
    // Over the pad there is nothing to climb for.
    check(at(0.0, 1.0, 6.0), home, 6.0);
    check(at(0.0, 9.0, 6.0), home, 9.0);
    check(at(0.0, 100.0, 10.0), deck, 75.0);
    check(at(0.0, 360.0, 10.0), home, 65.0);
    // What is lower than the take-off point is come to over the ground between.
    check(at(0.0, 100.0, 10.0), valley, 10.0);
    check(at(0.0, 100.0, 2.0), valley, 5.0);
    check(at(0.0, 800.0, -30.0), home, 15.0);
    // Never higher than a flight may be, but clear of the ground.
    check(at(0.0, 100.0, 10.0), at(0.0, 400.0, 110.0), 120.0);
    check(at(0.0, 100.0, 10.0), at(0.0, 400.0, 117.0), 122.0);
}

#[test]
fn a_way_is_too_low_under_the_ground_of_a_place_and_between_places() {
    #[track_caller]
    fn check(from: Ned, to: Ned, expected: Option<&str>) {
        assert_eq!(known().why_too_low((from, to), &LIMITS).as_deref(), expected, "from {from} to {to}");
    }
    let low = "its way would be 20 m high over the ground at (0, 400, 60), expected at least 65 m";
    check(at(0.0, 0.0, 20.0), at(0.0, 700.0, 20.0), Some(low));
    check(at(0.0, 0.0, 20.0), at(0.0, 400.0, 70.0), Some(low));
    check(at(60.0, 0.0, 20.0), at(60.0, 700.0, 20.0), None);
    check(at(0.0, 0.0, 64.0), at(0.0, 700.0, 64.0), None);
    // Straight up and down.
    check(at(0.0, 400.0, 61.0), at(0.0, 400.5, 75.0), None);
    // As low as a place in flight that somebody has named.
    check(at(0.0, 100.0, 20.0), at(0.0, 300.0, 3.0), None);
    check(at(0.0, 100.0, 2.0), at(0.0, 300.0, 20.0), Some("its way would be 2 m high, expected at least 5 m"));
    // In the valley, and up from there.
    check(at(0.0, 770.0, -35.0), at(0.0, 830.0, -35.0), None);
    check(at(0.0, 800.0, -30.0), at(0.0, 900.0, 10.0), Some("its way would be -30 m high, expected at least 5 m"));
}

/// The way without a plan to `to`, where it lands, in whole metres.
#[track_caller]
fn check_way(from: Ned, to: Ned, expected: &[(f64, f64, f64)]) {
    let (known, grants, map) = (known(), Grants::new(), AreaMap::new(&[]));
    let airspace = Airspace { ground: &known, ..airspace(&[], &grants) };
    let way = Surroundings { airspace, map: &map, limits: &LIMITS, ends_at: SiteKind::Landing }
        .way_within(from, to, MOST_LEGS)
        .way;
    let rounded = |it: Ned| (it.north_m.round() + 0.0, it.east_m.round() + 0.0, it.height_m().round());
    let way: Option<Vec<_>> = way.map(|way| way.into_iter().map(rounded).collect());
    assert_eq!(way.as_deref(), Some(expected), "from {from} to {to}");
}

#[test]
fn a_way_to_land_is_over_the_ground_of_its_place_before_it_is_there() {
    check_way(at(0.0, 100.0, 20.0), at(0.0, 400.0, 60.0), &[(0.0, 100.0, 75.0), (0.0, 400.0, 75.0)]);
    check_way(at(0.0, 400.0, 66.0), Ned::default(), &[(0.0, 0.0, 66.0)]);
    // Into the valley and up from there.
    check_way(at(60.0, 600.0, 10.0), at(0.0, 800.0, -40.0), &[(0.0, 800.0, 10.0)]);
    check_way(at(0.0, 800.0, -30.0), at(60.0, 600.0, 0.0), &[(0.0, 800.0, 15.0), (60.0, 600.0, 15.0)]);
    // Past the deck, round it.
    check_way(
        at(40.0, 600.0, 20.0),
        at(40.0, 0.0, 0.0),
        &[(51.0, 451.0, 20.0), (51.0, 349.0, 20.0), (40.0, 0.0, 20.0)],
    );
    // From beside it, up first.
    check_way(at(0.0, 440.0, 30.0), Ned::default(), &[(0.0, 440.0, 65.0), (0.0, 0.0, 65.0)]);
}

#[test]
fn a_takeoff_ends_under_an_area_that_is_closed_if_that_is_clear_of_the_ground() {
    #[track_caller]
    fn check(floor_m: f64, place: Ned, expected_m: f64) {
        let corners = [(-90.0, -90.0), (90.0, -90.0), (90.0, 90.0), (-90.0, 90.0)];
        let roof = Area { floor_m: Some(floor_m), ..area("R", AreaKind::KeepOut, &corners) };
        let (areas, grants) = ([roof], Grants::new());
        let found_m = climb_m(place, 10.0, &airspace(&areas, &grants), &LIMITS);
        assert_eq!(found_m, expected_m, "under {floor_m} m at {place}");
    }
    check(13.0, Ned::default(), 10.0);
    check(11.0, Ned::default(), 7.0);
    check(9.0, Ned::default(), 5.0);
    // Lower there is no room for a flight.
    check(8.0, Ned::default(), 10.0);
    check(11.0, at(0.0, 100.0, 0.0), 10.0);
    check(71.0, at(0.0, 50.0, 60.0), 7.0);
    check(50.0, at(0.0, 50.0, 60.0), 10.0);
}
