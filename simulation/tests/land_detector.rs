//! A land detector that is wrong or silent: the flight is known by motors, height and speed.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::operator_command::Verb;
use kittiwake_proto::v1::{self, MissionOutcome};
use simulation::Simulation;

use crate::stories::support::{each, sample, simulation};

const LIMIT: Duration = Duration::from_secs(2400);
const CONTRADICTS: &str = "flag `land_detector_contradicts` raised: the land detector is reported against motors";

/// A detector that is stuck at the ground, frozen there, or silent, each from before the takeoff.
const HIDES_THE_FLIGHT: [(&str, &str); 3] =
    [("land_detector", "landed"), ("freeze", "vehicle_land_detected"), ("drop", "vehicle_land_detected")];

/// The reference mission, with this fault from before the takeoff.
#[track_caller]
fn with_fault((name, argument): (&str, &str)) -> Simulation<'static> {
    let mut simulation = simulation(None, Policy::Grant);
    simulation.pass(Duration::from_millis(300));
    simulation.inject_fault(name, &[argument]);
    simulation
}

/// Flies to the end: on the ground, disarmed, with this outcome, and nothing forbidden on the way.
#[track_caller]
fn ends(simulation: &mut Simulation<'_>, expected: MissionOutcome) -> v1::MissionReport {
    let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no report:\n{}", simulation.decision_log()));
    let log = simulation.decision_log();
    assert_eq!(report.outcome(), expected, "{}\n{log}", report.reason);
    assert!(simulation.is_on_ground(), "when the report came:\n{log}");
    simulation.pass(Duration::from_secs(30));
    assert!(simulation.is_on_ground(), "{log}");
    assert_eq!(simulation.breaches(), [], "{log}");
    report
}

#[test]
fn with_a_detector_that_hides_the_flight_the_mission_is_flown() {
    for fault in sample(HIDES_THE_FLIGHT) {
        let mut simulation = with_fault(fault);
        ends(&mut simulation, MissionOutcome::Success);
        let is_told = simulation.decision_log().contains(CONTRADICTS);
        // One that is silent or stands still says nothing that could be wrong.
        assert_eq!(is_told, fault.0 == "land_detector", "{fault:?}\n{}", simulation.decision_log());
    }
}

#[test]
fn with_a_detector_that_hides_the_flight_each_order_is_obeyed_in_the_air() {
    const PAUSE: Verb = Verb::Pause(v1::PauseMission { overrides: false });
    let site = v1::Ned { north_m: 0.0, east_m: 60.0, down_m: 0.0 };
    let orders = [
        (Verb::Return(v1::ReturnHome::default()), "operator_return", Some(0.0)),
        (Verb::LandAt(v1::LandAt { position: Some(site), overrides: false }), "operator_land", Some(60.0)),
        (Verb::Abort(v1::AbortMission::default()), "operator_abort", None),
    ];
    for (fault, (order, answered, east_m)) in sample(each(HIDES_THE_FLIGHT, orders)) {
        let mut simulation = with_fault(fault);
        assert!(simulation.fly_until("step 2 of 5", LIMIT), "{fault:?}\n{}", simulation.decision_log());
        simulation.pass(Duration::from_secs(3));
        simulation.order(PAUSE);
        simulation.pass(Duration::from_secs(20));
        assert_eq!(simulation.responder(), "operator_pause", "{fault:?}\n{}", simulation.decision_log());
        simulation.order(order);
        simulation.pass(Duration::from_secs(1));
        assert_eq!(simulation.responder(), answered, "{fault:?}\n{}", simulation.decision_log());
        ends(&mut simulation, MissionOutcome::Emergency);
        let place = simulation.position().expect("it is heard");
        let is_there = east_m.is_none_or(|it: f64| (place.east_m - it).abs() < 3.0);
        assert!(is_there, "{fault:?} {answered} {place:?}\n{}", simulation.decision_log());
    }
}

/// An autopilot whose detector does not notice the landing does not disarm by itself.
#[test]
fn a_landing_that_the_detector_does_not_notice_ends_and_the_vehicle_is_disarmed() {
    let mut simulation = simulation(None, Policy::Grant);
    // The last landing.
    assert!(simulation.fly_until("step 3 of 3: land", LIMIT) || simulation.fly_until("fly to (0, 0, 10)", LIMIT));
    simulation.inject_fault("land_detector", &["flying"]);
    ends(&mut simulation, MissionOutcome::Success);
}

#[test]
fn a_response_ends_on_the_ground_though_the_detector_does_not_notice() {
    let mut simulation = simulation(None, Policy::Grant);
    assert!(simulation.fly_until("step 2 of 5", LIMIT));
    simulation.inject_fault("land_detector", &["flying"]);
    simulation.order(Verb::Abort(v1::AbortMission::default()));
    let before = simulation.now();
    ends(&mut simulation, MissionOutcome::Emergency);
    let took_s = simulation.now().as_secs_f64() - before.as_secs_f64();
    assert!(took_s < 120.0, "{took_s} s:\n{}", simulation.decision_log());
}

#[test]
fn nothing_takes_off_with_a_detector_that_reports_the_air_on_the_ground() {
    let mut simulation = simulation(None, Policy::Grant);
    simulation.inject_fault("land_detector", &["flying"]);
    assert!(simulation.fly_until(CONTRADICTS, LIMIT), "{}", simulation.decision_log());
    simulation.pass(Duration::from_secs(60));
    assert!(simulation.is_on_ground(), "{}", simulation.decision_log());
    simulation.inject_fault("land_detector", &["works"]);
    ends(&mut simulation, MissionOutcome::Success);
}

/// Between arming and lifting off an abort disarms, and the end waits for that.
#[test]
fn an_abort_while_the_motors_spool_up_ends_disarmed_on_the_ground() {
    for pause_ms in sample([0, 100, 300, 700, 1000, 1300, 1700]) {
        let mut simulation = simulation(None, Policy::Grant);
        assert!(simulation.fly_until("step 1 of 5", LIMIT));
        simulation.pass(Duration::from_millis(pause_ms));
        simulation.order(Verb::Abort(v1::AbortMission::default()));
        ends(&mut simulation, MissionOutcome::Emergency);
    }
}
