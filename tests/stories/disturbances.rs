//! Faults in flight, and how the mission continues.

use nix::sys::signal::Signal;
use serde_json::Value;

use crate::support::files::Files;
use crate::support::{Ending, FLY_LONG_LEG, System, wait_for};

const SPEED: &str = "10";

/// Injects a fault; the simulator has answered when this returns.
#[track_caller]
fn fault(system: &System, line: &str) {
    let words: Vec<_> = ["fault"].into_iter().chain(line.split(' ')).collect();
    let output = system.inject(&words);
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
}

/// A system whose vehicle is under way on a long leg.
#[track_caller]
fn under_way() -> System {
    under_way_at(SPEED)
}

/// The same, at this speed.
#[track_caller]
fn under_way_at(speed: &str) -> System {
    let system = System::on_long_leg(speed);
    wait_for_mode(&system, "FLIGHT_MODE_OFFBOARD");
    system
}

#[track_caller]
fn wait_for_mode(system: &System, mode: &str) -> Value {
    wait_for(mode, || {
        let status = system.status()["aircraft"]["status"].clone();
        (status["actualMode"] == mode).then_some(status)
    })
}

/// A mission whose first command to the autopilot, that of the takeoff, meets this fault.
#[track_caller]
fn with_first_command(meets: &str) -> Ending {
    let files = Files::begun_by_operator();
    let system = System::waiting(&files, &["--speed", SPEED]);
    fault(&system, meets);
    system.begin();
    let ending = system.end();
    ending.expect(0, &["SUCCESS", "SUCCESS"]);
    ending
}

#[test]
fn a_rejected_takeoff_is_replanned() {
    let ending = with_first_command("reject_acks 1");
    ending.expect_in_order(&[
        "step 1 of 5: takeoff",
        "step 1 failed: rejected",
        "step 1 of 5: takeoff",
        "step 1 succeeded",
    ]);
}

#[test]
fn a_swallowed_acknowledgement_costs_a_second_and_no_try() {
    let ending = with_first_command("swallow_acks 1");
    ending.expect_in_order(&["step 1 of 5: takeoff", "step 1 succeeded"]);
    assert!(!ending.stdout.contains("step 1 failed"), "{}", ending.stdout);
}

#[test]
fn without_proof_of_life_the_vehicle_loiters_by_itself_and_the_mission_goes_on_later() {
    let system = under_way();
    let skill_manager = system.process("skill-manager");
    skill_manager.signal(Signal::SIGSTOP);
    let status = wait_for_mode(&system, "FLIGHT_MODE_LOITER");
    assert_eq!(status["failsafe"], true, "{status}");
    // On a busy machine it may have been taken for hung by now; then another one runs.
    let _ = skill_manager.try_signal(Signal::SIGCONT);
    system.end().expect(0, &["SUCCESS"]);
}

#[test]
fn a_flag_in_flight_stops_the_vehicle_and_the_mission_is_replanned() {
    let system = under_way();
    assert!(system.inject(&["flag", "obstacle"]).status.success());
    let ending = system.end();
    ending.expect(0, &["SUCCESS"]);
    ending.expect_in_order(&[
        "flag `obstacle` raised",
        "`obstacle`: stop",
        "`obstacle` is over",
        "plan: plan 2",
        "step 1 of 2: fly to (0, 2000, 10)",
    ]);
}

#[test]
fn a_rejected_stop_is_tried_again_and_does_not_become_a_landing() {
    let system = under_way();
    fault(&system, "reject_acks 1");
    assert!(system.inject(&["flag", "obstacle"]).status.success());
    let ending = system.end();
    ending.expect(0, &["SUCCESS"]);
    let parts = ["`obstacle`: stop", "`obstacle`: stop failed (try 1 of 3)", "`obstacle` is over", FLY_LONG_LEG];
    ending.expect_in_order(&parts);
}

#[test]
fn a_frozen_source_stops_the_vehicle_until_it_is_heard_again() {
    let system = under_way();
    fault(&system, "freeze vehicle_local_position");
    system.wait_for("flag `local_position_stale` raised");
    fault(&system, "thaw vehicle_local_position");
    let ending = system.end();
    ending.expect(0, &["SUCCESS"]);
    ending.expect_in_order(&["flag `local_position_stale` raised", "`local_position_stale` is over", FLY_LONG_LEG]);
}

#[test]
fn a_critical_battery_ends_the_mission_on_the_ground() {
    // Long before it arrives, however late a busy machine lets the fault be injected.
    let system = under_way_at("3");
    fault(&system, "battery 0.09");
    let ending = system.end();
    ending.expect(4, &["WAITING"]);
    assert_eq!(ending.report()["outcome"], "MISSION_OUTCOME_EMERGENCY");
    ending.expect_in_order(&["flag `battery_critical` raised", "`battery_critical`: land", "mission: over"]);
}

#[test]
fn what_an_expression_raises_ends_the_mission_at_a_landing_place() {
    for (line, raised, response) in [
        ("battery_temperature 70", "flag `battery_hot` raised: battery.temperature_c 69.", "`battery_hot`: divert"),
        ("wind 0 15", "flag `wind_too_strong` raised: wind.speed_m_s 1", "`wind_too_strong`: return_home"),
    ] {
        let system = under_way();
        fault(&system, line);
        let ending = system.end();
        ending.expect(4, &["WAITING"]);
        assert_eq!(ending.report()["outcome"], "MISSION_OUTCOME_EMERGENCY");
        ending.expect_in_order(&[raised, response, "mission: over"]);
    }
}

#[test]
fn services_that_die_in_flight_come_back_and_the_mission_flies_on() {
    let system = under_way();
    let address = system.status()["vehicle"].clone();
    for service in ["gateway", "control-tower", "monitor"] {
        system.process(service).signal(Signal::SIGKILL);
        system.wait_for(&format!("{service} ended by signal 9"));
    }
    let ending = system.end();
    ending.expect(0, &["SUCCESS"]);
    assert_eq!(address, "uav1");
}

#[test]
fn a_mission_manager_that_dies_leaves_the_vehicle_safe() {
    let system = under_way();
    system.process("mcm").signal(Signal::SIGKILL);
    system.wait_for("mcm ended by signal 9");
    // It comes back and plans from where the vehicle is.
    system.end().expect(0, &["SUCCESS"]);
}
