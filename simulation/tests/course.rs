//! Cases of the contingency table about how the flight goes on, as whole flights: beside its way, too slow, too long, with nothing to fly,
//! unrecorded, by a clock that was set. The fault, the flag with its values, the response, the outcome.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::operator_command::Verb;
use kittiwake_proto::v1::{self, Decision, MissionOutcome};
use simulation::Simulation;

use crate::stories::support::story::{LIMIT, ends, s, when};
use crate::stories::support::{config_with, mission_file, simulation, simulation_of};

/// An objective on the ground so far to the east.
fn objective(east_m: f64) -> String {
    format!("[[objective]]\nname = \"end\"\nnorth_m = 0.0\neast_m = {east_m:.1}\nheight_m = 0.0\nflying = false\n")
}

/// One in the air.
fn flying(name: &str, east_m: f64) -> String {
    format!("[[objective]]\nname = \"{name}\"\nnorth_m = 0.0\neast_m = {east_m:.1}\nheight_m = 10.0\nflying = true\n")
}

#[test]
fn who_is_led_beside_its_way_is_told_of_and_flies_on_to_its_place() {
    let mut simulation = when("step 3 of 5");
    simulation.inject_fault("steering_error", &["60", "0"]);
    assert!(
        simulation.fly_until("flag `path_deviated` raised: path.deviation_m 2", s(60)),
        "{}",
        simulation.decision_log()
    );
    simulation.inject_fault("steering_error", &["0", "0"]);
    let expected = ["`path_deviated` is over", "every objective is settled"];
    ends(simulation, MissionOutcome::Success, &expected);
}

#[test]
fn a_leg_that_takes_too_long_is_told_and_flown_to_its_end() {
    // 55 % of the speed that is asked for.
    let mut simulation =
        simulation(Some(&mission_file("slow", &format!("name = \"slow\"\n{}", objective(1000.0)))), Policy::Grant);
    simulation.inject_fault("slow_flight", &["5.5"]);
    let expected = [
        "flag `skill_overruns` raised: skill.pace_percent 5",
        "`skill_overruns` is over",
        "every objective is settled",
    ];
    ends(simulation, MissionOutcome::Success, &expected);
}

#[test]
fn a_return_at_a_quarter_of_its_speed_is_reported_and_not_given_up() {
    let text = format!("name = \"slow\"\n{}{}", flying("out", 600.0), objective(0.0));
    let mut simulation = simulation(Some(&mission_file("slow-return", &text)), Policy::Grant);
    while simulation.position().is_none_or(|it| it.east_m < 500.0) {
        simulation.pass(s(1));
    }
    simulation.inject_fault("slow_flight", &["2.5"]);
    simulation.order(Verb::Return(v1::ReturnHome { overrides: false }));
    let expected = ["`operator_return`: return_home", "flag `skill_overruns` raised: skill.pace_percent "];
    ends(&mut simulation, MissionOutcome::Emergency, &expected);
    let log = simulation.decision_log();
    assert!(!log.contains("failed (try") && simulation.position().is_some_and(|it| it.east_m < 5.0), "{log}");
}

#[test]
fn while_a_plan_waits_for_approval_the_vehicle_rests() {
    let config =
        config_with("approved", &[("plan_approval", "\"each-plan\""), ("plan_approval_default", "\"approve\"")]);
    let text = format!("name = \"far\"\n{}{}", flying("out", 1500.0), objective(0.0));
    let mut simulation = simulation_of(&config, Some(&mission_file("far", &text)), Policy::Grant);
    while simulation.position().is_none_or(|it| it.east_m < 300.0) {
        simulation.pass(s(1));
    }
    // Another mission, in the other direction.
    let text = format!("name = \"back\"\n{}{}", flying("back", -200.0), objective(0.0));
    simulation.ask(v1::mission_request::Request::Upload(v1::MissionText { text, wind: None }));
    simulation.pass(s(15));
    let [before, after] = [0, 40].map(|more_s| {
        simulation.pass(s(more_s));
        simulation.position().expect("it flies").east_m
    });
    assert!((before - after).abs() < 2.0 && after < 350.0, "{before} m, {after} m:\n{}", simulation.decision_log());
    ends(
        simulation,
        MissionOutcome::Success,
        &["waits for approval", "waits for approval", "every objective is settled"],
    );
}

#[test]
fn in_the_air_for_an_hour_it_comes_home() {
    // An hour at the shipped rates takes a minute of a processor.
    let config = config_with("hour", &[("introspection_rate_hz", "10.0"), ("tick_period_ms", "100.0")]);
    let mission = crate::stories::support::config().join("missions/reference.toml");
    let mut simulation = simulation_of(&config, Some(&mission), Policy::Grant);
    assert!(simulation.fly_until("step 3 of 5", LIMIT), "{}", simulation.decision_log());
    // A battery that would last for a day, and a crew that pauses again and again.
    simulation.inject_fault("drain", &["0.05"]);
    let flown_since = simulation.now();
    while simulation.now() - flown_since < s(3590) {
        simulation.order(Verb::Pause(v1::PauseMission { overrides: false }));
        simulation.pass(s(300));
        simulation.order(Verb::Resume(v1::ResumeMission {}));
        simulation.pass(Duration::from_millis(500));
    }
    let expected = ["flag `flight_too_long` raised: flight.time_s 36", "`flight_too_long`: return_home"];
    ends(simulation, MissionOutcome::Emergency, &expected);
}

/// Beside its place in the air, with every way out closed until 460 s.
fn closed_in() -> Simulation<'static> {
    // A ring round the take-off point that is closed four times, each time before it is open again.
    // The end is optional: no mission takes off whose required objective is closed for five minutes.
    let mut text = format!("{}{}optional = true\nworth = 1.0\n", flying("near", 30.0), objective(600.0));
    for (number, (from_s, until_s)) in [(20, 130), (125, 240), (235, 350), (345, 460)].into_iter().enumerate() {
        for (side, (south, north, west, east)) in
            [(-200, 200, -220, -200), (-200, 200, 300, 320), (200, 220, -220, 320), (-220, -200, -220, 320)]
                .into_iter()
                .enumerate()
        {
            text += &format!(
                "[[area]]\nname = \"ring-{number}-{side}\"\nkind = \"keep-out\"\n\
                 corners_m = [[{south}, {west}], [{north}, {west}], [{north}, {east}], [{south}, {east}]]\n\
                 from_utc = \"2026-01-01T00:{:02}:{:02}Z\"\nuntil_utc = \"2026-01-01T00:{:02}:{:02}Z\"\n",
                from_s / 60,
                from_s % 60,
                until_s / 60,
                until_s % 60
            );
        }
    }
    simulation(Some(&mission_file("closed", &format!("name = \"closed\"\n{text}"))), Policy::Grant)
}

#[test]
fn with_every_way_closed_it_waits_as_long_as_the_battery_lasts_for_it() {
    let expected = ["hold for ", "every objective is settled"];
    ends(closed_in(), MissionOutcome::Success, &expected);
    let mut short = closed_in();
    assert!(short.fly_until("hold for ", LIMIT), "{}", short.decision_log());
    short.inject_fault("battery", &["0.3"]);
    let expected = ["hold for ", "flag `no_plan` raised: plan.awaited_s ", "`no_plan`: return_home"];
    ends(&mut short, MissionOutcome::Emergency, &expected);
    let charge = short.charge().expect("a battery");
    assert!(0.25 < charge, "it has its reserve: {charge}");
}

#[test]
fn a_stay_that_the_mission_asks_for_is_no_wait_for_a_plan() {
    let text = format!("name = \"stay\"\n{}dwell_s = 400.0\n{}", flying("watch", 100.0), objective(0.0));
    let mut simulation = simulation(Some(&mission_file("stay", &text)), Policy::Grant);
    // The witness takes a stay of that length for a vehicle that nobody leads: it does not hear of stays.
    let report = simulation.fly(LIMIT).expect("the mission to end");
    let log = simulation.decision_log();
    assert_eq!(report.outcome(), MissionOutcome::Success, "{log}");
    assert!(log.contains("hold for 400 s") && !log.contains("`no_plan`"), "{log}");
}

#[test]
fn a_border_that_closed_in_front_of_it_is_flown_round_once_it_has_stopped() {
    // Area A of the reference mission begins 110 m to the east; at 10 m/s the way to rest is 17 m.
    let mut simulation = simulation(None, Policy::Grant);
    while simulation.position().is_none_or(|it| it.east_m < 95.0) {
        simulation.pass(Duration::from_millis(50));
    }
    simulation.decide("A", Decision::Deny);
    let expected =
        ["flag `area_ahead` raised: at ", "`area_ahead`: stop", "`area_ahead` is over", "every objective is settled"];
    ends(simulation, MissionOutcome::Success, &expected);
}

#[test]
fn a_landing_waits_until_a_ship_below_has_passed() {
    let mut simulation = when("step 5 of 5: land");
    // It crosses the landing place from north to south, 5 m/s.
    simulation.inject_fault("intruder", &["60", "500", "0", "-5", "0", "vessel"]);
    let expected = [
        "flag `vessel_near` raised: traffic.vessel_approach_m ",
        "`vessel_near`: avoid",
        "`vessel_near` is over",
        "every objective is settled",
    ];
    ends(simulation, MissionOutcome::Success, &expected);
}

#[test]
fn a_clock_that_was_set_is_told_and_lets_no_area_be_entered_for_a_while() {
    let mut simulation = when("step 2 of 5");
    simulation.set_clock(90_000);
    let expected =
        ["flag `clock_jumped` raised: clock.step_s 90.", "`clock_jumped` is over", "every objective is settled"];
    ends(simulation, MissionOutcome::Success, &expected);
}

#[test]
fn who_is_led_to_the_fence_stops_before_it_and_flies_on() {
    let text = format!(
        "name = \"fenced\"\n[volume]\ncorners_m = [[-60.0, -60.0], [60.0, -60.0], [60.0, 460.0], [-60.0, 460.0]]\nceiling_m = 40.0\n{}{}",
        flying("out", 400.0),
        objective(0.0)
    );
    let mut simulation = simulation(Some(&mission_file("fenced", &text)), Policy::Grant);
    assert!(simulation.fly_until("step 2 of", LIMIT), "{}", simulation.decision_log());
    simulation.inject_fault("steering_error", &["90", "0"]);
    assert!(simulation.fly_until("flag `area_ahead` raised", s(120)), "{}", simulation.decision_log());
    simulation.inject_fault("steering_error", &["0", "0"]);
    let expected = ["inside area volume", "`area_ahead`: stop", "`area_ahead` is over", "every objective is settled"];
    ends(simulation, MissionOutcome::Success, &expected);
}
