//! Somebody else flies: a pilot or another ground station takes over; or the autopilot does, by its own failsafe. It would not arm, its
//! frame moves, or it is started again.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1;
use simulation::{Memory, Simulation};
use v1::operator_command::Verb;

use crate::stories::support::sample;

const LIMIT: Duration = Duration::from_secs(1200);

fn resume() -> Verb {
    Verb::Resume(v1::ResumeMission {})
}

/// Flies until the decision, and some seconds more.
#[track_caller]
fn at(decision: &str, more_s: u64) -> Simulation<'static> {
    let mut simulation = crate::stories::support::simulation(None, Policy::Grant);
    assert!(simulation.fly_until(decision, LIMIT), "{decision}");
    simulation.pass(Duration::from_secs(more_s));
    simulation
}

/// Nothing is commanded for a minute, and the flag is up.
#[track_caller]
fn is_quiet(simulation: &mut Simulation<'_>) {
    assert!(simulation.fly_until("flag `somebody_else_flies` raised", Duration::from_secs(5)));
    simulation.pass(Duration::from_secs(60));
    assert_eq!(simulation.responder(), "somebody_else_flies", "\n{}", simulation.decision_log());
    assert_eq!(simulation.breaches(), [], "\n{}", simulation.decision_log());
}

/// These processes die, and are started again with what they had saved.
fn restart(simulation: &mut Simulation<'_>, dead: &[&str]) {
    for process in dead {
        simulation.restart(process, Duration::from_millis(400), Memory::Restored);
    }
}

/// How far the vehicle is from here a minute later, over ground in metres.
fn moves_in_a_minute(simulation: &mut Simulation<'_>) -> f64 {
    let from = simulation.position().unwrap();
    simulation.pass(Duration::from_secs(60));
    let to = simulation.position().unwrap();
    (to.north_m - from.north_m).hypot(to.east_m - from.east_m)
}

#[test]
fn a_pilot_who_takes_over_in_any_phase_is_not_fought() {
    #[track_caller]
    fn check(decision: &str, more_s: u64) {
        let mut simulation = at(decision, more_s);
        simulation.inject_fault("pilot_takes_over", &["manual"]);
        is_quiet(&mut simulation);
    }
    check("step 1 of", 6);
    check("step 2 of", 10);
    check("step 4 of 5", 10);
    check("step 5 of 5", 5);
}

#[test]
fn an_operator_who_resumes_takes_the_vehicle_back_and_the_mission_goes_on() {
    let mut simulation = at("step 4 of 5", 10);
    simulation.inject_fault("pilot_takes_over", &["manual"]);
    is_quiet(&mut simulation);
    simulation.order(resume());
    let report = simulation.fly(LIMIT).expect("a report");
    assert_eq!(report.outcome(), v1::MissionOutcome::Success, "\n{}", simulation.decision_log());
    assert_eq!(simulation.breaches(), [], "\n{}", simulation.decision_log());
}

#[test]
fn a_mode_that_a_pilot_has_left_on_the_ground_is_nobodys_flight() {
    let mut simulation = crate::stories::support::simulation(None, Policy::Grant);
    simulation.inject_fault("pilot_takes_over", &["manual"]);
    let report = simulation.fly(LIMIT).expect("a report");
    assert_eq!(report.outcome(), v1::MissionOutcome::Success, "\n{}", simulation.decision_log());
}

#[test]
fn after_a_pilots_landing_an_operator_must_resume() {
    let mut simulation = at("step 4 of 5", 10);
    simulation.inject_fault("pilot_takes_over", &["land"]);
    assert!(simulation.fly_until("flag `somebody_else_flies` raised", Duration::from_secs(5)));
    assert!(simulation.fly_until("the vehicle is on the ground, with its motors off", LIMIT));
    simulation.pass(Duration::from_secs(60));
    assert!(simulation.is_on_ground(), "nothing takes off by itself\n{}", simulation.decision_log());
    simulation.order(resume());
    assert!(simulation.fly(LIMIT).is_some(), "\n{}", simulation.decision_log());
    assert_eq!(simulation.breaches(), []);
}

#[test]
fn not_even_an_empty_battery_fights_a_pilot_and_an_order_does() {
    let mut simulation = at("step 4 of 5", 10);
    simulation.inject_fault("battery", &["0.24"]);
    assert!(simulation.fly_until("`battery_low`: divert", LIMIT), "\n{}", simulation.decision_log());
    // Not before the command of the diversion itself: the last commander has the vehicle.
    simulation.pass(Duration::from_secs(3));
    simulation.inject_fault("pilot_takes_over", &["hold"]);
    is_quiet(&mut simulation);
    simulation.order(Verb::Return(v1::ReturnHome { overrides: false }));
    simulation.fly(LIMIT).expect("a report");
    assert!(simulation.is_on_ground(), "\n{}", simulation.decision_log());
    assert_eq!(simulation.breaches(), [], "\n{}", simulation.decision_log());
}

#[test]
fn a_pilot_who_takes_over_while_the_skill_manager_hangs_is_not_fought_when_it_is_back() {
    let mut simulation = at("step 4 of 5", 5);
    simulation.freeze("skill-manager", Duration::from_secs(3));
    simulation.inject_fault("pilot_takes_over", &["manual"]);
    is_quiet(&mut simulation);
}

#[test]
fn a_pilot_who_has_the_vehicle_is_not_fought_by_processes_that_are_started_again() {
    #[track_caller]
    fn check(dies: impl FnOnce(&mut Simulation<'_>)) {
        let mut simulation = at("step 4 of 5", 10);
        // In a mode that Kittiwake commands, too.
        simulation.inject_fault("pilot_takes_over", &["hold"]);
        assert!(simulation.fly_until("flag `somebody_else_flies` raised", Duration::from_secs(5)));
        dies(&mut simulation);
        simulation.pass(Duration::from_secs(60));
        assert_eq!(simulation.responder(), "somebody_else_flies", "\n{}", simulation.decision_log());
        assert_eq!(simulation.breaches(), [], "\n{}", simulation.decision_log());
        simulation.order(resume());
        simulation.pass(Duration::from_secs(10));
        assert!(!simulation.is_up("somebody_else_flies"), "\n{}", simulation.decision_log());
    }
    check(|it| restart(it, &["mcm"]));
    check(|it| it.restart("mcm", Duration::from_millis(400), Memory::Lost));
    check(|it| restart(it, &["skill-manager"]));
    check(|it| restart(it, &["mcm", "skill-manager"]));
}

#[test]
fn an_area_that_is_revoked_does_not_fight_a_pilot() {
    let mut simulation = at("step 4 of 5", 12);
    simulation.inject_fault("pilot_takes_over", &["hold"]);
    simulation.decide("B", v1::Decision::Revoke);
    is_quiet(&mut simulation);
}

#[test]
fn a_failsafe_of_the_autopilot_is_left_alone_until_an_operator_resumes() {
    let mut simulation = at("step 4 of 5", 5);
    simulation.inject_fault("autopilot_failsafe", &["hold", "geofence"]);
    assert!(simulation.fly_until("geofence", Duration::from_secs(5)), "\n{}", simulation.decision_log());
    simulation.pass(Duration::from_secs(10));
    assert_eq!(simulation.responder(), "autopilot_preempts", "\n{}", simulation.decision_log());
    simulation.order(resume());
    let report = simulation.fly(LIMIT).expect("a report");
    assert_eq!(report.outcome(), v1::MissionOutcome::Success, "\n{}", simulation.decision_log());
}

#[test]
fn a_failsafe_that_begins_while_processes_are_dead_is_left_alone_by_those_who_come_back() {
    #[track_caller]
    fn check(dead: &[&str]) {
        let mut simulation = at("step 4 of 5", 5);
        restart(&mut simulation, dead);
        simulation.inject_fault("autopilot_failsafe", &["hold", "geofence"]);
        simulation.pass(Duration::from_secs(10));
        let moved_m = moves_in_a_minute(&mut simulation);
        assert_eq!(simulation.responder(), "autopilot_preempts", "{dead:?}\n{}", simulation.decision_log());
        assert!(moved_m < 2.0, "{dead:?}: {moved_m} m\n{}", simulation.decision_log());
    }
    check(&["mcm"]);
    check(&["monitor"]);
    check(&["skill-manager"]);
    check(&["planner", "skill-manager"]);
    check(&["mcm", "monitor"]);
    check(&["mcm", "monitor", "skill-manager"]);
    check(&["mcm", "monitor", "planner", "skill-manager"]);
}

/// The next thing that goes wrong, or an order from before, is no reason to end it.
#[test]
fn a_failsafe_that_begins_while_something_else_is_answered_is_left_alone_as_long_as_it_lasts() {
    #[track_caller]
    fn check(before: impl Fn(&mut Simulation<'_>), after_ms: u64) {
        let mut simulation = at("step 4 of 5", 5);
        before(&mut simulation);
        simulation.pass(Duration::from_millis(after_ms));
        simulation.inject_fault("autopilot_failsafe", &["hold", "geofence"]);
        simulation.pass(Duration::from_secs(10));
        let moved_m = moves_in_a_minute(&mut simulation);
        let log = || format!("{after_ms} ms\n{}", simulation.decision_log());
        assert!(moved_m < 2.0, "{moved_m} m, {}", log());
        assert!(simulation.is_up("autopilot_preempts"), "{}", log());
        assert!(!simulation.is_on_ground(), "{}", log());
    }
    for after_ms in sample([0, 20, 100, 500, 1000, 2000, 3000, 5000]) {
        check(|it| it.inject_flag("obstacle"), after_ms);
        check(|it| it.inject_flag("wind_too_strong"), after_ms);
        check(|it| it.order(Verb::Pause(v1::PauseMission { overrides: false })), after_ms);
        check(|it| it.order(Verb::Return(v1::ReturnHome { overrides: false })), after_ms);
        check(
            |it| {
                it.order(Verb::Pause(v1::PauseMission { overrides: false }));
                it.pass(Duration::from_secs(10));
                it.order(resume());
            },
            after_ms,
        );
    }
}

/// However long it lasts: what is asked for, the mission or a response, is flown once it is over.
#[test]
fn what_a_failsafe_interrupts_is_flown_once_it_is_over() {
    #[track_caller]
    fn check(before: impl Fn(&mut Simulation<'_>), lasts_s: u64, outcome: v1::MissionOutcome) {
        let mut simulation = at("step 4 of 5", 5);
        before(&mut simulation);
        simulation.pass(Duration::from_secs(2));
        simulation.inject_fault("autopilot_failsafe", &["hold", "geofence"]);
        simulation.pass(Duration::from_secs(lasts_s));
        simulation.inject_fault("autopilot_failsafe", &["off"]);
        let report = simulation.fly(LIMIT).expect("a report");
        let log = || format!("{lasts_s} s\n{}", simulation.decision_log());
        assert_eq!(report.outcome(), outcome, "{}", log());
        let at = simulation.position().unwrap();
        assert!(simulation.is_on_ground() && at.north_m.hypot(at.east_m) < 5.0, "{at:?}, {}", log());
    }
    use v1::MissionOutcome::{Emergency, Success};
    for lasts_s in sample([1, 5, 30, 120]) {
        check(|_| (), lasts_s, Success);
        check(|it| it.inject_flag("obstacle"), lasts_s, Success);
        check(|it| it.inject_flag("wind_too_strong"), lasts_s, Emergency);
        check(|it| it.inject_fault("battery", &["0.24"]), lasts_s, Emergency);
        check(|it| it.order(Verb::Return(v1::ReturnHome { overrides: false })), lasts_s, Emergency);
    }
}

/// An interruption is not a failure of what is flown, however often it happens.
#[test]
fn failsafes_one_after_the_other_cost_a_response_time_and_nothing_else() {
    #[track_caller]
    fn check(before: impl Fn(&mut Simulation<'_>), gap_s: u64) {
        let mut simulation = at("step 4 of 5", 10);
        before(&mut simulation);
        for _ in 0..5 {
            simulation.pass(Duration::from_secs(gap_s));
            simulation.inject_fault("autopilot_failsafe", &["hold", "geofence"]);
            simulation.pass(Duration::from_secs(3));
            simulation.inject_fault("autopilot_failsafe", &["off"]);
        }
        simulation.fly(LIMIT).expect("a report");
        let at = simulation.position().unwrap();
        let is_home = simulation.is_on_ground() && at.north_m.hypot(at.east_m) < 5.0;
        assert!(is_home, "{gap_s} s: {at:?}\n{}", simulation.decision_log());
    }
    for gap_s in sample([1, 2, 4]) {
        check(|it| it.inject_flag("wind_too_strong"), gap_s);
        check(|it| it.inject_fault("battery", &["0.24"]), gap_s);
        check(|it| it.order(Verb::Return(v1::ReturnHome { overrides: false })), gap_s);
    }
}

/// The reference mission with a crowd below, from 110 to 400 m to the east.
const CROWD: &str = r#"
    name = "crowd"
    [[objective]]
    name = "deliver"
    north_m = 0.0
    east_m = 500.0
    height_m = 0.0
    flying = false
    [[area]]
    name = "crowd"
    kind = "no-landing"
    corners_m = [[-60.0, 110.0], [60.0, 110.0], [60.0, 400.0], [-60.0, 400.0]]
"#;

#[test]
fn a_landing_that_flies_aside_goes_on_aside_after_a_failsafe() {
    let mission = crate::stories::support::mission_file("crowd", CROWD);
    let check = |before: fn(&mut Simulation<'_>), after_s: f64, lasts_s: f64| {
        let mut simulation = crate::stories::support::simulation(Some(&mission), Policy::Grant);
        simulation.pass(Duration::from_secs(33));
        before(&mut simulation);
        simulation.pass(Duration::from_secs_f64(after_s));
        simulation.inject_fault("autopilot_failsafe", &["hold", "geofence"]);
        simulation.pass(Duration::from_secs_f64(lasts_s));
        simulation.inject_fault("autopilot_failsafe", &["off"]);
        simulation.fly(LIMIT).expect("a report");
        let at = simulation.position().unwrap();
        let is_aside = 60.0 < at.north_m.abs() || at.east_m < 110.0 || 400.0 < at.east_m;
        let log = || format!("{after_s} s, {lasts_s} s: {at:?}\n{}", simulation.decision_log());
        assert!(simulation.is_on_ground() && is_aside, "{}", log());
    };
    for (after_s, lasts_s) in sample([(0.2, 1.0), (1.0, 4.0), (2.0, 1.0), (3.0, 8.0), (5.0, 4.0)]) {
        check(|it| it.inject_fault("battery", &["0.09"]), after_s, lasts_s);
        check(|it| it.order(Verb::Abort(v1::AbortMission { overrides: false })), after_s, lasts_s);
    }
}

#[test]
fn an_autopilot_that_returns_by_itself_is_left_alone_until_it_has_landed() {
    let mut simulation = at("step 4 of 5", 5);
    simulation.inject_fault("autopilot_failsafe", &["return", "the ground is not heard"]);
    assert!(simulation.fly_until("`autopilot_comes_down`: let_autopilot_fly", Duration::from_secs(5)));
    assert!(simulation.fly_until("landed because of `autopilot_comes_down`", LIMIT) || simulation.is_on_ground());
    let at = simulation.position().unwrap();
    assert!(at.north_m.hypot(at.east_m) < 5.0, "{at:?}\n{}", simulation.decision_log());
}

#[test]
fn nothing_takes_off_until_the_autopilot_would_arm() {
    let mut simulation = crate::stories::support::simulation(None, Policy::Grant);
    simulation.inject_fault("not_ready", &["compass not calibrated"]);
    assert!(simulation.fly_until("compass not calibrated", Duration::from_secs(10)), "\n{}", simulation.decision_log());
    simulation.pass(Duration::from_secs(30));
    assert!(simulation.is_on_ground());
    simulation.inject_fault("not_ready", &[]);
    let report = simulation.fly(LIMIT).expect("a report");
    assert_eq!(report.outcome(), v1::MissionOutcome::Success, "\n{}", simulation.decision_log());
}

#[test]
fn a_vehicle_whose_frame_has_moved_holds_and_lands_where_it_is_by_an_order() {
    for (fault, arguments) in [("frame_jump", &["300", "0", "-5"][..]), ("restart_autopilot", &["holds"][..])] {
        let mut simulation = at("step 4 of 5", 5);
        simulation.inject_fault(fault, arguments);
        assert!(simulation.fly_until("flag `frame_moved` raised", Duration::from_secs(5)), "{fault}");
        simulation.pass(Duration::from_secs(20));
        assert_eq!(simulation.responder(), "frame_moved", "\n{}", simulation.decision_log());
        simulation.order(Verb::Abort(v1::AbortMission { overrides: false }));
        simulation.fly(LIMIT).expect("a report");
        assert!(simulation.is_on_ground(), "\n{}", simulation.decision_log());
    }
}
