//! What the battery does not suffice for is not flown, as whole flights.

use std::time::Duration;

use crate::stories::support::{mission_file, simulation};
use control_tower::policy::Policy;
use kittiwake_proto::v1::{MissionOutcome, ObjectiveState};

const LIMIT: Duration = Duration::from_secs(1200);

fn objective(name: &str, east_m: f64, height_m: f64, more: &str) -> String {
    let flying = 0.0 < height_m;
    format!(
        "[[objective]]\nname = \"{name}\"\nnorth_m = 0.0\neast_m = {east_m:.1}\nheight_m = {height_m:.1}\nflying = {flying}\n{more}\n"
    )
}

#[test]
fn a_mission_of_forty_kilometres_is_refused_before_takeoff() {
    let text = format!("name = \"far\"\n{}{}", objective("there", 20_000.0, 0.0, ""), objective("back", 0.0, 0.0, ""));
    let mission = mission_file("energy_far", &text);
    let mut simulation = simulation(Some(&mission), Policy::Grant);
    let report = simulation.fly(LIMIT).expect("the mission to end");
    assert_eq!(report.outcome(), MissionOutcome::Failure);
    let figures = "Wh of 225 usable (300 of 300 Wh left, 25 % reserve)";
    assert!(
        report.reason.contains("failed: the mission needs 1") && report.reason.contains(figures),
        "{}",
        report.reason
    );
    assert!(!simulation.decision_log().contains("takeoff"), "{}", simulation.decision_log());
    assert_eq!(simulation.breaches(), []);
}

#[test]
fn a_battery_that_sinks_leaves_out_what_is_optional_and_the_rest_is_flown() {
    let text = format!(
        "name = \"sinks\"\n{}{}{}",
        objective("near", 200.0, 10.0, "dwell_s = 10.0"),
        objective("far", 2000.0, 10.0, "optional = true\nworth = 1.0"),
        objective("back", 0.0, 0.0, "")
    );
    let mission = mission_file("energy_sinks", &text);
    let mut simulation = simulation(Some(&mission), Policy::Grant);
    assert!(simulation.fly_until("stays at `near`", LIMIT), "{}", simulation.decision_log());
    simulation.inject_fault("battery", &["0.4"]);
    let report = simulation.fly(LIMIT).expect("the mission to end");
    let states: Vec<_> = report.objectives.iter().map(|it| it.state()).collect();
    let log = simulation.decision_log();
    assert_eq!(states, [ObjectiveState::Success, ObjectiveState::Failure, ObjectiveState::Success], "{log}");
    assert_eq!(report.outcome(), MissionOutcome::Success, "{log}");
    let begin = "every required objective was achieved; objective `far` failed: left out, worth 1: the mission needs";
    assert!(report.reason.starts_with(begin), "{}", report.reason);
    assert_eq!(simulation.breaches(), []);
}
