//! Where the vehicle comes down when it must not go on: not in what is closed below it, not on a wrong word.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::operator_command::Verb;
use kittiwake_proto::v1::{self, Decision, MissionOutcome};
use simulation::Simulation;

use crate::stories::support::{config, mission_file, simulation};

const LIMIT: Duration = Duration::from_secs(2400);

/// A flight to a place 600 m east, among `areas`.
fn among(name: &str, areas: &str, policy: Policy) -> Simulation<'static> {
    let text = format!(
        "name = \"{name}\"\n[[objective]]\nname = \"far\"\nnorth_m = 0.0\neast_m = 600.0\nheight_m = 0.0\n\
         flying = false\n{areas}"
    );
    let path = mission_file(&format!("landing-{name}"), &text);
    simulation(Some(&path), policy)
}

/// 80 m to either side of the way from 100 m to 500 m east.
fn area(kind: &str, more: &str) -> String {
    format!(
        "[[area]]\nname = \"K\"\nkind = \"{kind}\"\n{more}\n\
         corners_m = [[-80.0, 100.0], [80.0, 100.0], [80.0, 500.0], [-80.0, 500.0]]\n"
    )
}

/// Over the middle of the area.
#[track_caller]
fn over_the_middle(simulation: &mut Simulation<'_>) {
    while simulation.position().is_none_or(|it| it.east_m < 250.0) {
        simulation.pass(Duration::from_millis(200));
        assert!(simulation.now().as_secs_f64() < 900.0, "it never gets there:\n{}", simulation.decision_log());
    }
}

#[track_caller]
fn ends_outside(simulation: &mut Simulation<'_>) {
    simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    simulation.pass(Duration::from_secs(30));
    let at = simulation.position().expect("a position");
    let is_inside = (100.0..500.0).contains(&at.east_m) && at.north_m.abs() < 80.0;
    assert!(simulation.is_on_ground() && !is_inside, "{at:?}\n{}", simulation.decision_log());
    assert_eq!(simulation.breaches(), [], "{}", simulation.decision_log());
}

const ABORT: Verb = Verb::Abort(v1::AbortMission { overrides: false });

#[test]
fn a_landing_in_answer_to_a_flag_goes_aside_of_a_keep_out_area_below() {
    for (name, answer) in [("battery", "`battery_critical`: land"), ("abort", "`operator_abort`: land")] {
        let mut simulation = among(name, &area("keep-out", "ceiling_m = 5.0"), Policy::Grant);
        over_the_middle(&mut simulation);
        match name {
            "abort" => simulation.order(ABORT),
            _ => simulation.inject_fault("battery", &["0.09"]),
        }
        assert!(simulation.fly_until(answer, LIMIT), "{}", simulation.decision_log());
        ends_outside(&mut simulation);
        let log = simulation.decision_log();
        assert!(log.contains("no landing here, in or over K: flies aside first"), "{log}");
    }
}

#[test]
fn a_landing_without_a_place_goes_aside_of_an_area_below() {
    for (kind, policy) in [("keep-out", Policy::Grant), ("permission", Policy::Deny)] {
        let mut simulation = among(&format!("placeless-{kind}"), &area(kind, "ceiling_m = 5.0"), policy);
        over_the_middle(&mut simulation);
        simulation.inject_flag("operator_land");
        assert!(simulation.fly_until("`operator_land`: land_at", LIMIT), "{}", simulation.decision_log());
        ends_outside(&mut simulation);
        let log = simulation.decision_log();
        assert!(log.contains("no landing here, in or over K: flies aside first"), "{log}");
    }
}

#[test]
fn where_no_ground_is_free_near_by_it_lands_and_says_so() {
    let everywhere = "[[area]]\nname = \"K\"\nkind = \"keep-out\"\nceiling_m = 5.0\n\
                      corners_m = [[-2000.0, 50.0], [2000.0, 50.0], [2000.0, 550.0], [-2000.0, 550.0]]\n\
                      [[area]]\nname = \"L\"\nkind = \"keep-out\"\nceiling_m = 5.0\n\
                      corners_m = [[-2000.0, 650.0], [2000.0, 650.0], [2000.0, 5000.0], [-2000.0, 5000.0]]\n";
    let mut simulation = among("nowhere", everywhere, Policy::Grant);
    over_the_middle(&mut simulation);
    simulation.order(ABORT);
    let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    assert_eq!(report.outcome(), MissionOutcome::Emergency);
}

#[test]
fn a_motor_failure_looks_for_no_other_place() {
    let mut simulation = among("motor", &area("keep-out", "ceiling_m = 5.0"), Policy::Grant);
    over_the_middle(&mut simulation);
    simulation.inject_fault("motor_failure", &["1"]);
    simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    let log = simulation.decision_log();
    assert!(log.contains("`motor_failure`: land_now") && !log.contains("flies aside"), "{log}");
}

#[test]
fn a_return_asks_for_the_permission_that_its_only_way_needs() {
    // All round the start, and granted for the way out only.
    let harbour = "[[area]]\nname = \"harbour\"\nkind = \"permission\"\n\
                   corners_m = [[-100.0, -100.0], [100.0, -100.0], [100.0, 100.0], [-100.0, 100.0]]\n";
    let mut simulation = among("harbour", harbour, Policy::Grant);
    over_the_middle(&mut simulation);
    simulation.decide_for("harbour", Decision::Grant, Some(1.0));
    simulation.pass(Duration::from_secs(5));
    simulation.order(Verb::Return(v1::ReturnHome { overrides: false }));
    simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    let (at, log) = (simulation.position().expect("a position"), simulation.decision_log());
    assert!(at.north_m.hypot(at.east_m) < 5.0, "not home, {at:?}: {log}");
    assert!(log.contains("asking for area harbour, which the only way leads through"), "{log}");
    assert_eq!(simulation.breaches(), [], "{log}");
}

#[test]
fn a_gap_in_all_telemetry_is_held_through() {
    let mut simulation = simulation(None, Policy::Grant);
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    simulation.pass(Duration::from_secs(10));
    let topics =
        ["battery_status", "vehicle_local_position", "vehicle_status", "vehicle_attitude", "vehicle_land_detected"];
    topics.iter().for_each(|it| simulation.inject_fault("drop", &[it]));
    simulation.pass(Duration::from_secs(5));
    simulation.inject_fault("clear", &[]);
    let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    assert_eq!(report.outcome(), MissionOutcome::Success, "{}", simulation.decision_log());
}

#[test]
fn nothing_lifts_off_before_the_battery_was_heard() {
    let mut simulation = simulation(None, Policy::Grant);
    simulation.inject_fault("drop", &["battery_status"]);
    simulation.pass(Duration::from_secs(120));
    let log = simulation.decision_log();
    assert!(simulation.is_on_ground() && log.contains("flag `battery_stale` raised"), "{log}");
    simulation.inject_fault("clear", &[]);
    let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    assert_eq!(report.outcome(), MissionOutcome::Success, "{}", simulation.decision_log());
}

#[test]
fn a_swallowed_acknowledgement_is_no_failure_of_what_is_flown() {
    let mut simulation = simulation(None, Policy::Grant);
    simulation.inject_fault("swallow_acks", &["1000"]);
    let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    let log = simulation.decision_log();
    assert_eq!(report.outcome(), MissionOutcome::Success, "{log}");
    assert!(!log.contains("failed"), "{log}");
}

#[test]
fn a_mission_that_nobody_will_fly_is_refused() {
    let mut simulation = simulation(None, Policy::Grant);
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    simulation.order(Verb::Return(v1::ReturnHome { overrides: false }));
    simulation.pass(Duration::from_secs(2));
    let text = std::fs::read_to_string(config().join("missions/keep_out.toml")).expect("it is shipped");
    let upload = || v1::mission_request::Request::Upload(v1::MissionText { text: text.clone(), wind: None });
    simulation.ask(upload());
    simulation.pass(Duration::from_secs(1));
    let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    let objectives: Vec<&str> = report.objectives.iter().map(|it| it.name.as_str()).collect();
    assert!(!objectives.is_empty() && !text.contains(&format!("name = \"{}\"", objectives[0])), "{objectives:?}");
}

#[test]
fn what_only_prevents_a_takeoff_keeps_no_end_away() {
    // Each rises on the way home, or on the ground there, and lasts.
    for (after, fault, arguments, flag) in [
        ("step 2 of 3: fly to (0, 0", "wind", &["0", "-11"][..], "wind_high"),
        ("step 3 of 3: land", "not_ready", &["compass"][..], "autopilot_not_ready"),
    ] {
        let mut simulation = simulation(None, Policy::Grant);
        assert!(simulation.fly_until(after, LIMIT), "{}", simulation.decision_log());
        simulation.inject_fault(fault, arguments);
        let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
        let log = simulation.decision_log();
        assert_eq!(report.outcome(), MissionOutcome::Success, "{log}");
        assert!(log.contains(&format!("flag `{flag}` raised")), "{log}");
        assert!(!log.contains(&format!("`{flag}` does not count on the ground")), "{log}");
    }
}

#[test]
fn what_prevents_a_takeoff_still_does_after_a_landing_on_the_way() {
    let mut simulation = simulation(None, Policy::Grant);
    assert!(simulation.fly_until("step 4 of 5", LIMIT), "{}", simulation.decision_log());
    simulation.inject_fault("wind", &["0", "-11"]);
    assert!(simulation.fly_until("`wind_high`: stop", LIMIT), "{}", simulation.decision_log());
    simulation.pass(Duration::from_secs(60));
    let log = simulation.decision_log();
    assert!(log.contains("step 5 succeeded"), "{log}");
    assert!(simulation.is_on_ground() && simulation.report().is_none(), "{log}");
    assert_eq!(simulation.responder(), "wind_high", "{log}");
}

#[test]
fn what_is_wrong_on_the_ground_is_told_as_long_as_it_is() {
    for (fault, wrong, right, flag) in [
        ("battery_temperature", &["75"][..], &["20"][..], "battery_hot_on_ground"),
        ("not_ready", &["compass"][..], &[][..], "autopilot_not_ready"),
    ] {
        // Before the mission is over, and after it.
        for after in ["step 3 of 3: land", "over: every objective was achieved"] {
            let mut simulation = simulation(None, Policy::Grant);
            assert!(simulation.fly_until(after, LIMIT), "{}", simulation.decision_log());
            simulation.inject_fault(fault, wrong);
            simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
            simulation.pass(Duration::from_secs(60));
            assert_eq!(simulation.alarms(), [flag], "{after}\n{}", simulation.decision_log());
            assert_eq!(simulation.responder(), "", "{after}\n{}", simulation.decision_log());
            simulation.inject_fault(fault, right);
            simulation.pass(Duration::from_secs(60));
            assert!(!simulation.is_up(flag), "{after}\n{}", simulation.decision_log());
        }
    }
}

#[test]
fn one_whose_status_falls_silent_after_the_landing_stands_there() {
    let mut simulation = simulation(None, Policy::Grant);
    assert!(simulation.fly_until("step 3 of 3: land", LIMIT), "{}", simulation.decision_log());
    simulation.pass(Duration::from_secs(11));
    simulation.inject_fault("drop", &["vehicle_status"]);
    let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    simulation.pass(Duration::from_secs(30));
    assert_eq!(report.outcome(), MissionOutcome::Success, "{}", simulation.decision_log());
    assert!(simulation.is_on_ground(), "{}", simulation.decision_log());
}

#[test]
fn a_response_that_has_no_place_to_land_at_says_what_bars_each() {
    let text = "name = \"shut\"\n\
        [[objective]]\nname = \"look\"\nnorth_m = 0.0\neast_m = 900.0\nheight_m = 20.0\nflying = true\ndwell_s = 240.0\n\
        [[objective]]\nname = \"home\"\nnorth_m = 0.0\neast_m = 0.0\nheight_m = 0.0\nflying = false\n\
        [[area]]\nname = \"C\"\nkind = \"keep-out\"\n\
        from_utc = \"2026-01-01T00:01:00Z\"\nuntil_utc = \"2026-01-01T00:07:00Z\"\n\
        corners_m = [[-50.0, -50.0], [50.0, -50.0], [50.0, 50.0], [-50.0, 50.0]]\n";
    let mut simulation = simulation(Some(&mission_file("landing-shut", text)), Policy::Grant);
    simulation.pass(Duration::from_secs(80));
    simulation.inject_fault("battery_temperature", &["70"]);
    assert!(simulation.fly_until("`battery_hot`: divert failed", LIMIT), "{}", simulation.decision_log());
    let log = simulation.decision_log();
    let expected =
        "no place to land at can be reached: home: no way there that may be flown, keep-out area C is closed for 3";
    assert!(log.contains(expected), "{log}");
}
