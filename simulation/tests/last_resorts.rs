//! A response finds the better of what is left: what is held is used, what is lost is noticed, and no water is taken for ground.

use control_tower::policy::Policy;
use domain::file::Source;
use domain::mission::Mission;
use kittiwake_proto::v1::MissionOutcome::Emergency;
use simulation::{Changes, Machine, Setup, Simulation};

use crate::stories::support::config;
use crate::stories::support::story::{LIMIT, ends, s};

/// On the way out there is a belt that needs a permission, another site in an area that does, and a lake to ditch in.
const BELT: (u32, &str) = (
    1500,
    r#"
[[area]]
name = "P"
kind = "permission"
corners_m = [[-2000.0, 400.0], [2000.0, 400.0], [2000.0, 600.0], [-2000.0, 600.0]]
[[area]]
name = "Q"
kind = "permission"
corners_m = [[50.0, 900.0], [200.0, 900.0], [200.0, 1100.0], [50.0, 1100.0]]
[[site]]
name = "q"
kind = "landing"
north_m = 120.0
east_m = 1000.0
[[site]]
name = "lake"
kind = "ditch"
north_m = -300.0
east_m = 1000.0
"#,
);

/// The way out leads over the sea, in which no landing is allowed.
const SEA: (u32, &str) = (
    2500,
    r#"
[[area]]
name = "sea"
kind = "no-landing"
corners_m = [[-5000.0, 60.0], [5000.0, 60.0], [5000.0, 9000.0], [-5000.0, 9000.0]]
"#,
);

/// A flight of this many metres to the east and back over these areas and sites, `seconds` after its start, when it is on its way out.
fn out((east_m, around): (u32, &str), seconds: u64) -> Simulation<'static> {
    let config = config();
    let (permissions, machine) = (Policy::Grant, Machine::Ideal);
    let setup = Setup { config: &config, mission: None, permissions, seed: 1, machine };
    let text = format!(
        "name = \"out\"\n\
         [[objective]]\nname = \"out\"\nnorth_m = 0.0\neast_m = {east_m}.0\nheight_m = 30.0\nflying = true\n\
         [[objective]]\nname = \"home\"\nnorth_m = 0.0\neast_m = 0.0\nheight_m = 0.0\nflying = false\n{around}"
    );
    let source = Source { path: "the mission of the test".into(), text };
    let mission = Some(Mission::read(&source).unwrap());
    let mut simulation = Simulation::changed(&setup, Changes { mission, ..Changes::default() }).unwrap();
    assert!(simulation.fly_until("fly to (0,", LIMIT), "{}", simulation.decision_log());
    simulation.pass(s(seconds).saturating_sub(simulation.now().since_start()));
    simulation
}

#[test]
fn a_flag_that_keeps_out_of_areas_keeps_no_response_out_of_those_that_are_held() {
    for flag in ["tower_lost", "clock_jumped", "position_jumped"] {
        let mut simulation = out(BELT, 150);
        simulation.inject_flag(flag);
        simulation.pass(s(2));
        simulation.inject_fault("battery", &["0.24"]);
        assert!(simulation.fly_until("flies to home to land", LIMIT), "{flag}\n{}", simulation.decision_log());
        simulation.pass(s(15));
        simulation.lower_flag(flag);
        ends(simulation, Emergency, &["`battery_low`: divert", "flies to home to land", "over: `battery_low`"]);
    }
}

#[test]
fn a_diversion_ends_when_it_is_no_longer_known_where_the_vehicle_is() {
    let mut simulation = out(BELT, 85);
    simulation.inject_fault("battery_temperature", &["70"]);
    assert!(simulation.fly_until("flies to home to land", LIMIT), "{}", simulation.decision_log());
    simulation.inject_fault("drop", &["vehicle_local_position"]);
    let begun = simulation.now();
    let lost = "divert failed (try 1 of 2): it needs a position, and `local_position_stale` has been up for 5 s";
    ends(&mut simulation, Emergency, &[lost]);
    let took = simulation.now() - begun;
    assert!(took < s(120), "{took:?}\n{}", simulation.decision_log());
}

#[test]
fn a_position_that_is_back_within_seconds_costs_no_diversion() {
    let mut simulation = out(BELT, 85);
    simulation.inject_fault("battery_temperature", &["70"]);
    assert!(simulation.fly_until("flies to home to land", LIMIT), "{}", simulation.decision_log());
    simulation.inject_fault("drop", &["vehicle_local_position"]);
    simulation.pass(s(3));
    simulation.inject_fault("clear", &[]);
    ends(&mut simulation, Emergency, &["`local_position_stale` is over", "`battery_hot` is over"]);
    assert!(!simulation.decision_log().contains("divert failed"), "{}", simulation.decision_log());
}

#[test]
fn nothing_is_flown_to_in_a_frame_that_has_moved() {
    let mut simulation = out(SEA, 90);
    simulation.inject_fault("frame_jump", &["0", "-40", "0"]);
    simulation.pass(s(5));
    simulation.inject_fault("battery", &["0.2"]);
    // Nobody knows what is below: landing in the sea is not a mistake of a response.
    let report = simulation.fly(LIMIT).expect("it comes down");
    let log = simulation.decision_log();
    assert_eq!(report.outcome(), Emergency, "{log}");
    assert!(log.contains("land_elsewhere failed (try 2 of 2): it needs a position, and `frame_moved` is up"), "{log}");
    assert!(!log.contains("flies aside"), "{log}");
}

#[test]
fn an_abort_over_the_sea_lands_on_land_while_the_battery_allows_it() {
    let mut simulation = out(SEA, 160);
    simulation.inject_flag("operator_abort");
    let expected = ["flies to home to land", "no landing here, in or over sea, among people: flies to home"];
    ends(simulation, Emergency, &expected);
    // With too little left it comes down where it is, and says so.
    let mut simulation = out(SEA, 160);
    simulation.inject_fault("battery", &["0.11"]);
    simulation.pass(s(1));
    simulation.inject_flag("operator_abort");
    assert!(simulation.fly_until("lands where it is, in or over sea", LIMIT), "{}", simulation.decision_log());
}

#[test]
fn a_place_that_the_battery_no_longer_suffices_for_is_given_up() {
    let mut simulation = out(BELT, 120);
    simulation.inject_flag("energy_short");
    assert!(simulation.fly_until("flies to home to land", LIMIT), "{}", simulation.decision_log());
    simulation.inject_fault("battery", &["0.145"]);
    ends(simulation, Emergency, &["flies to home to land", "flies to site `q` to land"]);
}
