//! Areas of every shape, height and time.

use domain::airspace::Grants;
use domain::area_map::AreaMap;
use domain::geometry::Ned;
use domain::way::Asked;

use super::*;
use crate::airspace::{Airspace, Around, Closures};
use crate::permissions::Permissions;
use crate::routing::{self, NoWay};

#[test]
fn borders_closer_than_the_stand_off_share_one_step() {
    let areas = area("A", "permission", [200.0, 300.0], "") + &area("B", "permission", [215.0, 320.0], "");
    check(
        &Story::of(&across(&areas)).plan(),
        "1 takeoff 10 m
         2 position 0 180 10, hold, ask A B
         3 position 0 500 10, needs A B
         4 land",
    );
}

#[test]
fn a_concave_area_is_asked_for_once_however_often_it_is_crossed() {
    check(
        &Story::of(HARBOUR).plan(),
        "1 takeoff 10 m
         2 position 0 60 10, hold, ask basin
         3 position 0 400 10, hold, ask fairway terminal, needs basin
         4 position 0 600 10, needs fairway terminal
         5 land, needs terminal",
    );
}

#[test]
fn a_keep_out_area_is_flown_round_on_the_shorter_side() {
    let mut story = Story::of(KEEP_OUT);
    check(
        &story.plan(),
        "1 takeoff 25 m
         2 position 90 -70 25
         3 position 210 -70 25
         4 position 300 0 25",
    );
    story.fly(4);
    check(
        &story.plan(),
        "5 position 210 -70 10
         6 position 90 -70 10
         7 position 0 0 10
         8 land",
    );
}

/// A hundred small areas side by side, every third to be asked for: a plan that tried what asking for each set of them costs
/// would never be made.
#[test]
fn a_way_through_a_crowd_of_areas_is_found() {
    let one = |number: i32| {
        let kind = if number % 3 == 0 { "permission" } else { "keep-out" };
        let (south, west) = (f64::from(number * 37 % 400 - 200), f64::from(60 + number * 4));
        let (north, east) = (south + 30.0, west + 4.0);
        format!(
            "[[area]]\nname = \"a{number}\"\nkind = \"{kind}\"\n\
             corners_m = [[{south}.0, {west}.0], [{north}.0, {west}.0], [{north}.0, {east}.0], [{south}.0, {east}.0]]\n"
        )
    };
    let crowd: String = (0..100).map(one).collect();
    let plan = Story::of(&across(&crowd)).plan();
    assert!(plan.starts_with("1 takeoff 10 m\n") && plan.ends_with("land\n"), "{plan}");
}

/// A search that has used up its legs has not shown that there is no way.
#[test]
fn a_way_that_takes_too_long_to_find_is_told_as_that() {
    let areas = mission(&across(&area("K", "keep-out", [200.0, 300.0], ""))).areas;
    let around = Around { map: AreaMap::new(&areas), ..Around::default() };
    let (grants, rules) = (Grants::new(), Rules::for_tests());
    let now = (Now { time: Time::ZERO, utc_ms: UTC_START_MS }, Pace::REAL_TIME);
    let found = |legs: u32| {
        let (permissions, closures) = (Permissions::default(), Closures::new());
        let airspace = Airspace::new((&areas, &around), &grants, &permissions, &closures, now, &rules);
        airspace.legs_left.set(legs);
        let (from, to) = (Ned::new(0.0, 0.0, -10.0), Ned::new(0.0, 500.0, -10.0));
        routing::find(from, to, Duration::ZERO, &airspace, &Asked::new(), &rules).map(|it| it.points.len())
    };
    assert_eq!(found(u32::MAX), Ok(4), "round two corners");
    let told = "no way was found: too many areas are in the way, or they have too many corners";
    for legs in [0, 1, 2] {
        assert_eq!(found(legs), Err(NoWay(told.into())), "{legs} legs");
    }
}

#[test]
fn a_goal_in_a_keep_out_area_is_given_up_with_the_reason() {
    let window = "until_utc = \"2027-01-01T00:00:00Z\"";
    let mut story = Story::of(&across(&area("K", "keep-out", [400.0, 600.0], window)));
    check(&story.plan(), "finished");
    check(
        &story.objectives(),
        "there: failure (keep-out area K: it cannot be reached without entering it), 0 steps, 0 replans, asked []",
    );
}

#[test]
fn only_the_heights_that_are_flown_count() {
    let mut story = Story::of(ALTITUDE_BAND);
    check(
        &story.plan(),
        "1 takeoff 20 m
         2 position 0 200 20",
    );
    story.fly(2);
    check(
        &story.plan(),
        "3 position 0 200 20, hold, ask approach
         4 position 0 400 80, needs approach",
    );
}

#[test]
fn an_area_counts_if_it_applies_when_it_is_flown_through() {
    #[track_caller]
    fn check_window(window: &str, expected_asked: bool) {
        let mut story = Story::of(&across(&area("A", "permission", [200.0, 300.0], window)));
        assert_eq!(story.plan().contains("ask A"), expected_asked, "{window}");
    }
    // It is entered after 23 s and left after 33 s, as planned.
    check_window("until_utc = \"2025-12-31T23:59:00Z\"", false);
    check_window("until_utc = \"2026-01-01T00:00:15Z\"", false);
    check_window("until_utc = \"2026-01-01T00:00:22Z\"", true);
    check_window("from_utc = \"2026-01-01T00:00:40Z\"", true);
    check_window("from_utc = \"2026-01-01T00:04:00Z\"", false);
}

#[test]
fn a_keep_out_area_that_opens_on_the_way_is_flown_round() {
    let wall = "[[area]]\nname = \"K\"\nkind = \"keep-out\"\n\
                from_utc = \"2026-01-01T00:01:00Z\"\n\
                corners_m = [[-90.0, 2000.0], [90.0, 2000.0], [90.0, 2100.0], [-90.0, 2100.0]]\n";
    let far = across(wall).replace("east_m = 500", "east_m = 3000");
    check(
        &Story::of(&far).plan(),
        "1 takeoff 10 m
         2 position 100 1990 10
         3 position 100 2110 10
         4 position 0 3000 10
         5 land",
    );
    // Gone through before it opens.
    let late = far.replace("00:01:00Z", "00:06:00Z");
    check(
        &Story::of(&late).plan(),
        "1 takeoff 10 m
         2 position 0 3000 10
         3 land",
    );
}

#[test]
fn a_permission_for_a_landing_is_asked_for_in_a_stop() {
    check(
        &Story::of(&across(&area("low", "permission", [400.0, 600.0], "ceiling_m = 5.0"))).plan(),
        "1 takeoff 10 m
         2 position 0 500 10
         3 stop, ask low
         4 land, needs low",
    );
}

#[test]
fn a_permission_for_a_takeoff_is_asked_for_on_the_ground() {
    check(
        &Story::of(&across(&area("high", "permission", [-100.0, 100.0], "floor_m = 5.0"))).plan(),
        "1 stop, ask high
         2 takeoff 10 m, needs high
         3 position 0 500 10, needs high
         4 land",
    );
}

#[test]
fn leaving_needs_no_permission_but_is_done_the_quickest_way() {
    let mut story = Story::of(&across(&area("A", "permission", [-100.0, 60.0], "")));
    story.airborne_at([0.0, 0.0, 10.0]);
    check(
        &story.plan(),
        "1 position 0 80 10
         2 position 0 500 10
         3 land",
    );
    let mut story = Story::of(&across(&area("A", "permission", [-100.0, 60.0], "ceiling_m = 12.0")));
    story.airborne_at([0.0, 0.0, 10.0]);
    check(
        &story.plan(),
        "1 position 0 0 15
         2 position 0 70 15
         3 position 0 500 10
         4 land",
    );
}

#[test]
fn lifting_off_inside_an_area_is_entering_it() {
    check(
        &Story::of(&across(&area("A", "permission", [-100.0, 60.0], ""))).plan(),
        "1 stop, ask A
         2 takeoff 10 m, needs A
         3 position 0 500 10, needs A
         4 land",
    );
    let mut story = Story::of(&across(&area("A", "permission", [-100.0, 60.0], "")));
    story.plan();
    check(&story.fail(&[("A", None)]), "finished");
    check(
        &story.objectives(),
        "there: failure (area A: no answer from the control tower), 4 steps, 0 replans, asked [A]",
    );
    let closed = area("K", "keep-out", [-100.0, 60.0], "until_utc = \"2026-01-01T00:10:00Z\"");
    check(&Story::of(&across(&closed)).plan(), "finished");
}

#[test]
fn a_way_along_a_border_keeps_its_margin_but_for_its_ends() {
    // The start and the goal are 4 m from the border, which the straight way would follow all along.
    let beside = "[[area]]\nname = \"K\"\nkind = \"keep-out\"\n\
                  corners_m = [[4.0, -50.0], [90.0, -50.0], [90.0, 550.0], [4.0, 550.0]]\n\
                  until_utc = \"2027-01-01T00:00:00Z\"\n";
    check(
        &Story::of(&across(beside)).plan(),
        "1 takeoff 10 m
         2 position -6 0 10
         3 position -6 500 10
         4 position 0 500 10
         5 land",
    );
}

#[test]
fn twenty_permissions_are_asked_for_at_one_wait() {
    let areas: String = (0..20).map(|it| area(&format!("A{it}"), "permission", [200.0, 700.0], "")).collect();
    let mut story = Story::of(&across(&areas));
    story.plan();
    assert_eq!(story.steps[1].ask_permissions.len(), 20);
}

#[test]
fn borders_right_behind_a_way_out_share_its_end() {
    let areas = area("A", "permission", [-100.0, 60.0], "")
        + &area("B", "permission", [80.2, 90.0], "")
        + &area("C", "permission", [100.5, 200.0], "");
    let mut story = Story::of(&across(&areas));
    story.airborne_at([0.0, 0.0, 10.0]);
    check(
        &story.plan(),
        "1 position 0 80 10, hold, ask B C
         2 position 0 500 10, needs B C
         3 land",
    );
}

#[test]
fn a_vehicle_nearer_to_the_border_than_the_stand_off_asks_where_it_is() {
    check(
        &Story::of(&across(&area("A", "permission", [12.0, 300.0], ""))).plan(),
        "1 takeoff 10 m
         2 position 0 0 10, hold, ask A
         3 position 0 500 10, needs A
         4 land",
    );
}

#[test]
fn a_gap_narrower_than_two_margins_is_still_a_way() {
    // A yard round the goal, with a gate of 12 m towards the start.
    let wall = |name: &str, north: [f64; 2], east: [f64; 2]| {
        format!(
            "[[area]]\nname = \"{name}\"\nkind = \"keep-out\"\n\
             corners_m = [[{0:.1}, {2:.1}], [{1:.1}, {2:.1}], [{1:.1}, {3:.1}], [{0:.1}, {3:.1}]]\n",
            north[0], north[1], east[0], east[1]
        )
    };
    let yard = wall("north", [90.0, 100.0], [400.0, 600.0])
        + &wall("south", [-100.0, -90.0], [400.0, 600.0])
        + &wall("east", [-100.0, 100.0], [600.0, 610.0])
        + &wall("left of the gate", [6.0, 100.0], [390.0, 400.0])
        + &wall("right of the gate", [-100.0, -6.0], [390.0, 400.0]);
    check(
        &Story::of(&across(&yard)).plan(),
        "1 takeoff 10 m
         2 position 0 500 10
         3 land",
    );
}

#[test]
fn a_goal_that_is_closed_for_two_minutes_at_most_is_waited_for() {
    #[track_caller]
    fn check_closed(until_utc: &str, from: Option<[f64; 3]>, expected: &str) {
        let closed = area("K", "keep-out", [450.0, 550.0], &format!("until_utc = \"2026-01-01T00:{until_utc}Z\""));
        let mut story = Story::of(&across(&closed));
        if let Some(place) = from {
            story.airborne_at(place);
        }
        check(&story.plan(), expected);
    }
    let on_the_way = Some([0.0, 400.0, 10.0]);
    let at_once = "1 takeoff 10 m\n2 position 0 500 10\n3 land";
    check_closed("01:00", None, "hold 61 s: area K is closed for 61 s more");
    check_closed("01:59", None, "hold 120 s: area K is closed for 120 s more");
    check_closed("02:00", None, "finished");
    check_closed("01:00", on_the_way, "hold 61 s: area K is closed for 61 s more");
    // Over before it could arrive.
    check_closed("00:20", None, at_once);
    // Inside the area the vehicle leaves, unless the area is over first.
    check_closed("01:00", Some([0.0, 480.0, 10.0]), "finished");
    check_closed("00:04", Some([0.0, 480.0, 10.0]), "hold 5 s: area K is closed for 5 s more");
}

#[test]
fn a_goal_that_is_closed_again_and_again_is_not_waited_for_without_end() {
    // Each opens 100 s after the one before, and closes 5 s after the next has opened.
    let closed = |number: u32| {
        let utc = |s: u32| format!("2026-01-01T00:{:02}:{:02}Z", s / 60, s % 60);
        let (from, until) = (utc(100 * number), utc(100 * number + 105));
        let window = format!("from_utc = \"{from}\"\nuntil_utc = \"{until}\"");
        area(&format!("K{number}"), "keep-out", [150.0, 250.0], &window)
    };
    let near = |areas: String| across(&areas).replace("east_m = 500", "east_m = 200");
    let story = |count: u32| Story::of(&near((0..count).map(closed).collect()));
    check(&story(5).plan(), "hold 106 s: area K0 is closed for 106 s more");
    let mut endless = story(25);
    check(&endless.plan(), "finished");
    let reason = "there: failure (not reached within the waits of a forecast)";
    assert!(endless.objectives().starts_with(reason), "{}", endless.objectives());
}
