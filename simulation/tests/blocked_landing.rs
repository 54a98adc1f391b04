//! A landing that does not come down: the vehicle climbs and goes elsewhere.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::{MissionOutcome, MissionReport, ObjectiveState};
use simulation::{Machine, Setup, Simulation};

const LIMIT: Duration = Duration::from_secs(1500);

fn simulation() -> Simulation<'static> {
    let config = crate::stories::support::config();
    let permissions = Policy::Grant;
    let setup = Setup { config: &config, mission: None, permissions, seed: 1, machine: Machine::Ideal };
    Simulation::new(&setup).unwrap()
}

/// Flies to the end. It has ended with `outcome`, at home.
#[track_caller]
fn ends_at_home(simulation: &mut Simulation<'_>, outcome: MissionOutcome) -> MissionReport {
    ends_at(simulation, outcome, &[0.0])
}

/// The same at one of these places, in metres east of home.
#[track_caller]
fn ends_at(simulation: &mut Simulation<'_>, outcome: MissionOutcome, east_m: &[f64]) -> MissionReport {
    let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no report:\n{}", simulation.decision_log()));
    assert_eq!(report.outcome(), outcome, "{}\n{}", report.reason, simulation.decision_log());
    let place = simulation.position().expect("it is heard");
    let away_m = east_m.iter().map(|it| place.north_m.hypot(place.east_m - it)).fold(f64::INFINITY, f64::min);
    assert!(away_m < 3.0 && place.down_m.abs() < 1.0, "{place:?}:\n{}", simulation.decision_log());
    assert_eq!(simulation.breaches(), []);
    report
}

#[test]
fn in_a_mission_the_objective_fails_and_the_next_one_is_flown() {
    let mut simulation = simulation();
    assert!(simulation.fly_until("step 5 of 5: land", LIMIT));
    simulation.inject_fault("blocked_landing", &["on"]);
    assert!(simulation.fly_until("step 2 of 3: fly to (0, 0, 10)", LIMIT), "{}", simulation.decision_log());
    simulation.inject_fault("blocked_landing", &["off"]);
    let report = ends_at_home(&mut simulation, MissionOutcome::Failure);
    assert_eq!(report.objectives[0].state(), ObjectiveState::Failure);
    assert!(report.objectives[0].reason.contains("did not come down: still at a height of 2."), "{report:?}");
    assert_eq!(report.objectives[1].state(), ObjectiveState::Success);
}

#[test]
fn in_a_response_the_next_action_of_the_row_is_flown() {
    let mut simulation = simulation();
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    simulation.pass(Duration::from_secs(20));
    simulation.inject_fault("blocked_landing", &["on"]);
    simulation.inject_flag("operator_abort");
    let second = "`operator_abort`: land failed (try 2 of 2): timed out: did not come down";
    assert!(simulation.fly_until(second, LIMIT), "{}", simulation.decision_log());
    simulation.inject_fault("blocked_landing", &["off"]);
    ends_at_home(&mut simulation, MissionOutcome::Emergency);
}

#[test]
fn where_every_place_was_blocked_they_are_tried_again() {
    let mut simulation = simulation();
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    simulation.pass(Duration::from_secs(5));
    simulation.inject_fault("blocked_landing", &["on"]);
    simulation.inject_flag("battery_low");
    // At home, and at the other place of the mission.
    let elsewhere = "`battery_low`: land_elsewhere failed (try 1 of 2): timed out: did not come down";
    assert!(simulation.fly_until(elsewhere, LIMIT), "{}", simulation.decision_log());
    simulation.pass(Duration::from_secs(5));
    simulation.inject_fault("blocked_landing", &["off"]);
    // Not where the last landing has failed.
    ends_at(&mut simulation, MissionOutcome::Emergency, &[0.0, 500.0]);
}
