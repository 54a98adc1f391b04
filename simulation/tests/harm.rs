//! Flights that end with the least harm: over water, over people, and with a home that may not be entered on the way back.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::operator_command::Verb;
use kittiwake_proto::v1::{self, Decision, MissionOutcome};
use simulation::Simulation;

use crate::stories::support::{mission_file, simulation};

const LIMIT: Duration = Duration::from_secs(2400);

/// Out over ground of this kind and back home, which lies in the area `harbour`; 40 m around home are land.
fn out_and_back(name: &str, ground: &str, harbour: &str, policy: Policy) -> Simulation<'static> {
    let text = format!(
        "name = \"{name}\"\n\
         [[objective]]\nname = \"look\"\nnorth_m = 0.0\neast_m = 900.0\nheight_m = 20.0\nflying = true\n\
         [[objective]]\nname = \"home\"\nnorth_m = 0.0\neast_m = 0.0\nheight_m = 0.0\nflying = false\n\
         [[area]]\nname = \"below\"\nkind = \"no-landing\"\nground = \"{ground}\"\n\
         corners_m = [[-4000.0, -4000.0], [4000.0, -4000.0], [4000.0, 4000.0], [-4000.0, 4000.0]]\n\
         holes_m = [[[-40.0, -40.0], [40.0, -40.0], [40.0, 40.0], [-40.0, 40.0]]]\n\
         [[area]]\nname = \"harbour\"\nkind = \"permission\"\n{harbour}\n\
         corners_m = [[-60.0, -60.0], [60.0, -60.0], [60.0, 60.0], [-60.0, 60.0]]\n"
    );
    simulation(Some(&mission_file(&format!("harm-{name}"), &text)), policy)
}

#[track_caller]
fn over_the_middle(simulation: &mut Simulation<'_>) {
    while simulation.position().is_none_or(|it| it.east_m < 800.0) {
        simulation.pass(Duration::from_millis(200));
        assert!(simulation.now().as_secs_f64() < 900.0, "it never gets there:\n{}", simulation.decision_log());
    }
}

#[track_caller]
fn ends_at_home(simulation: &mut Simulation<'_>) {
    simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    let at = simulation.position().expect("a position");
    assert!(at.north_m.hypot(at.east_m) < 10.0, "{at:?}\n{}", simulation.decision_log());
}

#[test]
fn nothing_takes_off_without_the_permission_to_come_back() {
    // It begins to apply two minutes after the start: the takeoff itself needs no permission.
    let opens = "from_utc = \"2026-01-01T00:02:00Z\"";
    for (name, policy) in [("denied", Policy::Deny), ("silent", Policy::Silent)] {
        let mut simulation = out_and_back(name, "water", opens, policy);
        let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
        let log = simulation.decision_log();
        assert!(report.reason.contains("no takeoff without the permission to come back"), "{}", report.reason);
        assert!(simulation.is_on_ground() && !log.contains("step 1 of 2: takeoff"), "{log}");
    }
    let mut simulation = out_and_back("granted", "water", opens, Policy::Grant);
    let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    let log = simulation.decision_log();
    assert_eq!(report.outcome(), MissionOutcome::Success, "{log}");
    assert!(log.find("area harbour: granted") < log.find(": takeoff by"), "{log}");
}

#[test]
fn a_healthy_vehicle_whose_home_is_closed_comes_home_by_a_pilots_order() {
    let mut simulation = out_and_back("pilot", "water", "", Policy::Grant);
    over_the_middle(&mut simulation);
    simulation.decide_for("harbour", Decision::Revoke, None);
    simulation.pass(Duration::from_secs(5));
    simulation.order(Verb::Return(v1::ReturnHome { overrides: true }));
    ends_at_home(&mut simulation);
    let log = simulation.decision_log();
    assert!(log.contains("enters area harbour without permission: ordered with override"), "{log}");
    assert_eq!(simulation.breaches(), [], "{log}");
}

#[test]
fn among_people_it_does_not_come_down_and_enters_the_area_instead() {
    let mut simulation = out_and_back("people", "people", "", Policy::Grant);
    over_the_middle(&mut simulation);
    simulation.decide_for("harbour", Decision::Revoke, None);
    simulation.pass(Duration::from_secs(5));
    simulation.inject_fault("battery_temperature", &["70"]);
    ends_at_home(&mut simulation);
    let log = simulation.decision_log();
    assert!(log.contains("enters area harbour without permission: to land at home"), "{log}");
    assert_eq!(simulation.breaches(), [], "{log}");
}

#[test]
fn an_abort_over_water_says_that_it_flies_home_and_a_pilot_can_put_it_down() {
    for (name, overrides, words) in
        [("away", false, "flies to home, "), ("here", true, "lands here, where the aircraft is lost")]
    {
        let mut simulation = out_and_back(name, "water", "", Policy::Grant);
        over_the_middle(&mut simulation);
        simulation.order(Verb::Abort(v1::AbortMission { overrides }));
        simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
        let (at, log) = (simulation.position().expect("a position"), simulation.decision_log());
        assert!(log.contains(&format!("abort: {words}")), "{log}");
        assert_eq!(at.east_m < 10.0, !overrides, "{at:?}\n{log}");
    }
}
