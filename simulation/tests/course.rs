//! Cases of the contingency table about how the flight goes on, as whole flights: beside its way, too slow, too long, with nothing to fly,
//! unrecorded, by a clock that was set. The fault, the flag with its values, the response, the outcome.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::operator_command::Verb;
use kittiwake_proto::v1::{self, Decision, MissionOutcome};

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
fn who_is_led_beside_its_way_holds_and_flies_on_from_where_it_is() {
    let mut simulation = when("step 3 of 5");
    simulation.inject_fault("steering_error", &["60", "0"]);
    assert!(
        simulation.fly_until("flag `path_deviated` raised: path.deviation_m 2", s(60)),
        "{}",
        simulation.decision_log()
    );
    simulation.inject_fault("steering_error", &["0", "0"]);
    let expected = ["`path_deviated`: stop", "`path_deviated` is over", "every objective is settled"];
    ends(simulation, MissionOutcome::Success, &expected);
}

#[test]
fn a_leg_that_takes_too_long_is_told_and_flown_to_its_end() {
    // A kilometre takes 100 s at 10 m/s, 182 s at 5.5 m/s, and counts as timed out after 220 s.
    let mut simulation =
        simulation(Some(&mission_file("slow", &format!("name = \"slow\"\n{}", objective(1000.0)))), Policy::Grant);
    simulation.inject_fault("slow_flight", &["5.5"]);
    let expected = [
        "flag `skill_overruns` raised: skill.overrun_percent ",
        "`skill_overruns` is over",
        "every objective is settled",
    ];
    ends(simulation, MissionOutcome::Success, &expected);
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

#[test]
fn with_every_way_closed_for_five_minutes_it_gives_the_mission_up() {
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
    let simulation = simulation(Some(&mission_file("closed", &format!("name = \"closed\"\n{text}"))), Policy::Grant);
    let expected = ["hold for ", "flag `no_plan` raised: plan.awaited_s 300.", "`no_plan`: return_home"];
    ends(simulation, MissionOutcome::Emergency, &expected);
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
        "`vessel_near`: stop",
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
