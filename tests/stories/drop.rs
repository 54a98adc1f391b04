//! The sample mission with a load, on real processes.

use nix::sys::signal::Signal;

use crate::support::System;

const MISSION: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/config/missions/drop.toml");

#[test]
fn the_sample_delivers_its_load_and_returns() {
    let ending = System::start(&["--mission", MISSION]).end();
    ending.expect(0, &["SUCCESS", "SUCCESS"]);
    let said = ending.lines.join("\n");
    let released = |it: &&String| it.starts_with("step ") && it.ends_with("release the load over (150, 200, 30)");
    let steps = ending.story("step");
    assert_eq!(steps.iter().filter(released).count(), 1, "it said:\n{said}");
}

#[test]
fn a_gripper_that_is_stuck_fails_the_delivery_and_the_vehicle_returns() {
    let system = System::start(&["--speed", "5", "--mission", MISSION]);
    system.wait_for("takeoff");
    let output = system.inject(&["fault", "gripper_stuck"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let ending = system.end();
    ending.expect(3, &["FAILURE", "SUCCESS"]);
    let report = ending.report();
    let reason = report["objectives"][0]["reason"].as_str().expect("a reason");
    assert!(reason.contains("the gripper holds its load"), "{reason}");
}

#[test]
fn a_mission_manager_that_dies_during_the_release_is_told_what_became_of_the_load() {
    let system = System::start(&["--speed", "4", "--mission", MISSION]);
    // On a machine that stalls for a second the release is the only step of a second plan.
    system.wait_for_any(&["step 4 of 4: release the load", "step 1 of 1: release the load"]);
    system.process("mcm").signal(Signal::SIGKILL);
    system.wait_for("mcm ended by signal 9");
    // With an open gripper a second release would fail its objective.
    system.end().expect(0, &["SUCCESS", "SUCCESS"]);
}
