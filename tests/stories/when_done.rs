//! `--exit-when-done`: the system ends with its mission, and not before the aircraft is at rest.

use crate::support::System;
use crate::support::files::Files;

const FAULTS: &str = "/api/v1/vehicles/uav1/simulation/faults";

/// Straight up and down again: the stay up there and the landing last longer than a command takes on a crowded machine.
fn up_and_down(stays_s: u32) -> (System, Files) {
    let mission = format!(
        "name = \"up and down\"\n\
         [[objective]]\nname = \"up\"\nnorth_m = 0\neast_m = 0\nheight_m = 60\nflying = true\ndwell_s = {stays_s}\n\
         [[objective]]\nname = \"down\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n"
    );
    let files = Files::shipped().flying(&mission);
    let config = files.config();
    (System::start(&["--speed", "2", "--config", config.to_str().expect("a readable path")]), files)
}

#[track_caller]
fn fault(system: &System, line: &str) {
    let (name, args) = line.split_once(' ').unwrap_or((line, ""));
    let args: Vec<_> = args.split_whitespace().collect();
    let fault = serde_json::json!({ "name": name, "args": args });
    system.http().order(FAULTS, &fault.to_string());
}

/// Reads the launcher's lines: on a busy machine, starting a program that asks may take longer than the landing.
#[track_caller]
fn wait_for_landing(system: &System) {
    system.wait_for("step 1 of 1, land, at (");
}

#[test]
fn an_aircraft_that_is_not_heard_keeps_the_system_up_until_it_is_seen_on_the_ground() {
    let (system, _files) = up_and_down(0);
    wait_for_landing(&system);
    fault(&system, "drop vehicle_status");
    system.wait_for("mission over: success");
    system.wait_for("the aircraft is not heard, or its status is frozen, so it may be in the air: the system stays up until it is seen");
    assert!(system.process("mcm").runs());
    // The system may have ended before this is answered.
    let _answer = system.http().ask(FAULTS, r#"{"name":"clear","args":[]}"#);
    system.end().expect(0, &["SUCCESS", "SUCCESS"]);
}

#[test]
fn a_land_detector_that_reports_the_air_for_ever_does_not_keep_the_system_up() {
    let (system, _files) = up_and_down(0);
    wait_for_landing(&system);
    fault(&system, "land_detector flying");
    // The mission ends before the detector has been contradicted for three seconds; unless the machine is so busy that this is
    // answered first. Then nothing takes off and nothing ends until an operator ends it.
    let (over, answered) = ("mission over: success", "`land_detector_contradicts`: land_now");
    if system.wait_for_any(&[over, answered]) == over {
        return system.end().expect(0, &["SUCCESS", "SUCCESS"]);
    }
    let abort = serde_json::json!({ "name": "operator_abort", "raised": true, "reason": "by the story" });
    system.http().order("/api/v1/vehicles/uav1/simulation/flags", &abort.to_string());
    assert_eq!(system.end().code, Some(4), "an emergency");
}

#[test]
fn a_crash_is_told_by_the_exit_code() {
    // It hovers for long enough that the fault is injected in time, also on a busy machine.
    let (system, _files) = up_and_down(300);
    system.wait_for("step 1 succeeded");
    fault(&system, "motor_failure 2");
    let ending = system.end();
    ending.expect(6, &["WAITING", "WAITING"]);
    assert_eq!(ending.report()["outcome"], "MISSION_OUTCOME_CRASH");
}
