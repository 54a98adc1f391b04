//! After the end of a mission an operator uploads the next one and has it begun, again and again; nothing begins by itself.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1;
use simulation::{Machine, Setup, Simulation};
use v1::mission_request::Request as Ask;
use v1::operator_command::Verb;

const LIMIT: Duration = Duration::from_secs(1200);
const A_WHILE: Duration = Duration::from_secs(5);
const START: Verb = Verb::Start(v1::StartMission {});

fn started() -> Simulation<'static> {
    let config = crate::stories::support::config();
    let setup = Setup { config: &config, mission: None, permissions: Policy::Grant, seed: 1, machine: Machine::Ideal };
    Simulation::new(&setup).unwrap()
}

/// A hop of 100 m to the north of the last one, and back home.
fn hop(number: u32) -> Ask {
    let north_m = 100.0 * f64::from(number);
    let text = format!(
        "name = \"hop {number}\"\n\
         [[objective]]\nname = \"there\"\nnorth_m = {north_m:.1}\neast_m = -150.0\nheight_m = 0.0\nflying = false\n\
         [[objective]]\nname = \"home\"\nnorth_m = 0.0\neast_m = 0.0\nheight_m = 0.0\nflying = false\n"
    );
    Ask::Upload(v1::MissionText { text, wind: None })
}

/// The mission that is under way is flown to its end.
#[track_caller]
fn flies_to_its_end(simulation: &mut Simulation<'_>, outcome: v1::MissionOutcome) {
    let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    assert_eq!(report.outcome(), outcome, "{report:?}\n{}", simulation.decision_log());
    simulation.pass(A_WHILE);
    assert!(simulation.is_on_ground());
    assert_eq!(simulation.breaches(), []);
}

/// The operator begins the mission that waits.
fn start(simulation: &mut Simulation<'_>) {
    simulation.order(START);
    simulation.pass(Duration::from_secs(1));
}

fn answers(simulation: &Simulation<'_>) -> Vec<String> {
    simulation.story(&["operator"])
}

#[test]
fn three_missions_are_flown_one_after_the_other() {
    let mut simulation = started();
    flies_to_its_end(&mut simulation, v1::MissionOutcome::Success);
    for number in [1, 2] {
        simulation.ask(hop(number));
        simulation.pass(LIMIT);
        assert!(simulation.is_on_ground(), "it waits for an order, however long");
        assert_eq!(simulation.reason_to_stay(), "waits for an operator");
        start(&mut simulation);
        flies_to_its_end(&mut simulation, v1::MissionOutcome::Success);
        let report = simulation.report().expect("a report of its own");
        let names: Vec<_> = report.objectives.iter().map(|it| it.name.as_str()).collect();
        assert_eq!(names, ["there", "home"]);
        assert!(report.duration_s < 300.0, "of this flight alone: {report:?}");
    }
    let expected = ["anna: start: the next mission starts: `hop 1`", "anna: start: the next mission starts: `hop 2`"];
    assert_eq!(answers(&simulation), expected);
}

#[test]
fn after_an_abort_the_aborted_mission_is_not_begun_again_but_another_one_is() {
    let mut simulation = started();
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    simulation.order(Verb::Abort(v1::AbortMission { overrides: false }));
    flies_to_its_end(&mut simulation, v1::MissionOutcome::Emergency);
    start(&mut simulation);
    simulation.pass(LIMIT);
    assert!(simulation.is_on_ground());
    let refused = answers(&simulation).pop().unwrap_or_default();
    assert!(refused.ends_with("`operator_abort`: ordered by anna; upload the next mission to fly again"), "{refused}");
    simulation.ask(hop(1));
    simulation.pass(A_WHILE);
    start(&mut simulation);
    flies_to_its_end(&mut simulation, v1::MissionOutcome::Success);
}

#[test]
fn nothing_is_uploaded_for_the_next_flight_while_the_last_one_comes_down() {
    let mut simulation = started();
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    simulation.order(Verb::Return(v1::ReturnHome { overrides: false }));
    simulation.pass(A_WHILE);
    simulation.ask(hop(1));
    flies_to_its_end(&mut simulation, v1::MissionOutcome::Emergency);
    start(&mut simulation);
    simulation.pass(LIMIT);
    assert!(simulation.is_on_ground(), "{}", simulation.decision_log());
}

#[test]
fn nothing_is_uploaded_for_the_next_flight_between_the_end_of_the_last_one_and_its_report() {
    let mut simulation = started();
    assert!(simulation.fly_until("every objective was achieved", LIMIT));
    simulation.ask(hop(1));
    flies_to_its_end(&mut simulation, v1::MissionOutcome::Success);
    let report = simulation.report().expect("a report");
    let objectives: Vec<_> = report.objectives.iter().map(|it| it.name.as_str()).collect();
    assert_eq!(objectives, ["deliver", "return"], "the flown ones");
    simulation.ask(hop(2));
    simulation.pass(A_WHILE);
    start(&mut simulation);
    flies_to_its_end(&mut simulation, v1::MissionOutcome::Success);
    assert_eq!(answers(&simulation), ["anna: start: the next mission starts: `hop 2`"]);
}

#[test]
fn a_vehicle_that_fell_starts_only_after_an_inspection() {
    let mut simulation = started();
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    simulation.pass(A_WHILE);
    simulation.inject_fault("flight_termination", &[]);
    flies_to_its_end(&mut simulation, v1::MissionOutcome::Crash);
    let report = simulation.report().expect("a report");
    assert!(report.reason.starts_with("`crashed`: the motors were stopped at 10 m: it fell; "), "{}", report.reason);
    // The damage does not show in flight: it would arm.
    simulation.inject_fault("clear", &[]);
    simulation.ask(hop(1));
    simulation.pass(A_WHILE);
    for order in [START, Verb::Resume(v1::ResumeMission {})] {
        simulation.order(order);
        simulation.pass(A_WHILE);
        let refused = answers(&simulation).pop().unwrap_or_default();
        assert!(refused.contains("refused: the mission is over: `crashed`: the motors were stopped"), "{refused}");
    }
    simulation.order(Verb::Inspected(v1::Inspected {}));
    simulation.pass(A_WHILE);
    assert!(simulation.is_on_ground(), "the order starts nothing");
    start(&mut simulation);
    flies_to_its_end(&mut simulation, v1::MissionOutcome::Success);
}

/// It was answered, and the flag was taken down with the landing: what raised it is not over by that.
#[test]
fn what_the_monitor_still_reports_after_it_was_answered_counts_for_the_next_flight() {
    let mut simulation = started();
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    simulation.inject_fault("motor_failure", &[]);
    flies_to_its_end(&mut simulation, v1::MissionOutcome::Emergency);
    simulation.ask(hop(1));
    simulation.pass(A_WHILE);
    start(&mut simulation);
    simulation.pass(Duration::from_secs(120));
    let log = simulation.decision_log();
    assert!(simulation.is_on_ground() && !log.contains("step 1 of 3"), "{log}");
    assert_eq!(simulation.report().map(|it| it.outcome()), Some(v1::MissionOutcome::Emergency), "{log}");
    // Repaired, it flies what is uploaded then.
    simulation.inject_fault("motor_failure", &["0"]);
    simulation.ask(hop(2));
    simulation.pass(A_WHILE);
    start(&mut simulation);
    flies_to_its_end(&mut simulation, v1::MissionOutcome::Success);
}

#[test]
fn what_keeps_a_vehicle_on_the_ground_keeps_it_there_before_the_next_flight() {
    let mut simulation = started();
    flies_to_its_end(&mut simulation, v1::MissionOutcome::Success);
    simulation.ask(hop(1));
    simulation.inject_fault("battery_temperature", &["70"]);
    simulation.pass(A_WHILE);
    start(&mut simulation);
    simulation.pass(Duration::from_secs(60));
    assert!(simulation.is_on_ground(), "{}", simulation.decision_log());
    simulation.inject_fault("battery_temperature", &["20"]);
    flies_to_its_end(&mut simulation, v1::MissionOutcome::Success);
}
