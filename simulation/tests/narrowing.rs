//! Flights on which a flag slows the vehicle, keeps it out of areas or from landing, and one that ends in a ditch.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::MissionOutcome;
use simulation::Simulation;

use crate::stories::support::story::{ends, s};
use crate::stories::support::{config_with_rows, mission_file, simulation_of};

const LIMIT: Duration = Duration::from_secs(1800);

/// Rows that are raised by hand.
const ROWS: &str = r#"
[[contingency]]
flag = "rough_air"
priority = 900
group = "weather"
phases = ["cruise", "waiting", "inside-area"]
actions = ["slow"]
emergency = "slow"
clears = "with-condition"
then = "resume"

[[contingency]]
flag = "areas_in_doubt"
priority = 901
group = "airspace"
phases = ["on-ground"]
actions = ["stop"]
emergency = "stop"
narrows = ["no-new-area"]
clears = "with-condition"
then = "resume"

[[contingency]]
flag = "people_below"
priority = 902
group = "airspace"
phases = ["on-ground"]
actions = ["stop"]
emergency = "stop"
narrows = ["no-landing-here"]
clears = "with-condition"
then = "resume"

[[contingency]]
flag = "fire_on_board"
priority = 903
group = "vehicle"
phases = ["cruise", "waiting", "inside-area"]
actions = ["ditch", "land_elsewhere"]
emergency = "terminate"
clears = "never"
then = "end-mission"
"#;

/// The reference mission, or one of this text, with those rows.
#[track_caller]
fn flight(name: &str, mission: Option<&str>) -> Simulation<'static> {
    let config = config_with_rows(name, ROWS);
    let reference = || crate::stories::support::config().join("missions/reference.toml");
    let path = mission.map_or_else(reference, |text| mission_file(name, text));
    simulation_of(&config, Some(&path), Policy::Grant)
}

/// Flies until the vehicle is this far to the east.
#[track_caller]
fn until_east(simulation: &mut Simulation<'_>, east_m: f64) {
    let begun = simulation.now();
    while simulation.position().is_none_or(|it| it.east_m < east_m) {
        simulation.pass(Duration::from_millis(100));
        assert!(simulation.now() - begun < s(300), "it never gets there:\n{}", simulation.decision_log());
    }
}

#[track_caller]
fn east_m(simulation: &Simulation<'_>) -> f64 {
    simulation.position().expect("it is heard").east_m
}

#[test]
fn a_row_that_slows_lets_the_mission_go_on_at_half_its_speed() {
    let mut simulation = flight("slows", None);
    assert!(simulation.fly_until("step 4 of 5", LIMIT), "{}", simulation.decision_log());
    simulation.pass(s(8));
    simulation.inject_flag("rough_air");
    simulation.pass(s(5));
    let before = east_m(&simulation);
    simulation.pass(s(10));
    let flown_m = east_m(&simulation) - before;
    assert!((40.0..55.0).contains(&flown_m), "{flown_m} m in 10 s:\n{}", simulation.decision_log());
    assert_eq!(simulation.responder(), "", "no response is flown");
    simulation.lower_flag("rough_air");
    simulation.pass(s(5));
    let before = east_m(&simulation);
    simulation.pass(s(5));
    assert!(45.0 < east_m(&simulation) - before, "{}", simulation.decision_log());
    let expected = [
        "step 4 of 5",
        "flag `rough_air` raised",
        "`rough_air`: slow, no faster than 5.0 m/s",
        "`rough_air` is over",
        "`slow` is over: no flag asks for it any more",
        "step 4 succeeded",
    ];
    ends(&mut simulation, MissionOutcome::Success, &expected);
}

#[test]
fn no_new_area_is_entered_while_they_are_in_doubt_and_the_mission_goes_on_after_it() {
    let mut simulation = flight("in-doubt", None);
    assert!(simulation.fly_until("step 4 of 5", LIMIT), "{}", simulation.decision_log());
    // In area A, which ends 290 m to the east; B begins 380 m to the east.
    until_east(&mut simulation, 200.0);
    simulation.inject_flag("areas_in_doubt");
    simulation.pass(s(40));
    let at_m = east_m(&simulation);
    assert!(
        (350.0..370.0).contains(&at_m),
        "it left A and holds before B, at {at_m} m:\n{}",
        simulation.decision_log()
    );
    simulation.lower_flag("areas_in_doubt");
    let expected = [
        "`areas_in_doubt`: no-new-area, no area is entered in which the vehicle is not already",
        "holds before area B while `areas_in_doubt` is up",
        "goes on: no flag forbids it any more",
        "step 4 succeeded",
    ];
    ends(&mut simulation, MissionOutcome::Success, &expected);
}

#[test]
fn a_response_flies_home_without_entering_an_area_that_is_in_doubt() {
    let text = "name = \"round\"\n\
        [[objective]]\nname = \"look\"\nnorth_m = 0\neast_m = 400\nheight_m = 20\nflying = true\n\
        [[area]]\nname = \"harbour\"\nkind = \"permission\"\n\
        corners_m = [[-60, 100], [60, 100], [60, 200], [-60, 200]]\n";
    let mut simulation = flight("round", Some(text));
    simulation.decide("harbour", kittiwake_proto::v1::Decision::Grant);
    until_east(&mut simulation, 300.0);
    simulation.inject_flag("areas_in_doubt");
    simulation.inject_fault("battery", &["0.24"]);
    assert!(simulation.fly_until("`battery_low`: divert", s(30)), "{}", simulation.decision_log());
    while !simulation.is_on_ground() {
        simulation.pass(Duration::from_millis(200));
        let at = simulation.position().expect("it is heard");
        let is_inside = at.north_m.abs() < 60.0 && (100.0..200.0).contains(&at.east_m);
        assert!(!is_inside, "it enters the area at {at:?}:\n{}", simulation.decision_log());
        assert!(simulation.now().as_secs_f64() < 600.0, "no end:\n{}", simulation.decision_log());
    }
    simulation.lower_flag("areas_in_doubt");
    ends(&mut simulation, MissionOutcome::Emergency, &["`areas_in_doubt`: no-new-area", "`battery_low`: divert"]);
}

#[test]
fn no_landing_begins_over_people_and_it_begins_when_they_have_gone() {
    let mut simulation = flight("people", None);
    assert!(simulation.fly_until("step 5 of 5: land", LIMIT), "{}", simulation.decision_log());
    simulation.pass(s(2));
    simulation.inject_flag("people_below");
    simulation.pass(s(40));
    assert!(!simulation.is_on_ground(), "{}", simulation.decision_log());
    simulation.lower_flag("people_below");
    let expected = [
        "`people_below`: no-landing-here, no landing where the vehicle is",
        "holds over the place of the landing while `people_below` is up",
        "goes on: no flag forbids it any more",
        "step 5 succeeded",
    ];
    ends(&mut simulation, MissionOutcome::Success, &expected);
}

/// A look 1,500 m to the east, with a ditch on the way.
const FAR_OUT: &str = "name = \"far-out\"\n\
    [[objective]]\nname = \"look\"\nnorth_m = 0\neast_m = 1500\nheight_m = 20\nflying = true\n\
    [[site]]\nname = \"pond\"\nkind = \"ditch\"\nnorth_m = 100\neast_m = 1000\n";

#[test]
fn a_ditch_is_the_place_when_no_landing_can_be_reached() {
    let mut simulation = flight("ditch", Some(FAR_OUT));
    until_east(&mut simulation, 1000.0);
    // Home takes more than what is left above the tenth at which it lands where it is.
    simulation.inject_fault("battery", &["0.2"]);
    simulation.pass(Duration::from_millis(500));
    simulation.inject_flag("fire_on_board");
    ends(&mut simulation, MissionOutcome::Emergency, &["`fire_on_board`: ditch", "flies to ditch `pond` to land"]);
    let at = simulation.position().expect("it is heard");
    assert!((at.north_m - 100.0).hypot(at.east_m - 1000.0) < 5.0, "{at:?}\n{}", simulation.decision_log());
}

#[test]
fn nothing_is_ditched_while_a_landing_can_be_reached() {
    let mut simulation = flight("no-ditch", Some(FAR_OUT));
    until_east(&mut simulation, 1000.0);
    simulation.inject_flag("fire_on_board");
    let expected = ["`fire_on_board`: ditch", "a landing can be reached: home", "flies to home to land"];
    ends(&mut simulation, MissionOutcome::Emergency, &expected);
    let at = simulation.position().expect("it is heard");
    assert!(at.north_m.hypot(at.east_m) < 5.0, "{at:?}\n{}", simulation.decision_log());
}

#[test]
fn a_flag_that_forbids_for_good_costs_objectives_and_never_the_vehicle() {
    /// Raised at `when`, or from there on so far to the east; lowered once it has stood on the ground for a while.
    #[track_caller]
    fn check(name: &str, (when, from_east_m): (&str, f64), flag: &str, expected: &[&str]) {
        let mut simulation = flight(name, None);
        assert!(simulation.fly_until(when, LIMIT), "{}", simulation.decision_log());
        until_east(&mut simulation, from_east_m);
        simulation.inject_flag(flag);
        simulation.pass(s(5));
        while !simulation.is_on_ground() {
            simulation.pass(s(5));
            assert!(simulation.now().as_secs_f64() < 1500.0, "no end:\n{}", simulation.decision_log());
        }
        simulation.pass(s(30));
        simulation.lower_flag(flag);
        ends(&mut simulation, MissionOutcome::Failure, expected);
        assert_eq!(simulation.breaches(), [], "{}", simulation.decision_log());
    }
    let before_b = "area B is not entered: `areas_in_doubt` is up, for 60 s";
    // Out of A, before B; then home, round A.
    let expected =
        [before_b, "asked once more", before_b, "area A is not entered", "fly to (100, 100, 10)", "step 4 of 4: land"];
    check("ahead-for-good", ("step 4 of 5", 200.0), "areas_in_doubt", &expected);
    check(
        "below-for-good",
        ("step 5 of 5: land", 490.0),
        "people_below",
        &["no landing here: `people_below` is up, for 60 s"],
    );
}
