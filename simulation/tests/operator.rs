//! Whole flights with an operator's orders, on the virtual bus.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1;
use simulation::{Machine, Setup, Simulation};
use v1::mission_request::Request as Ask;
use v1::operator_command::Verb;

const LIMIT: Duration = Duration::from_secs(1200);

/// On the way through area B, 10 s into the flight to the goal.
fn under_way() -> Simulation<'static> {
    let config = crate::stories::support::config();
    let setup = Setup { config: &config, mission: None, permissions: Policy::Grant, seed: 1, machine: Machine::Ideal };
    let mut simulation = Simulation::new(&setup).unwrap();
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    simulation.fly(Duration::from_secs(10));
    simulation
}

/// Orders `verb` during the flight; `expected` is the story from there on.
#[track_caller]
fn check(verb: Verb, expected: &[&str]) {
    let mut simulation = under_way();
    simulation.order(verb);
    let report = simulation.fly(LIMIT).expect("the mission to end");
    let story = simulation.story(&["operator", "contingency"]);
    assert_eq!(story, expected, "\n{}", simulation.decision_log());
    let landed = simulation.position().is_some_and(|it| -it.down_m < 1.0);
    assert!(landed, "{report:?}");
}

#[test]
fn an_aborted_mission_lands_where_it_is() {
    check(
        Verb::Abort(v1::AbortMission { overrides: false }),
        &[
            "flag `operator_abort` raised: ordered by anna",
            "anna: abort: lands here and ends the mission",
            "`operator_abort`: land",
            "`operator_abort` is over",
        ],
    );
}

#[test]
fn a_vehicle_that_is_ordered_to_return_lands_at_home() {
    let mut simulation = under_way();
    simulation.order(Verb::Return(v1::ReturnHome { overrides: false }));
    simulation.fly(LIMIT).expect("the mission to end");
    let at = simulation.position().unwrap();
    assert!(at.north_m.hypot(at.east_m) < 5.0, "{at:?}");
}

#[test]
fn a_vehicle_lands_at_the_place_that_was_ordered() {
    let mut simulation = under_way();
    let position = Some(v1::Ned { north_m: 40.0, east_m: 400.0, down_m: 0.0 });
    simulation.order(Verb::LandAt(v1::LandAt { position, overrides: false }));
    simulation.fly(LIMIT).expect("the mission to end");
    let at = simulation.position().unwrap();
    assert!((at.north_m - 40.0).hypot(at.east_m - 400.0) < 5.0, "{at:?}\n{}", simulation.decision_log());
}

#[test]
fn a_pause_is_a_pause_and_the_mission_goes_on_to_its_end() {
    let mut simulation = under_way();
    simulation.order(Verb::Pause(v1::PauseMission { overrides: false }));
    simulation.fly(Duration::from_secs(30));
    let held = simulation.position().unwrap();
    simulation.fly(Duration::from_secs(30));
    let still = simulation.position().unwrap();
    assert!((held.east_m - still.east_m).abs() < 2.0, "{held:?} {still:?}");
    simulation.order(Verb::Resume(v1::ResumeMission {}));
    let report = simulation.fly(LIMIT).expect("the mission to end");
    assert_eq!(report.outcome(), v1::MissionOutcome::Success, "{}", simulation.decision_log());
}

#[test]
fn a_new_plan_on_demand_costs_nothing() {
    let mut simulation = under_way();
    simulation.order(Verb::Replan(v1::ReplanMission {}));
    let report = simulation.fly(LIMIT).expect("the mission to end");
    assert_eq!(report.outcome(), v1::MissionOutcome::Success, "{}", simulation.decision_log());
}

#[test]
fn a_mission_is_changed_in_flight_without_a_landing() {
    let mut simulation = under_way();
    let text =
        "name = \"back\"\n[[objective]]\nname = \"home\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n";
    simulation.ask(Ask::Upload(v1::MissionText { text: text.into(), wind: None }));
    let report = simulation.fly(LIMIT).expect("the mission to end");
    let objectives: Vec<_> = report.objectives.iter().map(|it| (it.name.as_str(), it.state())).collect();
    assert_eq!(objectives, [("home", v1::ObjectiveState::Success)], "{}", simulation.decision_log());
    let story = simulation.story(&["step"]);
    assert!(story.iter().any(|it| it.contains("given up: the mission was changed")), "{story:#?}");
}

#[test]
fn a_skipped_objective_is_left_out() {
    let mut simulation = under_way();
    simulation.ask(Ask::Skip(v1::SkipObjective { name: "deliver".into() }));
    let report = simulation.fly(LIMIT).expect("the mission to end");
    assert_eq!(report.reason, "objective `deliver` failed: skipped by anna", "{}", simulation.decision_log());
    let at = simulation.position().unwrap();
    assert!(at.north_m.hypot(at.east_m) < 5.0, "{at:?}");
}
