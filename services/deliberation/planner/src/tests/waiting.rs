//! Waiting for an area that is soon over, or flying round it: whichever arrives sooner. And the wind, which decides when an area is
//! reached.

use domain::airspace::Grants;
use domain::area::{Area, AreaKind};
use domain::geometry::Ned;
use domain::mission::Objective;
use domain::state::State;
use kittiwake_proto::v1::mission_request::Request as Ask;
use proptest::prelude::*;

use super::*;
use crate::mission_planner::{Answer, MissionPlanner, Question};
use crate::plan::flight_time_s;

/// A keep-out area across the way, that lasts until then. Straight the way takes 60 s, takeoff and landing included, and the way round it
/// to the north 95 s.
fn wall(until: &str) -> String {
    format!(
        "[[area]]\nname = \"K\"\nkind = \"keep-out\"\nuntil_utc = \"2026-01-01T00:{until}Z\"\n\
         corners_m = [[-350.0, 200.0], [300.0, 200.0], [300.0, 300.0], [-350.0, 300.0]]\n"
    )
}

const ROUND: &str = "1 takeoff 10 m\n2 position 310 190 10\n3 position 310 310 10\n4 position 0 500 10\n5 land";
const STRAIGHT: &str = "1 takeoff 10 m\n2 position 0 500 10\n3 land";

fn waits(closed_s: u32, wait_s: u32, until_s: u32, sooner_s: u32) -> String {
    format!(
        "hold {wait_s} s: area K is closed for {closed_s} s more: waits {wait_s} s, until 2026-01-01T00:00:{until_s:02}Z, \
         and arrives {sooner_s} s sooner than by the way round it"
    )
}

#[test]
fn on_the_ground_an_area_that_is_soon_over_is_waited_for() {
    #[track_caller]
    fn check_wall(until: &str, expected: &str) {
        check(&Story::of(&across(&wall(until))).plan(), expected);
    }
    // It would be reached after 23 s, which may be 19 s. It has ended by then.
    check_wall("00:18", STRAIGHT);
    check_wall("00:40", &waits(40, 22, 22, 12));
    // 96 s would be needed with the wait, and 95 s are round it.
    check_wall("00:54", ROUND);
    check_wall("10:00", ROUND);
}

#[test]
fn after_the_wait_the_way_is_free() {
    let mut story = Story::of(&across(&wall("00:40")));
    check(&story.plan(), &waits(40, 22, 22, 12));
    // A second earlier the rest is waited for.
    story.wait(21);
    assert!(story.plan().starts_with("hold 1 s: area K is closed for 19 s more"));
    story.wait(2);
    check(&story.plan(), STRAIGHT);
}

#[test]
fn in_the_air_it_is_waited_for_where_the_vehicle_is() {
    let mut story = Story::of(&across(&wall("00:40")));
    story.airborne_at([0.0, 0.0, 10.0]);
    check(&story.plan(), &waits(40, 25, 25, 10));
    // A wait of 39 s would be longer than the way round.
    let mut story = Story::of(&across(&wall("00:54")));
    story.airborne_at([0.0, 0.0, 10.0]);
    check(&story.plan(), "1 position 310 190 10\n2 position 310 310 10\n3 position 0 500 10\n4 land");
}

#[test]
fn nothing_is_waited_for_where_an_area_opens_meanwhile() {
    // It opens over the vehicle before the wait would be over, and the way round leaves it in time.
    let opens = "[[area]]\nname = \"O\"\nkind = \"keep-out\"\nfrom_utc = \"2026-01-01T00:00:50Z\"\n\
                 corners_m = [[-40.0, -40.0], [40.0, -40.0], [40.0, 40.0], [-40.0, 40.0]]\n";
    let mut story = Story::of(&across(&(wall("00:40") + opens)));
    story.airborne_at([0.0, 0.0, 10.0]);
    let plan = story.plan();
    assert!(!plan.starts_with("hold"), "{plan}");
}

#[test]
fn a_deadline_that_only_the_wait_keeps_is_kept_and_none_is_missed_for_it() {
    #[track_caller]
    fn check_deadline(within_s: f64, expected: &str) {
        let deadline = format!("flying = false\nreach_within_s = {within_s:.1}\n");
        let text = across(&wall("00:40")).replacen("flying = false\n", &deadline, 1);
        check(&Story::of(&text).plan(), expected);
    }
    // The wait and the flight take 82.3 s, the way round 94.7 s.
    check_deadline(100.0, &waits(40, 22, 22, 12));
    check_deadline(85.0, &waits(40, 22, 22, 12));
    check_deadline(80.0, "finished");
}

#[test]
fn a_permission_area_that_must_not_be_entered_is_waited_for_as_well() {
    let mut story = Story::of(&across(&wall("00:40").replace("keep-out", "permission")));
    // It is asked for, which takes two seconds.
    check(
        &story.plan(),
        "1 takeoff 10 m
         2 position 0 180 10, hold, ask K
         3 position 0 500 10, needs K
         4 land",
    );
    assert!(story.fail(&[("K", None)]).starts_with("hold 22 s: area K is closed for 40 s more"));
}

#[test]
fn a_forecast_has_the_wait_and_what_hovering_takes() {
    #[track_caller]
    fn needs_wh(is_flying: bool, text: &str) -> f64 {
        let mut story = Story::of(REFERENCE);
        story.state.charge = Some(1.0);
        if is_flying {
            story.airborne_at([0.0, 0.0, 10.0]);
        }
        let reply = story.ask(Ask::Validate(v1::MissionText { text: text.into(), wind: None }));
        assert!(reply.accepted, "{}", reply.text);
        let waits = text.contains("[[area]]");
        assert_eq!(reply.forecast[0].reason.starts_with("area K is closed for 40 s more: waits"), waits);
        assert_eq!(waits, 20.0 < reply.forecast[0].begins_s);
        reply.energy.unwrap().needs_wh
    }
    let (open, closed) = (across(""), across(&wall("00:40")));
    assert!((needs_wh(false, &closed) - needs_wh(false, &open)).abs() < 1e-6, "a wait on the ground takes nothing");
    // 25 s of hovering in a wind of 4 m/s, at 725 W + 87 W * 0.4^3.
    let hover_wh = needs_wh(true, &closed) - needs_wh(true, &open);
    assert!((hover_wh - 730.568 * 25.0 / 3600.0).abs() < 1e-3, "{hover_wh} Wh");
}

#[test]
fn a_headwind_makes_legs_slower_and_a_storm_impossible() {
    let legs_s = |wind: Option<(f64, f64)>| -> f64 {
        let wind = wind.map(|(speed_m_s, from_deg)| v1::ForecastWind { speed_m_s, from_deg: Some(from_deg) });
        let mut story = Story::of(REFERENCE);
        story.state.charge = Some(1.0);
        let reply = story.ask(Ask::Validate(v1::MissionText { text: across(""), wind }));
        reply.forecast[0].flight_time_s
    };
    // 500 m to the east at 10 m/s, and up and down in 10 s.
    assert!((legs_s(None) - 60.0).abs() < 1e-6);
    assert!((legs_s(Some((9.0, 270.0))) - 60.0).abs() < 1e-6, "a tailwind makes it no faster than its setpoint");
    // 15 m/s through the air leave 6 m/s.
    assert!((legs_s(Some((9.0, 90.0))) - (500.0 / 6.0 + 10.0)).abs() < 1e-6);
    // Across the wind 9 m/s are left.
    assert!((legs_s(Some((12.0, 0.0))) - (500.0 / 9.0 + 10.0)).abs() < 1e-6);
    assert_eq!(legs_s(Some((15.0, 0.0))), 0.0, "nothing is flown");
}

#[test]
fn with_a_headwind_an_area_is_over_before_it_is_reached() {
    // Reached after 23 s in calm air; at 6 m/s after 37 s, which may be 29 s.
    let headwind = Some(v1::ForecastWind { speed_m_s: 9.0, from_deg: Some(90.0) });
    for (wind, waits) in [(None, true), (headwind, false)] {
        let mut story = Story::of(REFERENCE);
        let reply = story.ask(Ask::Validate(v1::MissionText { text: across(&wall("00:25")), wind }));
        assert_eq!(!reply.forecast[0].reason.is_empty(), waits, "{}", reply.forecast[0].reason);
    }
}

/// Seconds until a vehicle on the ground at the origin has landed 500 m to the east, waits included.
fn arrives_s(until_s: Option<i64>, east_m: (f64, f64), north_m: (f64, f64)) -> f64 {
    let until_utc_ms = UTC_START_MS + until_s.unwrap_or(1_000_000) * 1000;
    let corners = [(north_m.0, east_m.0), (north_m.1, east_m.0), (north_m.1, east_m.1), (north_m.0, east_m.1)];
    let corners = corners.map(|(north, east)| Ned::new(north, east, 0.0)).into();
    let area = Area { until_utc_ms: Some(until_utc_ms), ..Area::new("K", AreaKind::KeepOut, corners) };
    let there = Objective {
        name: "there".into(),
        position: Ned::new(0.0, 500.0, 0.0),
        flying: false,
        terms: Default::default(),
        survey: None,
    };
    let mission = Mission {
        name: "across".into(),
        objectives: vec![there],
        areas: vec![area],
        order: Default::default(),
        sites: Vec::new(),
        origin: None,
        feeds: Vec::new(),
    };
    let rules = Rules::for_tests();
    let mut planner = MissionPlanner::new(&rules, mission, Pace::REAL_TIME);
    let mut now = Now { time: Time::ZERO, utc_ms: UTC_START_MS };
    for _ in 0..8 {
        let state = State::new(Ned::default(), false);
        let question = Question { state, grants: Grants::new(), failed: None, denials: Vec::new() };
        match planner.replan(question, now) {
            Answer::Plan(steps) => {
                let flown_s: f64 = steps.iter().map(|it| flight_time_s(it, &rules)).sum();
                return now.time.as_secs_f64() + flown_s;
            }
            Answer::Hold { wait, .. } => now = planner.after(now, wait),
            other => panic!("{other:?}"),
        }
    }
    panic!("it waits again and again");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_wait_never_ends_later_than_the_way_round(
        until_s in 1..200i64,
        (west_m, width_m) in (60.0..250.0f64, 20.0..150.0f64),
        (south_m, north_m) in (20.0..500.0f64, 20.0..500.0f64),
    ) {
        let (east_m, north_m) = ((west_m, west_m + width_m), (-south_m, north_m));
        let (with_wait_s, round_s) = (arrives_s(Some(until_s), east_m, north_m), arrives_s(None, east_m, north_m));
        // A wait is in whole milliseconds of UTC.
        prop_assert!(with_wait_s <= round_s + 0.01, "{with_wait_s} s, {round_s} s");
    }
}
