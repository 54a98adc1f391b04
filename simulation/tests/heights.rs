//! Places above and below the take-off point: approached, left, flown over and landed at by their own heights.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1;
use kittiwake_proto::v1::operator_command::Verb;
use simulation::Machine;
use simulation::chaos::fly::{Flight, fly};
use simulation::chaos::script::{Choice, Script};
use simulation::chaos::trouble::Trouble;
use vehicle_sim::ground::{Ground, Patch, Surface};

use crate::stories::support::{config, mission_file, simulation};

/// Places with ground around them, 50 m by 50 m: north, east, height.
fn ground(places: &[[f64; 3]]) -> Ground {
    let patch = |it: &[f64; 3]| Patch::square((it[0], it[1]), 50.0, it[2], Surface::Land);
    Ground { patches: places.iter().map(patch).collect(), ..Ground::default() }
}

fn objective(name: &str, [north, east, height]: [f64; 3], flying: bool) -> String {
    format!(
        "[[objective]]\nname = \"{name}\"\nnorth_m = {north:.1}\neast_m = {east:.1}\nheight_m = {height:.1}\nflying = {flying}\n"
    )
}

fn site([north, east, height]: [f64; 3]) -> String {
    format!(
        "[[site]]\nname = \"hill\"\nkind = \"landing\"\nnorth_m = {north:.1}\neast_m = {east:.1}\nheight_m = {height:.1}\n"
    )
}

/// Flies these objectives over ground that is as high as `places`, with this trouble at that second; nothing is against it, and the
/// vehicle ends `there`.
#[track_caller]
fn check(mission: &[String], places: &[[f64; 3]], trouble: Option<(u64, Trouble)>, there: &str) -> Flight {
    let mission = Choice::Drawn(format!("name = \"heights\"\n{}", mission.concat()));
    let troubles = trouble.into_iter().map(|(at, it)| (Duration::from_secs(at), it)).collect();
    let script = Script::new(1, mission, Policy::Grant, Machine::Ideal, troubles);
    let flight = fly(&Script { ground: ground(places), ..script }, &config()).unwrap();
    let findings: Vec<String> = flight.findings.iter().map(ToString::to_string).collect();
    let story: Vec<String> =
        flight.story().into_iter().map(|(at, what)| format!("{:7.2}  {what}", at.as_secs_f64())).collect();
    assert_eq!(findings, Vec::<String>::new(), "{}", story.join("\n"));
    assert!(flight.ending.to_string().contains(there), "{}\n{}", flight.ending, story.join("\n"));
    flight
}

const HOME: [f64; 3] = [0.0, 0.0, 0.0];

fn battery(charge: &str) -> Trouble {
    Trouble::Fault { name: "battery".into(), args: vec![charge.into()] }
}

#[test]
fn a_flight_that_ends_early_comes_down_on_a_hill_from_above() {
    let far = [objective("far", [0.0, 2400.0, 20.0], true), objective("back", HOME, false)];
    for height_m in [35.0, 60.0] {
        let hill = [40.0, 1700.0, height_m];
        let mission = [far.concat(), site(hill)];
        check(&mission, &[hill], Some((180, battery("0.24"))), "hill");
        let order =
            v1::LandAt { position: Some(v1::Ned { north_m: 40.0, east_m: 1700.0, down_m: 0.0 }), overrides: false };
        check(&mission, &[hill], Some((150, Trouble::Order(Verb::LandAt(order)))), "hill");
    }
}

#[test]
fn a_mission_leads_onto_a_deck_past_a_hill_and_into_a_valley() {
    let (deck, valley, hill) = ([0.0, 300.0, 60.0], [200.0, 600.0, -40.0], [100.0, 300.0, 35.0]);
    let mission = [
        objective("low", [100.0, 200.0, 15.0], true),
        objective("deck", deck, false),
        objective("valley", valley, false),
        objective("over", [100.0, 450.0, 15.0], true),
        objective("back", HOME, false),
        site(hill),
    ];
    check(&mission, &[deck, valley, hill], None, "home");
    // From the valley and over it a response climbs first.
    for at in [90, 140, 170] {
        check(&mission, &[deck, valley, hill], Some((at, Trouble::Flag("operator_return".into()))), "");
    }
}

#[test]
fn a_return_from_over_the_pad_comes_straight_down() {
    let mission =
        mission_file("heights_pad", &format!("name = \"pad\"\n{}", objective("up", [0.0, 300.0, 20.0], true)));
    let mut simulation = simulation(Some(&mission), Policy::Grant);
    while simulation.position().is_none_or(|it| -it.down_m < 6.0) {
        simulation.pass(Duration::from_millis(100));
    }
    simulation.order(Verb::Return(v1::ReturnHome { overrides: false }));
    let mut highest_m = 0.0_f64;
    while !simulation.is_on_ground() {
        simulation.pass(Duration::from_millis(100));
        highest_m = highest_m.max(simulation.position().map_or(0.0, |it| -it.down_m));
        assert!(simulation.now().as_secs_f64() < 200.0, "{}", simulation.decision_log());
    }
    assert!(highest_m < 9.0, "{highest_m} m\n{}", simulation.decision_log());
}

#[test]
fn a_takeoff_under_a_low_floor_ends_below_it() {
    let roof = "[[area]]\nname = \"roof\"\nkind = \"keep-out\"\nfloor_m = 11.0\n\
                corners_m = [[-500.0, -500.0], [500.0, -500.0], [500.0, 900.0], [-500.0, 900.0]]\n";
    let there = objective("there", [0.0, 300.0, 0.0], false);
    let flight = check(&[there, objective("back", HOME, false), roof.to_owned()], &[], None, "home");
    let plan = flight.decisions.iter().find(|(_, it)| it.contains("takeoff by 7 m; fly to (0, 300, 7); land"));
    assert!(plan.is_some(), "{:?}", flight.decisions);
}
