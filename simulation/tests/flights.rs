//! Whole flights on the virtual bus, as stories.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::{MissionOutcome, MissionReport};
use simulation::{Machine, Setup, Simulation};

use crate::stories::support::{each, sample};

const LIMIT: Duration = Duration::from_secs(1200);

fn reference(permissions: Policy, seed: u64) -> Simulation<'static> {
    let config = crate::stories::support::config();
    Simulation::new(&Setup { config: &config, mission: None, permissions, seed, machine: Machine::Ideal }).unwrap()
}

/// Flies the reference mission; `expected` is the decisions, one line each, and the outcome.
#[track_caller]
fn check(policy: Policy, expected: &str) {
    let mut simulation = reference(policy, 1);
    let report = simulation.fly(LIMIT).expect("the mission to end");
    assert_story(&simulation, &report, expected);
}

/// The same with a flag raised by hand 10 s into the flight to the goal.
#[track_caller]
fn check_flag(flag: &str, expected: &str) {
    let mut simulation = reference(Policy::Grant, 1);
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    simulation.fly(Duration::from_secs(10));
    simulation.inject_flag(flag);
    let report = simulation.fly(LIMIT).expect("the mission to end");
    let story = simulation.story(&["plan", "step", "contingency", "mission"]);
    let from = story.iter().position(|it| it.contains(flag)).expect("the flag to be noticed");
    assert_eq!(finish(story[from..].to_vec(), &report), lines(expected));
}

#[track_caller]
fn assert_story(simulation: &Simulation<'_>, report: &MissionReport, expected: &str) {
    let story = simulation.story(&["plan", "permission", "contingency"]);
    assert_eq!(finish(story, report), lines(expected), "\n{}", simulation.decision_log());
}

fn finish(mut story: Vec<String>, report: &MissionReport) -> Vec<String> {
    story.push(format!("{}: {}", report.outcome().as_str_name(), report.reason));
    story
}

fn lines(text: &str) -> Vec<String> {
    text.trim().lines().map(|it| it.trim().to_owned()).collect()
}

#[test]
fn the_same_setup_gives_the_same_flight() {
    let fly = |policy, seed| {
        let mut simulation = reference(policy, seed);
        let report = simulation.fly(LIMIT).expect("the mission to end");
        (report, simulation.decision_log(), simulation.position())
    };
    for policy in [Policy::Grant, Policy::Random] {
        assert_eq!(fly(policy, 7), fly(policy, 7), "{policy}");
    }
    assert_ne!(fly(Policy::Grant, 7).2, fly(Policy::Grant, 8).2, "the seed reaches the sensors' noise");
}

#[test]
fn permissions_granted_at_once() {
    check(
        Policy::Grant,
        "plan 1: takeoff by 10 m; fly to (0, 90, 10), asking A; fly to (0, 360, 10), asking B; fly to (0, 500, 10); land
         asking for area A
         area A: granted
         asking for area B
         area B: granted
         plan 2: takeoff by 10 m; fly to (0, 0, 10); land
         every objective is settled
         MISSION_OUTCOME_SUCCESS: every objective was achieved",
    );
}

#[test]
fn permissions_granted_after_a_delay_do_not_stop_the_vehicle() {
    check(
        Policy::Delay,
        "plan 1: takeoff by 10 m; fly to (0, 90, 10), asking A; fly to (0, 360, 10), asking B; fly to (0, 500, 10); land
         asking for area A
         area A: granted
         asking for area B
         area B: granted
         plan 2: takeoff by 10 m; fly to (0, 0, 10); land
         every objective is settled
         MISSION_OUTCOME_SUCCESS: every objective was achieved",
    );
}

#[test]
fn denied_areas_are_flown_round_and_an_objective_inside_one_fails() {
    check(
        Policy::Deny,
        "plan 1: takeoff by 10 m; fly to (0, 90, 10), asking A; fly to (0, 360, 10), asking B; fly to (0, 500, 10); land
         asking for area A
         area A: denied (the area is closed)
         transition: stop
         plan 2: fly to (100, 100, 10); fly to (100, 300, 10); fly to (69, 362, 10), asking B; fly to (0, 500, 10); land
         asking for area B ahead
         area B: denied (the area is closed)
         transition: stop
         hold for 30 s: area B: denied by the control tower: the area is closed; asked once more
         plan 3: fly to (69, 362, 10), asking B; fly to (0, 500, 10); land
         asking for area B
         area B: denied (the area is closed)
         transition: stop
         plan 4: fly to (100, 100, 10); fly to (0, 0, 10); land
         every objective is settled
         MISSION_OUTCOME_FAILURE: objective `deliver` failed: area B: denied twice by the control tower: the area is closed",
    );
}

#[test]
fn a_silent_tower_counts_as_a_denial() {
    check(
        Policy::Silent,
        "plan 1: takeoff by 10 m; fly to (0, 90, 10), asking A; fly to (0, 360, 10), asking B; fly to (0, 500, 10); land
         asking for area A
         transition: stop
         plan 2: fly to (100, 100, 10); fly to (100, 300, 10); fly to (69, 362, 10), asking B; fly to (0, 500, 10); land
         asking for area B ahead
         transition: stop
         plan 3: fly to (100, 300, 10); fly to (100, 100, 10); fly to (0, 0, 10); land
         every objective is settled
         MISSION_OUTCOME_FAILURE: objective `deliver` failed: area B: no answer from the control tower",
    );
}

#[test]
fn a_flag_that_passes_costs_a_stop_and_a_new_plan() {
    check_flag(
        "obstacle",
        "flag `obstacle` raised: by hand
         `obstacle`: stop
         `obstacle` is over
         transition: stop
         plan 2: fly to (0, 500, 10); land
         step 1 of 2: fly to (0, 500, 10)
         step 1 succeeded
         step 2 of 2: land
         step 2 succeeded
         plan 3: takeoff by 10 m; fly to (0, 0, 10); land
         step 1 of 3: takeoff by 10 m
         step 1 succeeded
         step 2 of 3: fly to (0, 0, 10)
         step 2 succeeded
         step 3 of 3: land
         step 3 succeeded
         every objective is settled
         over: every objective was achieved
         MISSION_OUTCOME_SUCCESS: every objective was achieved",
    );
}

#[test]
fn a_low_battery_brings_the_vehicle_home_and_ends_the_mission() {
    check_flag(
        "battery_low",
        "flag `battery_low` raised: by hand
         `battery_low`: divert
         flies to home to land
         `battery_low` is over
         over: `battery_low`: by hand
         MISSION_OUTCOME_EMERGENCY: `battery_low`: by hand",
    );
}

/// On the ground the less urgent of two flags has nothing left to do, and must not fly home.
#[test]
fn once_a_critical_battery_has_brought_it_down_the_vehicle_stays_down() {
    let mut simulation = reference(Policy::Grant, 1);
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    simulation.inject_fault("battery", &["0.09"]);
    let report = simulation.fly(LIMIT).expect("the mission to end");
    simulation.pass(Duration::from_secs(60));
    // How often the battery is measured decides the hundredths.
    let in_tenths = |it: String| {
        let (before, value) = it.split_once("charge_percent 8.")?;
        Some(format!("{before}charge_percent 8.{}{}", value.get(..1)?, value.get(2..)?))
    };
    let expected = "flag `battery_critical` raised: battery.charge_percent 8.9 %; the rule is `known(battery.charge_percent) and battery.charge_percent < 10 %` for 0.5 s
         `battery_critical`: land
         flag `battery_low` raised: battery.charge_percent 8.9 %; the rule is `known(battery.charge_percent) and battery.charge_percent < 25 %` for 1.0 s
         `battery_low` waits behind `battery_critical`
         `battery_critical` is over
         `battery_low` is over: the vehicle is on the ground
         MISSION_OUTCOME_EMERGENCY: `battery_critical`: battery.charge_percent 8.9 %; the rule is `known(battery.charge_percent) and battery.charge_percent < 10 %` for 0.5 s";
    let story = finish(simulation.story(&["contingency"]), &report);
    let story: Vec<_> = story.into_iter().map(|it| in_tenths(it.clone()).unwrap_or(it)).collect();
    assert_eq!(story, lines(expected));
    assert_eq!(simulation.breaches(), []);
}

#[test]
fn a_flag_raised_before_it_lifts_off_keeps_it_on_the_ground_or_brings_it_back() {
    for (flag, tenths) in sample(each(["battery_critical", "battery_low", "operator_abort", "operator_return"], 0..40))
    {
        let mut simulation = reference(Policy::Grant, 1);
        assert!(simulation.fly_until("step 1 of 5", LIMIT));
        simulation.pass(Duration::from_millis(tenths * 100));
        simulation.inject_flag(flag);
        let report = simulation.fly(LIMIT).expect("the mission to end");
        simulation.pass(Duration::from_secs(60));
        let told = format!("{tenths} tenths of a second after the start:\n{}", simulation.decision_log());
        assert_eq!(report.outcome(), MissionOutcome::Emergency, "{told}");
        assert_eq!(simulation.breaches(), [], "{told}");
    }
}

#[test]
fn a_fault_of_the_vehicle_is_seen_and_answered() {
    #[track_caller]
    fn check(fault: &str, args: &[&str], expected_flag: &str, outcome: MissionOutcome) {
        let mut simulation = reference(Policy::Grant, 1);
        assert!(simulation.fly_until("step 4 of 5", LIMIT));
        simulation.fly(Duration::from_secs(10));
        simulation.inject_fault(fault, args);
        let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
        let story = simulation.story(&["contingency"]);
        let raised = format!("flag `{expected_flag}` raised");
        assert!(story.iter().any(|it| it.starts_with(&raised)), "{}", simulation.decision_log());
        assert_eq!(report.outcome(), outcome, "{}", simulation.decision_log());
    }
    check("battery", &["0.2"], "battery_low", MissionOutcome::Emergency);
    check("battery", &["0.09"], "battery_critical", MissionOutcome::Emergency);
    check("estimator_invalid", &["on"], "estimator_lost", MissionOutcome::Emergency);
    check("drop", &["battery_status"], "battery_gone", MissionOutcome::Emergency);
}

#[test]
fn a_source_that_freezes_and_comes_back_is_waited_for() {
    let mut simulation = reference(Policy::Grant, 1);
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    simulation.inject_fault("freeze", &["vehicle_local_position"]);
    assert!(simulation.fly_until("`local_position_stale`: stop", LIMIT), "{}", simulation.decision_log());
    simulation.inject_fault("thaw", &["vehicle_local_position"]);
    let report = simulation.fly(LIMIT).expect("the mission to end");
    assert_eq!(report.outcome(), MissionOutcome::Success, "{}", simulation.decision_log());
}
