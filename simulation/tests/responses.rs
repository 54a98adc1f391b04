//! What the vehicle does when something goes wrong, as whole flights: the least that is needed, always something, and told.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::{self, Decision};
use simulation::Simulation;
use v1::MissionOutcome;
use v1::operator_command::Verb;

use crate::stories::support::{mission_file, sample, simulation};

const LIMIT: Duration = Duration::from_secs(2400);

const ABORT: Verb = Verb::Abort(v1::AbortMission { overrides: false });
const PAUSE: Verb = Verb::Pause(v1::PauseMission { overrides: false });
const RETURN: Verb = Verb::Return(v1::ReturnHome { overrides: false });

/// On the way to the far end of the reference mission, at full speed.
#[track_caller]
fn under_way() -> Simulation<'static> {
    let mut simulation = simulation(None, Policy::Grant);
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    simulation.pass(Duration::from_secs(10));
    simulation
}

/// Flies to the end of the mission; the vehicle must be on the ground there, and nothing forbidden may have happened.
#[track_caller]
fn end(simulation: &mut Simulation<'_>, expected: MissionOutcome) -> v1::MissionReport {
    let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    simulation.pass(Duration::from_secs(30));
    let log = simulation.decision_log();
    assert_eq!(report.outcome(), expected, "{log}");
    assert!(simulation.is_on_ground(), "{log}");
    assert_eq!(simulation.breaches(), [], "{log}");
    report
}

/// Fails unless these parts were recorded in this order.
#[track_caller]
fn in_order(simulation: &Simulation<'_>, parts: &[&str]) {
    let log = simulation.decision_log();
    let mut lines = log.lines();
    for part in parts {
        assert!(lines.any(|it| it.contains(part)), "`{part}` is missing or too early in:\n{log}");
    }
}

/// Metres over ground from home.
fn distance_home_m(simulation: &Simulation<'_>) -> f64 {
    simulation.position().map_or(f64::INFINITY, |it| it.north_m.hypot(it.east_m))
}

#[test]
fn a_mission_whose_last_objective_is_in_the_air_ends_at_home_on_the_ground() {
    let text =
        "name = \"survey\"\n[[objective]]\nname = \"look\"\nnorth_m = 40\neast_m = 80\nheight_m = 20\nflying = true\n";
    let mission = mission_file("survey", text);
    let mut simulation = simulation(Some(&mission), Policy::Grant);
    end(&mut simulation, MissionOutcome::Success);
    assert!(distance_home_m(&simulation) < 5.0, "{}", simulation.decision_log());
    in_order(
        &simulation,
        &["over: every objective was achieved", "flag `ended_in_air` raised", "`ended_in_air`: return_home"],
    );
}

#[test]
fn a_mission_that_ends_in_the_air_ends_at_home_also_where_the_land_detector_says_that_it_stands() {
    let text = "name = \"low-survey\"\n[[objective]]\nname = \"look\"\nnorth_m = 40\neast_m = 80\nheight_m = 9\nflying = true\n";
    let mission = mission_file("low-survey", text);
    let mut simulation = simulation(Some(&mission), Policy::Grant);
    assert!(simulation.fly_until("step 2 of", Duration::from_secs(60)), "{}", simulation.decision_log());
    simulation.inject_fault("land_detector", &["landed"]);
    end(&mut simulation, MissionOutcome::Success);
    assert!(distance_home_m(&simulation) < 5.0, "{}", simulation.decision_log());
}

/// In the air, outside of the area round its home, whose permission is revoked by then.
#[track_caller]
fn shut_out() -> Simulation<'static> {
    let text = "name = \"shut-out\"\n\
        [[objective]]\nname = \"look\"\nnorth_m = 0\neast_m = 400\nheight_m = 20\nflying = true\n\
        [[area]]\nname = \"harbour\"\nkind = \"permission\"\n\
        corners_m = [[-60, -60], [60, -60], [60, 60], [-60, 60]]\n";
    let mission = mission_file("shut-out", text);
    let mut simulation = simulation(Some(&mission), Policy::Grant);
    while simulation.position().is_none_or(|it| it.east_m < 150.0) {
        simulation.pass(Duration::from_millis(500));
        assert!(simulation.now().as_secs_f64() < 200.0, "it does not fly:\n{}", simulation.decision_log());
    }
    simulation.decide("harbour", Decision::Revoke);
    simulation
}

const WAITS: &str =
    "`operator_return` waits: no way there that may be flown, area harbour is closed without permission";

#[test]
fn a_return_that_is_barred_for_the_moment_waits_and_is_flown_when_there_is_a_way() {
    let mut simulation = shut_out();
    simulation.order(RETURN);
    simulation.pass(Duration::from_secs(100));
    assert_eq!(simulation.responder(), "operator_return", "{}", simulation.decision_log());
    assert!(!simulation.decision_log().contains("failed (try"), "{}", simulation.decision_log());
    simulation.decide("harbour", Decision::Grant);
    end(&mut simulation, MissionOutcome::Emergency);
    assert!(distance_home_m(&simulation) < 5.0, "{}", simulation.decision_log());
    in_order(&simulation, &[WAITS, "there is a way again after"]);
}

#[test]
fn a_return_that_stays_barred_waits_until_the_battery_would_not_suffice_for_it() {
    let mut simulation = shut_out();
    simulation.order(RETURN);
    // With the battery of a return, then with that of a diversion, until it would land where it is.
    simulation.inject_fault("battery", &["0.3"]);
    end(&mut simulation, MissionOutcome::Emergency);
    in_order(&simulation, &[WAITS, "`energy_short` waits: no way there that may be flown"]);
    let charge = simulation.charge().expect("a battery");
    assert!((0.06..0.16).contains(&charge), "{charge}: {}", simulation.decision_log());
}

#[test]
fn a_crash_is_raised_once() {
    let mut simulation = under_way();
    simulation.inject_fault("motor_failure", &["2"]);
    end(&mut simulation, MissionOutcome::Crash);
    simulation.pass(Duration::from_secs(60));
    let log = simulation.decision_log();
    assert_eq!(log.matches("flag `crashed` raised").count(), 1, "{log}");
}

#[test]
fn rejected_commands_delay_an_emergency_landing_and_do_not_end_it() {
    for rejected in sample(["1", "6", "12"]) {
        let mut simulation = under_way();
        simulation.inject_fault("reject_acks", &[rejected]);
        simulation.inject_fault("battery", &["0.09"]);
        end(&mut simulation, MissionOutcome::Emergency);
        in_order(&simulation, &["`battery_critical`: land", "`battery_critical`: land failed (try 1 of 2)"]);
    }
}

#[test]
fn a_rejected_stop_is_tried_again_and_does_not_become_a_landing() {
    for rejected in sample(["1", "2", "4", "8"]) {
        let mut simulation = under_way();
        simulation.inject_fault("reject_acks", &[rejected]);
        simulation.inject_flag("obstacle");
        simulation.pass(Duration::from_secs(60));
        simulation.inject_fault("clear", &[]);
        end(&mut simulation, MissionOutcome::Success);
        let log = simulation.decision_log();
        assert!(!log.contains("contingency `obstacle`: land"), "{log}");
        in_order(&simulation, &["`obstacle`: stop", "`obstacle`: stop failed (try 1 of 3)", "`obstacle` is over"]);
    }
}

#[test]
fn a_pause_that_becomes_a_return_ends_with_a_report() {
    let mut simulation = under_way();
    simulation.order(PAUSE);
    simulation.pass(Duration::from_secs(20));
    simulation.order(RETURN);
    end(&mut simulation, MissionOutcome::Emergency);
    assert!(distance_home_m(&simulation) < 5.0, "{}", simulation.decision_log());
    in_order(&simulation, &["`operator_pause` is replaced by `operator_return`", "`operator_return`: return_home"]);
}

#[test]
fn an_abort_does_not_wait_for_an_automatic_return() {
    let mut simulation = under_way();
    simulation.inject_fault("battery", &["0.2"]);
    assert!(simulation.fly_until("`battery_low`: divert", LIMIT));
    simulation.pass(Duration::from_secs(3));
    let begun = simulation.now();
    simulation.order(ABORT);
    end(&mut simulation, MissionOutcome::Emergency);
    assert!(simulation.now() - begun < Duration::from_secs(30 + 45), "{}", simulation.decision_log());
    assert!(50.0 < distance_home_m(&simulation), "down where it is: {}", simulation.decision_log());
}

#[test]
fn a_hold_blocks_nothing_that_demands_more() {
    for (what, row) in [("abort", "operator_abort"), ("0.09", "battery_critical")] {
        let mut simulation = under_way();
        simulation.inject_fault("drop", &["vehicle_local_position"]);
        assert!(simulation.fly_until("`local_position_stale`: stop", LIMIT));
        let begun = simulation.now();
        match what {
            "abort" => simulation.order(ABORT),
            remaining => simulation.inject_fault("battery", &[remaining]),
        }
        assert!(
            simulation.fly_until(&format!("`{row}`: land"), Duration::from_secs(5)),
            "{}",
            simulation.decision_log()
        );
        simulation.inject_fault("clear", &[]);
        end(&mut simulation, MissionOutcome::Emergency);
        assert!(simulation.now() - begun < Duration::from_secs(120), "{}", simulation.decision_log());
    }
}

#[test]
fn a_lost_link_does_not_interrupt_a_landing() {
    let mut simulation = simulation(None, Policy::Grant);
    assert!(simulation.fly_until("step 5 of 5: land", LIMIT));
    // The ground's end of the link hangs.
    simulation.freeze("gateway", Duration::from_secs(16));
    end(&mut simulation, MissionOutcome::Success);
    let log = simulation.decision_log();
    assert!(!log.contains("`link_lost`: stop"), "{log}");
    in_order(&simulation, &["step 5 of 5: land", "`link_lost` does not count while landing", "step 5 succeeded"]);
}

#[test]
fn after_an_unplanned_landing_nothing_takes_off_before_an_operator_says_so() {
    let mut simulation = under_way();
    // The autopilot's own failsafe lands it: nobody here has asked for that.
    simulation.inject_fault("gnss_loss", &["on"]);
    simulation.pass(Duration::from_secs(120));
    simulation.inject_fault("clear", &[]);
    simulation.pass(Duration::from_secs(120));
    let log = simulation.decision_log();
    assert!(simulation.is_on_ground(), "{log}");
    assert_eq!(log.matches("takeoff by").count(), 2, "the plan's and the step's, and no more: {log}");
}

#[test]
fn a_pause_in_the_last_metre_of_a_landing_is_ended_by_one_resume() {
    let mut simulation = simulation(None, Policy::Grant);
    assert!(simulation.fly_until("step 5 of 5: land", LIMIT));
    while simulation.position().is_none_or(|it| it.down_m < -0.3) {
        simulation.pass(Duration::from_millis(100));
    }
    simulation.order(PAUSE);
    simulation.pass(Duration::from_secs(60));
    simulation.order(Verb::Resume(v1::ResumeMission {}));
    end(&mut simulation, MissionOutcome::Success);
}

#[test]
fn the_pilot_in_command_overrides_what_the_table_answers_first() {
    let mut simulation = under_way();
    simulation.inject_fault("battery", &["0.2"]);
    assert!(simulation.fly_until("`battery_low`: divert", LIMIT));
    let position = Some(v1::Ned { north_m: 40.0, east_m: 400.0, down_m: 0.0 });
    simulation.order(Verb::LandAt(v1::LandAt { position, overrides: true }));
    simulation.fly(LIMIT);
    let at = simulation.position().unwrap();
    assert!((at.north_m - 40.0).hypot(at.east_m - 400.0) < 5.0, "{at:?}\n{}", simulation.decision_log());
    end(&mut simulation, MissionOutcome::Emergency);
    in_order(&simulation, &["anna: `operator_land` overrides `battery_low`", "`operator_land`: land_at"]);
}

#[test]
fn a_motor_that_fails_is_a_crash_or_a_landing_and_never_a_takeoff_again() {
    for (motors, expected) in [("1", None), ("2", Some(MissionOutcome::Crash))] {
        let mut simulation = under_way();
        simulation.inject_fault("motor_failure", &[motors]);
        let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
        simulation.pass(Duration::from_secs(60));
        let log = simulation.decision_log();
        assert_eq!(log.matches("step 1 of 3: takeoff").count(), 0, "{log}");
        assert!(expected.is_none_or(|it| it == report.outcome()), "{report:?}\n{log}");
        assert!(simulation.is_on_ground(), "{log}");
        assert_eq!(simulation.breaches(), [], "{log}");
    }
}

#[test]
fn a_pause_that_outlasts_the_battery_ends_with_a_report() {
    let mut simulation = under_way();
    simulation.inject_fault("battery", &["0.07"]);
    assert!(simulation.fly_until("`battery_critical`: land", LIMIT));
    simulation.order(Verb::Pause(v1::PauseMission { overrides: true }));
    // The autopilot lands it when the battery is nearly empty.
    let report = end(&mut simulation, MissionOutcome::Failure);
    let landed = report.reason.starts_with("landed because of `autopilot_");
    assert!(landed && report.reason.contains(", and no operator resumed the mission"), "{report:?}");
}
