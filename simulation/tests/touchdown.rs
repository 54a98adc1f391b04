//! Between standing and flying: what happens while a landing touches the ground, or a takeoff has hardly left it, lifts nothing off.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::mission_request::Request as Ask;
use kittiwake_proto::v1::operator_command::Verb;
use kittiwake_proto::v1::{self, Decision, MissionOutcome};
use simulation::{Memory, Simulation};

use crate::stories::support::{config, each, sample, simulation};

const LIMIT: Duration = Duration::from_secs(2400);
const PAUSE: Verb = Verb::Pause(v1::PauseMission { overrides: false });
const RETURN: Verb = Verb::Return(v1::ReturnHome { overrides: false });
const REPLAN: Verb = Verb::Replan(v1::ReplanMission {});
const RESUME: Verb = Verb::Resume(v1::ResumeMission {});

/// The reference mission, from this step on when the vehicle is as high as `is_there` wants it.
#[track_caller]
fn when(step: &str, is_there: impl Fn(f64) -> bool) -> Simulation<'static> {
    let mut simulation = simulation(None, Policy::Grant);
    assert!(simulation.fly_until(step, LIMIT), "{}", simulation.decision_log());
    while !simulation.position().is_some_and(|it| is_there(-it.down_m)) {
        simulation.pass(Duration::from_millis(50));
        assert!(simulation.now().as_secs_f64() < 900.0, "it never gets there:\n{}", simulation.decision_log());
    }
    simulation
}

/// The greatest height in this time.
fn highest_m(simulation: &mut Simulation<'_>, time: Duration) -> f64 {
    let end = simulation.now() + time;
    let mut highest_m = f64::MIN;
    while simulation.now() < end {
        simulation.pass(Duration::from_millis(200));
        highest_m = simulation.position().map_or(highest_m, |it| highest_m.max(-it.down_m));
    }
    highest_m
}

type Happens = fn(&mut Simulation<'_>);

/// The same mission once more.
fn upload(simulation: &mut Simulation<'_>) {
    let text = std::fs::read_to_string(config().join("missions/reference.toml")).unwrap();
    simulation.ask(Ask::Upload(v1::MissionText { text, wind: None }));
}

/// What calls for a flight elsewhere, or for a hover.
const HAPPENINGS: [(&str, Happens); 9] = [
    ("the area is closed", |it| it.decide("B", Decision::Revoke)),
    ("a pause, and the area is closed", |it| {
        it.order(PAUSE);
        it.decide("B", Decision::Revoke);
    }),
    ("a pause, and the area is closed later", |it| {
        it.order(PAUSE);
        it.pass(Duration::from_secs(15));
        it.decide("B", Decision::Revoke);
    }),
    ("a pause, and a low battery later", |it| {
        it.order(PAUSE);
        it.pass(Duration::from_secs(15));
        it.inject_fault("battery", &["0.24"]);
    }),
    ("another plan, and the area is closed", |it| {
        it.order(REPLAN);
        it.decide("B", Decision::Revoke);
    }),
    ("another mission, and the area is closed", |it| {
        upload(it);
        it.decide("B", Decision::Revoke);
    }),
    ("a low battery", |it| it.inject_fault("battery", &["0.24"])),
    ("an order to land elsewhere", |it| {
        let position = Some(v1::Ned { north_m: 0.0, east_m: 300.0, down_m: 0.0 });
        it.order(Verb::LandAt(v1::LandAt { position, overrides: false }));
    }),
    ("an order to return", |it| it.order(RETURN)),
];

#[test]
fn whatever_happens_at_a_touchdown_the_vehicle_stays_down() {
    for ((what, happens), height_m) in sample(each(HAPPENINGS, [0.18, 0.05, -0.05])) {
        let mut simulation = when("step 5 of 5", |it| it < height_m);
        happens(&mut simulation);
        let highest_m = highest_m(&mut simulation, Duration::from_secs(30));
        let log = || format!("{what} at {height_m} m\n{}", simulation.decision_log());
        assert!(highest_m < 0.3 && simulation.is_on_ground(), "{highest_m} m high, {}", log());
        assert!(!log().contains("step 1 of 3: takeoff"), "{}", log());
        assert_eq!(simulation.breaches(), [], "{}", log());
    }
}

#[test]
fn a_landing_that_touches_the_ground_is_not_given_up_for_another_plan_or_mission() {
    use MissionOutcome::{Failure, Success};
    let changes: [(&str, Happens, MissionOutcome); 3] = [
        ("another plan", |it| it.order(REPLAN), Success),
        ("another mission", upload, Success),
        ("the objective is skipped", |it| it.ask(Ask::Skip(v1::SkipObjective { name: "deliver".into() })), Failure),
    ];
    for (what, change, outcome) in changes {
        let mut simulation = when("step 5 of 5", |it| it < 0.1);
        change(&mut simulation);
        // Neither a hover nor a flight: it comes down as it would have.
        let highest_m = highest_m(&mut simulation, Duration::from_millis(1400));
        let is_interrupted = simulation.decision_log().contains("transition");
        assert!(highest_m < 0.3 && !is_interrupted, "{what}: {highest_m} m\n{}", simulation.decision_log());
        let report = simulation.fly(LIMIT).expect("a report");
        let log = || format!("{what}\n{}", simulation.decision_log());
        assert_eq!(report.outcome(), outcome, "{}", log());
        assert_eq!(simulation.breaches(), [], "{}", log());
    }
}

#[test]
fn a_takeoff_that_lands_again_does_so_also_if_the_mission_manager_dies() {
    for after_ms in sample([0, 300, 600]) {
        let mut simulation = when("step 1 of 3: takeoff", |it| 0.3 < it);
        simulation.order(RETURN);
        simulation.pass(Duration::from_millis(after_ms));
        simulation.restart("mcm", Duration::from_millis(300), Memory::Restored);
        let highest_m = highest_m(&mut simulation, Duration::from_secs(60));
        let log = || format!("after {after_ms} ms\n{}", simulation.decision_log());
        assert!(highest_m < 1.8 && simulation.is_on_ground(), "{highest_m} m high, {}", log());
    }
}

#[test]
fn a_manager_that_has_lost_its_memory_at_a_touchdown_lands_and_lifts_nothing_off() {
    let happenings: [(&str, Happens); 4] = [
        ("nothing", |_| {}),
        ("a low battery", |it| it.inject_fault("battery", &["0.2"])),
        ("an order to return", |it| it.order(RETURN)),
        ("the area is closed", |it| it.decide("B", Decision::Revoke)),
    ];
    // Alone, and with those with which it may share a process.
    let (alone, onboard): (&[&str], &[&str]) = (&["mcm"], &["mcm", "skill-manager", "monitor", "planner"]);
    let deaths =
        [(alone, 0.18, 200), (alone, 0.06, 200), (alone, -0.05, 400), (onboard, 0.18, 300), (onboard, 0.05, 150)];
    for ((what, happens), (killed, height_m, dead_ms)) in sample(each(happenings, deaths)) {
        let mut simulation = when("step 5 of 5", |it| it < height_m);
        for process in killed {
            simulation.restart(process, Duration::from_millis(dead_ms), Memory::Lost);
        }
        simulation.pass(Duration::from_secs(8));
        happens(&mut simulation);
        let highest_m = highest_m(&mut simulation, Duration::from_secs(60));
        let log = || format!("{what} at {height_m} m, {killed:?}, {dead_ms} ms\n{}", simulation.decision_log());
        assert!(highest_m < 0.3 && simulation.is_on_ground(), "{highest_m} m high, {}", log());
        assert_eq!(simulation.breaches(), [], "{}", log());
    }
}

#[test]
fn whatever_happens_in_the_first_metre_of_a_takeoff_the_vehicle_lands_again() {
    let happenings: [(&str, Happens); 4] = [
        ("the area is closed", |it| it.decide("B", Decision::Revoke)),
        ("a low battery", |it| it.inject_flag("battery_low")),
        ("too much wind", |it| it.inject_flag("wind_too_strong")),
        ("an order to return", |it| it.order(RETURN)),
    ];
    for ((what, happens), height_m) in sample(each(happenings, [0.02, 0.4, 0.8])) {
        let mut simulation = when("step 1 of 3: takeoff", |it| height_m < it);
        happens(&mut simulation);
        let highest_m = highest_m(&mut simulation, Duration::from_secs(60));
        let log = || format!("{what} at {height_m} m\n{}", simulation.decision_log());
        assert!(highest_m < 1.8 && simulation.is_on_ground(), "{highest_m} m high, {}", log());
    }
}

#[test]
fn what_the_autopilot_ends_before_the_lift_off_or_at_a_touchdown_goes_on_by_an_order_alone() {
    // When it begins, and how long it lasts: until the motors are off, or not as long.
    for (mode, begins_ms, lasts_ms) in [
        ("hold", 500, 60_000),
        ("land", 1200, 60_000),
        ("land", 2200, 60_000),
        ("hold", 76_750, 60_000),
        ("hold", 77_400, 60_000),
        ("land", 1000, 5000),
        ("hold", 1900, 3000),
        ("return", 300, 4000),
        ("land", 76_300, 600),
        ("land", 76_500, 1400),
        ("land", 76_720, 1300),
    ] {
        let mut simulation = simulation(None, Policy::Grant);
        simulation.pass(Duration::from_millis(begins_ms));
        simulation.inject_fault("autopilot_failsafe", &[mode, "geofence"]);
        simulation.pass(Duration::from_millis(lasts_ms));
        simulation.inject_fault("autopilot_failsafe", &["off"]);
        let highest_m = highest_m(&mut simulation, Duration::from_secs(120));
        let log = || format!("{mode} at {begins_ms} ms for {lasts_ms} ms\n{}", simulation.decision_log());
        assert!(highest_m < 0.5 && simulation.is_on_ground(), "{highest_m} m high, {}", log());
        simulation.order(RESUME);
        let report = simulation.fly(LIMIT).expect("a report");
        assert_eq!(report.outcome(), MissionOutcome::Success, "{}", simulation.decision_log());
    }
}

#[test]
fn a_return_that_did_not_come_home_says_where_it_came_down() {
    let mut simulation = simulation(None, Policy::Grant);
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    simulation.pass(Duration::from_secs(20));
    simulation.order(RETURN);
    simulation.pass(Duration::from_secs(2));
    simulation.inject_fault("autopilot_failsafe", &["land", "geofence"]);
    let report = simulation.fly(LIMIT).expect("a report");
    let at = simulation.position().unwrap();
    let away = format!("came down {:.0} m from home", at.north_m.hypot(at.east_m));
    assert!(report.reason.contains(&away), "{away}, {}\n{}", report.reason, simulation.decision_log());
}

#[test]
fn what_the_autopilot_has_ended_stays_ended_if_its_disarming_is_rejected_or_the_skill_manager_dies() {
    let troubles: [(&str, Happens); 2] = [
        ("rejected", |it| it.inject_fault("reject_acks", &["1"])),
        ("killed", |it| it.restart("skill-manager", Duration::from_millis(300), Memory::Restored)),
    ];
    for (what, trouble) in troubles {
        for (begins_ms, lasts_ms) in [(400, 700), (1000, 700), (1700, 1700)] {
            let mut simulation = simulation(None, Policy::Grant);
            simulation.pass(Duration::from_millis(begins_ms));
            simulation.inject_fault("autopilot_failsafe", &["land", "geofence"]);
            simulation.pass(Duration::from_millis(200));
            trouble(&mut simulation);
            simulation.pass(Duration::from_millis(lasts_ms));
            simulation.inject_fault("autopilot_failsafe", &["off"]);
            let highest_m = highest_m(&mut simulation, Duration::from_secs(120));
            let log = || format!("{what}, {begins_ms} ms\n{}", simulation.decision_log());
            assert!(highest_m < 0.5 && simulation.is_on_ground(), "{highest_m} m high, {}", log());
        }
    }
}

#[test]
fn one_order_goes_on_also_while_the_failsafe_lasts() {
    let mut simulation = simulation(None, Policy::Grant);
    simulation.pass(Duration::from_millis(500));
    simulation.inject_fault("autopilot_failsafe", &["hold", "geofence"]);
    simulation.pass(Duration::from_secs(5));
    simulation.order(RESUME);
    let report = simulation.fly(LIMIT).expect("a report");
    assert_eq!(report.outcome(), MissionOutcome::Success, "{}", simulation.decision_log());
}

#[test]
fn a_pause_at_the_touchdown_of_a_return_holds_on_the_ground() {
    let mut simulation = simulation(None, Policy::Grant);
    simulation.pass(Duration::from_secs(20));
    simulation.order(RETURN);
    assert!(simulation.fly_until("`operator_return`: return_home", LIMIT), "{}", simulation.decision_log());
    simulation.pass(Duration::from_secs(3));
    while simulation.position().is_some_and(|it| 0.1 < -it.down_m) {
        simulation.pass(Duration::from_millis(50));
        assert!(simulation.now().as_secs_f64() < 900.0, "it never gets there:\n{}", simulation.decision_log());
    }
    simulation.order(PAUSE);
    simulation.pass(Duration::from_secs(8));
    assert!(simulation.is_on_ground(), "{}", simulation.decision_log());
    simulation.pass(Duration::from_secs(60));
    assert!(simulation.is_on_ground() && simulation.is_up("operator_pause"), "{}", simulation.decision_log());
}

#[test]
fn a_land_detector_that_sticks_in_the_first_metres_leaves_no_vehicle_in_the_air() {
    for begins_ms in sample([3200, 3600, 3900, 4200, 79_000]) {
        let mut simulation = simulation(None, Policy::Grant);
        simulation.pass(Duration::from_millis(begins_ms));
        simulation.inject_fault("land_detector", &["landed"]);
        simulation.pass(Duration::from_secs(60));
        simulation.inject_fault("clear", &[]);
        simulation.fly(LIMIT).expect("a report");
        simulation.pass(Duration::from_secs(30));
        let log = || format!("{begins_ms} ms\n{}", simulation.decision_log());
        assert!(simulation.is_on_ground(), "{}", log());
        assert_eq!(simulation.breaches(), [], "{}", log());
    }
}
