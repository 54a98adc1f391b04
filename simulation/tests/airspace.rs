//! Where and when the vehicle may be, in whole flights: no area is entered without its permission, at no time, and what is
//! flown is what the mission says.

use std::path::Path;
use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::{self, MissionOutcome, MissionReport};
use simulation::{Machine, Setup, Simulation};

use crate::stories::support::{config, config_with, mission_file};

const LIMIT: Duration = Duration::from_secs(3000);
/// A window that is open during the flight and ends some day, so that the place is not refused when the file is read.
const FOR_NOW: &str = "until_utc = \"2030-01-01T00:00:00Z\"";

/// Places at these heights are reached flying.
const IN_THE_AIR: [f64; 2] = [10.0, 60.0];

/// A flight of a mission that is written for it.
struct Flight {
    simulation: Simulation<'static>,
}

impl Flight {
    /// A mission of these `[north, east, height]`, 0 being the ground, and areas.
    fn of(name: &str, places: &[[f64; 3]], areas: &str, permissions: Policy) -> Flight {
        Flight::with(&config(), name, places, areas, permissions)
    }

    fn with(config: &Path, name: &str, places: &[[f64; 3]], areas: &str, permissions: Policy) -> Flight {
        let objective = |(index, [north, east, height]): (usize, &[f64; 3])| {
            let flying = IN_THE_AIR.contains(height);
            format!(
                "[[objective]]\nname = \"{index}\"\nnorth_m = {north:.1}\neast_m = {east:.1}\n\
                 height_m = {height:.1}\nflying = {flying}\n"
            )
        };
        let objectives: String = places.iter().enumerate().map(objective).collect();
        let path = mission_file(name, &format!("name = \"{name}\"\n{objectives}{areas}"));
        let setup = Setup { config, mission: Some(&path), permissions, seed: 1, machine: Machine::Ideal };
        Flight { simulation: Simulation::new(&setup).unwrap_or_else(|mistakes| panic!("{mistakes}")) }
    }

    /// Flies to the end and for a while after it, without a breach.
    #[track_caller]
    fn end(&mut self) -> MissionReport {
        let report = self.simulation.fly(LIMIT);
        self.simulation.pass(Duration::from_secs(60));
        let log = self.simulation.decision_log();
        assert_eq!(self.simulation.breaches(), [], "\n{log}");
        report.unwrap_or_else(|| panic!("no end:\n{log}"))
    }

    /// The same, and every objective was reached.
    #[track_caller]
    fn succeed(&mut self) {
        let report = self.end();
        assert_eq!(report.outcome(), MissionOutcome::Success, "\n{}", self.simulation.decision_log());
    }

    fn plans(&self) -> Vec<String> {
        self.simulation.story(&["plan"]).into_iter().filter(|it| it.starts_with("plan ")).collect()
    }
}

/// From 90 m south to 90 m north.
fn area(name: &str, kind: &str, east_m: [f64; 2], more: &str) -> String {
    let [west, east] = east_m;
    format!(
        "[[area]]\nname = \"{name}\"\nkind = \"{kind}\"\n{more}\n\
         corners_m = [[-90.0, {west:.1}], [90.0, {west:.1}], [90.0, {east:.1}], [-90.0, {east:.1}]]\n"
    )
}

/// A keep-out area to this far north, and farther to the south.
fn wide(north_m: f64, east_m: [f64; 2], heights: &str) -> String {
    let ([west, east], south) = (east_m, north_m + 50.0);
    format!(
        "[[area]]\nname = \"K\"\nkind = \"keep-out\"\n{heights}\n\
         corners_m = [[-{south:.1}, {west:.1}], [{north_m:.1}, {west:.1}], [{north_m:.1}, {east:.1}], [-{south:.1}, {east:.1}]]\n"
    )
}

#[test]
fn areas_are_flown_over_under_or_round_whatever_takes_the_least_time() {
    #[track_caller]
    fn check(name: &str, places: &[[f64; 3]], area: &str, expected: &[&str]) {
        let mut flight = Flight::of(name, places, area, Policy::Grant);
        flight.succeed();
        let plans: Vec<String> = flight.plans().iter().map(|it| it.split_once(": ").unwrap().1.to_owned()).collect();
        assert_eq!(plans, expected, "{name}");
    }
    let there = [[0.0, 400.0, 0.0]];
    check(
        "stadium",
        &there,
        &wide(400.0, [100.0, 300.0], "ceiling_m = 40.0"),
        &["takeoff by 10 m; fly to (0, 90, 44); fly to (0, 310, 44); fly to (0, 400, 10); land"],
    );
    check(
        "tower",
        &there,
        &wide(150.0, [100.0, 300.0], "ceiling_m = 100.0"),
        &["takeoff by 10 m; fly to (160, 90, 10); fly to (160, 310, 10); fly to (0, 400, 10); land"],
    );
    let high = [[0.0, 0.0, 60.0], [0.0, 900.0, 60.0], [0.0, 900.0, 0.0]];
    check(
        "sector",
        &high,
        &wide(2000.0, [100.0, 800.0], "floor_m = 50.0"),
        &["takeoff by 60 m", "fly to (0, 90, 46); fly to (0, 810, 46); fly to (0, 900, 60)", "land"],
    );
}

#[test]
fn lifting_off_inside_an_area_needs_its_permission() {
    let over_start = area("A", "permission", [-60.0, 60.0], "");
    let mut flight = Flight::of("lift_off_granted", &[[0.0, 200.0, 0.0]], &over_start, Policy::Grant);
    flight.succeed();
    let story = flight.simulation.story(&["plan", "permission"]);
    assert!(story[0].starts_with("plan 1: stop, asking A; takeoff by 10 m; fly to (0, 200, 10)"), "{story:#?}");
    for (policy, name) in [(Policy::Deny, "lift_off_denied"), (Policy::Silent, "lift_off_silent")] {
        let mut flight = Flight::of(name, &[[0.0, 200.0, 0.0]], &over_start, policy);
        let report = flight.end();
        assert!(report.reason.contains("area A"), "{}", report.reason);
        assert!(flight.simulation.story(&["step"]).iter().all(|it| !it.contains("takeoff")), "{policy}");
    }
}

#[test]
fn nothing_lifts_off_inside_a_keep_out_area() {
    let over_start = area("K", "keep-out", [-60.0, 60.0], FOR_NOW);
    let mut flight = Flight::of("lift_off_kept_out", &[[0.0, 200.0, 0.0]], &over_start, Policy::Grant);
    let report = flight.end();
    assert!(report.reason.contains("keep-out area K"), "{}", report.reason);
    assert!(flight.plans().is_empty(), "{:#?}", flight.plans());
}

#[test]
fn an_area_that_opens_on_the_way_is_flown_round_or_asked_for() {
    // The flight takes 200 s; the area 1,340 m away opens after 60 s.
    let opens = "from_utc = \"OPENS\"";
    let far = [1340.0, 1740.0];
    let mut flight = Flight::of(
        "opens_keep_out",
        &[[0.0, 2000.0, 0.0]],
        &opening(&area("K", "keep-out", far, opens)),
        Policy::Grant,
    );
    flight.succeed();
    let mut flight = Flight::of(
        "opens_permission",
        &[[0.0, 2000.0, 0.0]],
        &opening(&area("P", "permission", far, opens)),
        Policy::Grant,
    );
    flight.succeed();
    let permissions = flight.simulation.story(&["permission"]);
    assert!(permissions.iter().any(|it| it == "area P: granted"), "{permissions:#?}");
}

#[test]
fn an_area_that_is_soon_over_is_waited_for_and_another_one_is_flown_round() {
    // Straight the flight takes a minute, and round the area two and a half.
    let there = [0.0, 500.0, 0.0];
    let across = |name: &str, places: &[[f64; 3]], until: &str| {
        let closed = wide(600.0, [200.0, 300.0], &format!("until_utc = \"2026-01-01T00:{until}Z\""));
        let mut flight = Flight::of(name, places, &closed, Policy::Grant);
        flight.succeed();
        let plans: Vec<String> = flight.plans().iter().map(|it| it.split_once(": ").unwrap().1.to_owned()).collect();
        (plans, flight.simulation.decision_log())
    };
    let (plans, log) = across("soon_over", &[there], "01:00");
    assert_eq!(plans, ["takeoff by 10 m; fly to (0, 500, 10); land"], "\n{log}");
    assert!(log.contains("area K is closed for ") && log.contains("sooner than by the way round it"), "\n{log}");
    // In the air, where the vehicle is.
    let (plans, log) = across("soon_over_in_flight", &[[0.0, 0.0, 10.0], there], "01:00");
    assert_eq!(plans, ["takeoff by 10 m", "fly to (0, 500, 10); land"], "\n{log}");
    assert!(log.contains("area K is closed for ") && log.contains("sooner than by the way round it"), "\n{log}");
    let (plans, log) = across("long_closed", &[there], "20:00");
    let round = "takeoff by 10 m; fly to (610, 190, 10); fly to (610, 310, 10); fly to (0, 500, 10); land";
    assert_eq!(plans, [round], "\n{log}");
    assert!(!log.contains("is closed for"), "\n{log}");
}

#[test]
fn an_area_whose_hours_begin_on_the_way_is_flown_round_or_asked_for() {
    // The simulation begins on a Thursday at midnight; the flight takes 200 s.
    let hours = "hours_utc = [\"Mon 08:00-18:00\", \"Thu 00:01-12:00\"]";
    let far = [1340.0, 1740.0];
    let there = [[0.0, 2000.0, 0.0]];
    Flight::of("hours_keep_out", &there, &area("K", "keep-out", far, hours), Policy::Grant).succeed();
    let mut flight = Flight::of("hours_permission", &there, &area("P", "permission", far, hours), Policy::Grant);
    flight.succeed();
    let permissions = flight.simulation.story(&["permission"]);
    assert!(permissions.iter().any(|it| it == "area P: granted"), "{permissions:#?}");
    // On another day nobody is asked.
    let sunday = "hours_utc = [\"Sun 00:00-24:00\"]";
    let mut flight = Flight::of("hours_over", &there, &area("P", "permission", far, sunday), Policy::Grant);
    flight.succeed();
    let permissions = flight.simulation.story(&["permission"]);
    assert!(permissions.iter().all(|it| !it.contains("area P")), "{permissions:#?}");
}

/// `areas` with a window that opens 60 s after the start.
fn opening(areas: &str) -> String {
    areas.replace("OPENS", "2026-01-01T00:01:00Z")
}

#[test]
fn a_grant_that_is_too_short_for_the_crossing_costs_a_way_round_and_no_zigzag() {
    let short = config_with("short_grants", &[("grant_valid_s", "120.0")]);
    let long = area("A", "permission", [100.0, 2300.0], "");
    let mut flight = Flight::with(&short, "short_round", &[[0.0, 2400.0, 0.0]], &long, Policy::Grant);
    flight.succeed();
    assert!(flight.plans().len() <= 2, "{:#?}", flight.plans());
    // For a goal in its middle there is no way round.
    let mut flight = Flight::with(&short, "short_in", &[[0.0, 1800.0, 0.0], [0.0, 0.0, 0.0]], &long, Policy::Grant);
    let report = flight.end();
    let reason = "objective `0` failed: the permission for area A holds for 120 s, ";
    assert!(report.reason.starts_with(reason), "{}", report.reason);
    assert!(flight.plans().len() <= 3, "{:#?}", flight.plans());
}

#[test]
fn a_grant_that_is_long_enough_is_used() {
    let short = config_with("enough_grants", &[("grant_valid_s", "120.0")]);
    let narrow = area("A", "permission", [100.0, 400.0], "");
    let mut flight = Flight::with(&short, "short_through", &[[0.0, 500.0, 0.0]], &narrow, Policy::Grant);
    flight.succeed();
    assert_eq!(flight.plans().len(), 1, "{:#?}", flight.plans());
}

#[test]
fn a_leg_along_a_border_keeps_its_margin() {
    // Start and goal are 4 m from the border of a keep-out area, which lies along the whole way.
    let beside = format!(
        "[[area]]\nname = \"K\"\nkind = \"keep-out\"\n{FOR_NOW}\n\
         corners_m = [[4.0, -50.0], [90.0, -50.0], [90.0, 450.0], [4.0, 450.0]]\n"
    );
    let mut flight = Flight::of("beside", &[[0.0, 400.0, 0.0]], &beside, Policy::Grant);
    flight.simulation.inject_fault("wind", &["3", "0", "0"]);
    let mut nearest_m = f64::INFINITY;
    while flight.simulation.fly(Duration::from_secs(1)).is_none() {
        let at = flight.simulation.position().unwrap();
        if (20.0..380.0).contains(&at.east_m) {
            nearest_m = nearest_m.min(4.0 - at.north_m);
        }
    }
    flight.succeed();
    // Ten metres, but for the wind.
    assert!(8.0 < nearest_m, "{nearest_m} m");
}

#[test]
fn a_position_that_drifts_before_the_takeoff_grows_no_waypoint() {
    let mut flight = Flight::of("drifts", &[[0.0, 100.0, 0.0]], "", Policy::Grant);
    flight.simulation.inject_fault("estimator_drift", &["3"]);
    flight.simulation.inject_fault("reject_acks", &["3"]);
    flight.simulation.fly(Duration::from_secs(8));
    flight.simulation.inject_fault("clear", &[]);
    flight.succeed();
    let plans = flight.plans();
    assert!(1 < plans.len(), "{}", flight.simulation.decision_log());
    for plan in plans {
        let steps = plan.split_once(": ").unwrap().1;
        assert!(
            ["takeoff by 10 m; fly to (0, 100, 10); land", "fly to (0, 100, 10); land"].contains(&steps),
            "{}",
            flight.simulation.decision_log()
        );
    }
}

#[test]
fn a_takeoff_that_never_succeeds_ends_the_mission() {
    let places = [[0.0, 100.0, 0.0], [0.0, 0.0, 0.0]];
    let mut flight = Flight::of("no_takeoff", &places, "", Policy::Grant);
    flight.simulation.inject_fault("reject_acks", &["1000"]);
    let report = flight.end();
    assert!(report.reason.contains("takeoff failed 8 times in a row"), "{}", report.reason);
    let tries = flight.simulation.story(&["step"]).iter().filter(|it| it.contains("of 3: takeoff")).count();
    assert_eq!(tries, 8, "{}", flight.simulation.decision_log());
}

#[test]
fn a_vehicle_that_lands_on_the_sea_is_not_on_the_deck() {
    let mut flight = Flight::of("deck", &[[0.0, 100.0, 30.0], [0.0, 0.0, 0.0]], "", Policy::Grant);
    let report = flight.end();
    assert_eq!(report.reason, "objective `0` failed: the vehicle has landed 30 m below it");
    let state = |it: &v1::ObjectiveReport| it.state();
    let states: Vec<_> = report.objectives.iter().map(state).collect();
    assert_eq!(states, [v1::ObjectiveState::Failure, v1::ObjectiveState::Success]);
}

#[test]
fn objectives_two_and_a_half_metres_apart_are_both_flown_to() {
    let places = [[0.0, 100.0, 10.0], [0.0, 102.5, 10.0], [2.5, 102.5, 10.0], [0.0, 0.0, 0.0]];
    let mut flight = Flight::of("close", &places, "", Policy::Grant);
    flight.succeed();
    let plans: Vec<String> = flight.plans().iter().map(|it| it.split_once(": ").unwrap().1.to_owned()).collect();
    let expected = [
        "takeoff by 10 m; fly to (0, 100, 10)",
        "fly to (0, 103, 10)",
        "fly to (3, 103, 10)",
        "fly to (0, 0, 10); land",
    ];
    assert_eq!(plans, expected);
}

/// Where the planner is less careful than the mission manager, the manager refuses what it plans, again and again.
#[test]
fn no_plan_relies_on_a_permission_that_the_mission_manager_no_longer_relies_on() {
    let text = std::fs::read_to_string(config().join("kittiwake.toml")).unwrap();
    let config: toml::Table = toml::from_str(&text).unwrap();
    let number = |section: &str, key: &str| config[section][key].as_float().unwrap();
    assert!(number("mcm", "permission_margin_s") <= number("planner", "grant_lead_s"));
    assert!(number("mcm", "leave_lead_s") <= number("planner", "grant_lead_s"));
}

#[test]
fn a_takeoff_below_an_area_is_flown_to_its_height() {
    // The takeoff ends at 10 m; heights from 11 m on count as inside.
    let above = "[[area]]\nname = \"F\"\nkind = \"permission\"\nfloor_m = 13.0\n\
                 corners_m = [[-500.0, -500.0], [500.0, -500.0], [500.0, 900.0], [-500.0, 900.0]]\n";
    let mut flight = Flight::of("take_off_below", &[[0.0, 300.0, 0.0]], above, Policy::Deny);
    flight.succeed();
    assert_eq!(flight.plans().len(), 1, "{}", flight.simulation.decision_log());
}
