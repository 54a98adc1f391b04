//! Cases of the contingency table about energy, traffic, wind, the frame, the ground and the crew, as whole flights: the fault, the flag
//! with its values, the response, the outcome.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::operator_command::Verb;
use kittiwake_proto::v1::{self, Decision, MissionOutcome};
use simulation::Simulation;

use crate::stories::support::story::{LIMIT, ends, s, when, when_flown};
use crate::stories::support::{config_with, mission_file, simulation, simulation_of};

/// A mission of this text, flown until `there` holds for the place.
#[track_caller]
fn flown_until(name: &str, text: &str, there: impl Fn(v1::Ned) -> bool) -> Simulation<'static> {
    let path = mission_file(name, &format!("name = \"{name}\"\n{text}"));
    let mut simulation = simulation(Some(&path), Policy::Grant);
    let begun = simulation.now();
    while !simulation.position().is_some_and(&there) {
        simulation.pass(Duration::from_millis(100));
        assert!(simulation.now() - begun < LIMIT, "it never gets there:\n{}", simulation.decision_log());
    }
    simulation
}

fn objective(name: &str, east_m: f64, height_m: f64) -> String {
    let flying = 0.0 < height_m;
    format!(
        "[[objective]]\nname = \"{name}\"\nnorth_m = 0.0\neast_m = {east_m:.1}\nheight_m = {height_m:.1}\nflying = {flying}\n"
    )
}

/// Three kilometres out, where a flight home takes a quarter of the battery.
fn far_out(more: &str) -> Simulation<'static> {
    let text = format!("{}{}{more}", objective("look", 3500.0, 20.0), objective("home", 0.0, 0.0));
    flown_until("far-out", &text, |it| 3000.0 < it.east_m)
}

#[test]
fn who_would_come_home_with_less_than_the_reserve_turns_back_while_it_is_so_little() {
    let mut simulation = far_out("");
    simulation.inject_fault("battery", &["0.42"]);
    let expected = [
        "flag `energy_short` raised: energy.place_margin_percent -",
        "`energy_short`: divert",
        "flies to home to land",
    ];
    assert!(simulation.fly_until("flag `energy_short` raised", s(10)), "{}", simulation.decision_log());
    ends(simulation, MissionOutcome::Emergency, &expected);
}

#[test]
fn behind_the_point_of_no_return_it_flies_on_to_where_the_mission_ends() {
    let field = objective("field", 4000.0, 0.0);
    let mut simulation = flown_until("one-way", &field, |it| 3400.0 < it.east_m);
    let told = simulation.energy().expect("it flies");
    assert!(told.turn_home_s.is_some_and(|it| 60.0 < it) && 300.0 < told.endurance_s, "{told:?}");
    simulation.inject_fault("battery", &["0.33"]);
    simulation.pass(s(2));
    let told = simulation.energy().expect("it flies");
    let (home, best) = (told.home.expect("a way home"), told.best.expect("a way to the field"));
    assert!(home.margin_wh < 0.0 && 0.0 < best.margin_wh && best.place == "the place of `field`", "{home:?} {best:?}");
    assert_eq!(told.turn_home_s, Some(0.0));
    let expected = ["flag `home_out_of_reach` raised: energy.home_margin_percent -", "every objective is settled"];
    ends(simulation, MissionOutcome::Success, &expected);
}

#[test]
fn what_the_motors_take_too_much_is_measured_and_counts_for_the_way_home() {
    let mut simulation = far_out("");
    let before = simulation.energy().and_then(|it| it.home).expect("a way home");
    simulation.inject_fault("battery", &["0.62"]);
    simulation.inject_fault("drain", &["1.6"]);
    assert!(simulation.fly_until("flag `consumption_high` raised", s(120)), "{}", simulation.decision_log());
    let told = simulation.energy().expect("it flies");
    let after = told.home.expect("a way home");
    assert!(told.consumption.is_some_and(|it| 1.2 < it), "{:?}", told.consumption);
    assert!(before.energy_wh / before.time_s * 1.15 < after.energy_wh / after.time_s, "{before:?}, now {after:?}");
    let expected = ["`energy_short`: divert", "flag `consumption_high` raised: energy.consumption_percent 1"];
    ends(simulation, MissionOutcome::Emergency, &expected);
}

#[test]
fn a_permission_that_is_revoked_just_before_the_border_stops_it_in_time() {
    // Area A of the reference mission begins 110 m to the east; at 10 m/s the way to rest is 17 m.
    let mut simulation = simulation(None, Policy::Grant);
    while simulation.position().is_none_or(|it| it.east_m < 95.0) {
        simulation.pass(Duration::from_millis(50));
    }
    simulation.decide("A", Decision::Revoke);
    assert!(simulation.fly_until("flag `area_ahead` raised: at ", s(2)), "{}", simulation.decision_log());
    assert!(simulation.fly_until("`area_ahead`: stop", s(1)), "{}", simulation.decision_log());
    simulation.pass(s(8));
    assert!(simulation.position().is_some_and(|it| it.east_m < 110.0), "{:?}", simulation.position());
    assert_eq!(simulation.breaches(), [], "{}", simulation.decision_log());
}

#[test]
fn who_is_too_high_flies_home_lower() {
    let text = format!("{}{}", objective("high", 400.0, 115.0), objective("home", 0.0, 0.0));
    let mut simulation = flown_until("high", &text, |it| 350.0 < it.east_m && it.down_m < -114.0);
    simulation.inject_fault("position_jump", &["0", "0", "40"]);
    let expected = ["flag `too_high` raised: position.height_at_rest_m 1", "`too_high`: return_home"];
    ends(simulation, MissionOutcome::Emergency, &expected);
}

#[test]
fn a_tower_that_is_silent_lets_no_new_area_be_entered_until_it_is_back() {
    let mut simulation = when("step 2 of 5");
    simulation.freeze("control-tower", s(40));
    assert!(simulation.fly_until("flag `tower_lost` raised: the control tower has been silent for 10", s(15)));
    let expected = ["flag `tower_lost` raised", "`tower_lost` is over", "every objective is settled"];
    ends(simulation, MissionOutcome::Success, &expected);
}

#[test]
fn it_keeps_out_of_the_way_of_a_drone_and_of_a_ship() {
    #[track_caller]
    fn check(kind: &str, height: &str, flag: &str, field: &str) {
        let mut simulation = when("step 3 of 5");
        // It crosses the way from north to south.
        simulation.inject_fault("intruder", &["250", "250", height, "-10", "0", kind]);
        let raised = format!("flag `{flag}` raised: {field} ");
        let expected =
            [&raised, &format!("`{flag}`: avoid"), &format!("`{flag}` is over"), "every objective is settled"];
        ends(simulation, MissionOutcome::Success, &expected.map(|it: &str| it));
    }
    check("uncrewed", "12", "drone_near", "traffic.uncrewed_approach_m");
    check("vessel", "0", "vessel_near", "traffic.vessel_approach_m");
}

#[test]
fn a_gust_beyond_the_limit_of_a_cruise_brings_it_home() {
    let mut simulation = when("step 2 of 5");
    simulation.inject_fault("wind", &["0", "25"]);
    assert!(simulation.fly_until("flag `gust_too_strong` raised: wind.gust_m_s 1", s(20)));
    simulation.inject_fault("wind", &["0", "3"]);
    ends(simulation, MissionOutcome::Emergency, &["`gust_too_strong`: return_home"]);
}

#[test]
fn too_gusty_to_land_it_climbs_holds_and_lands_once_it_is_calm() {
    let mut simulation = when("step 3 of 5");
    simulation.inject_fault("wind", &["0", "13.7"]);
    assert!(simulation.fly_until("`gust_at_landing`: climb", s(200)), "{}", simulation.decision_log());
    simulation.pass(s(30));
    assert!(!simulation.is_on_ground(), "{}", simulation.decision_log());
    simulation.inject_fault("wind", &["0", "0"]);
    let expected =
        ["flag `gust_at_landing` raised: wind.gust_m_s 13.", "`gust_at_landing` is over", "every objective is settled"];
    ends(simulation, MissionOutcome::Success, &expected);
}

#[test]
fn a_position_that_jumps_is_not_followed_at_once() {
    let mut simulation = when("step 3 of 5");
    simulation.inject_fault("position_jump", &["0", "-12"]);
    let expected = [
        "flag `position_jumped` raised: position.jump_m 1",
        "`position_jumped`: hold_first",
        "`position_jumped` is over",
        "every objective is settled",
    ];
    ends(simulation, MissionOutcome::Success, &expected);
}

#[test]
fn a_heading_that_is_off_slows_it_until_it_is_right_again() {
    let mut simulation = when("step 3 of 5");
    simulation.inject_fault("heading_error", &["90"]);
    assert!(simulation.fly_until("flag `heading_fault` raised: attitude.heading_difference_deg ", s(5)));
    simulation.pass(s(5));
    simulation.inject_fault("heading_error", &["0"]);
    ends(simulation, MissionOutcome::Success, &["`heading_fault` is over", "every objective is settled"]);
}

#[test]
fn a_frame_that_shakes_slows_it_and_one_that_shakes_too_much_brings_it_home() {
    let mut simulation = when("step 2 of 5");
    simulation.inject_fault("vibration", &["30"]);
    assert!(simulation.fly_until("flag `vibration_high` raised: vehicle.vibration_m_s2 35.00 m/s2", s(10)));
    simulation.inject_fault("vibration", &["70"]);
    let expected = ["flag `vibration_extreme` raised: vehicle.vibration_m_s2 75.", "`vibration_extreme`: return_home"];
    ends(simulation, MissionOutcome::Emergency, &expected);
}

#[test]
fn a_skill_that_does_not_end_is_told() {
    let mut simulation = when("step 3 of 5");
    simulation.pass(s(2));
    simulation.freeze("skill-manager", s(9));
    let expected =
        ["`skill_manager_lost`: stop", "flag `cancel_ignored` raised: skill.cancel_s ", "every objective is settled"];
    ends(simulation, MissionOutcome::Success, &expected);
}

#[test]
fn a_pause_that_nobody_ends_ends_at_home() {
    let mut simulation = when("step 3 of 5");
    simulation.order(Verb::Pause(v1::PauseMission { overrides: false }));
    assert!(simulation.fly_until("flag `operator_silent` raised: operator.awaited_s 600.", s(620)));
    ends(simulation, MissionOutcome::Emergency, &["`operator_silent`: return_home"]);
}

#[test]
fn a_hold_after_an_autopilots_restart_ends() {
    let mut simulation = when("step 4 of 5");
    simulation.inject_fault("restart_autopilot", &["holds"]);
    // Nothing is flown to where places cannot be compared: it lands where it is.
    let expected = [
        "`frame_moved`: stop",
        "flag `operator_silent` raised: operator.awaited_s 600.",
        "`operator_silent`: return_home",
        "it needs a position, and `frame_moved` is up",
        "`operator_silent`: land_elsewhere failed (try 2 of 2): it needs a position",
    ];
    assert!(simulation.fly_until("flag `operator_silent` raised", s(640)), "{}", simulation.decision_log());
    ends(simulation, MissionOutcome::Emergency, &expected);
}

/// A vehicle of 10 m/s in a wind that a faster one is flown in.
#[test]
fn one_that_flies_slowly_through_the_air_goes_home_in_less_wind() {
    let config = config_with("slow-in-air", &[]);
    let file = config.join("kittiwake.toml");
    let text = std::fs::read_to_string(&file).unwrap().replace("airspeed_m_s = 15.0", "airspeed_m_s = 10.0");
    std::fs::write(&file, text).unwrap();
    let mut simulation = when_flown(simulation_of(&config, None, Policy::Grant), "step 2 of 5");
    simulation.inject_fault("wind", &["0", "-9.5"]);
    let expected = ["raised: wind.speed_m_s 9.4", "`wind_too_strong`: return_home"];
    ends(simulation, MissionOutcome::Emergency, &expected);
}

#[test]
fn blown_away_faster_than_it_flies_it_lands_where_it_is() {
    let mission = format!("{}{}", objective("look", 800.0, 10.0), objective("home", 0.0, 0.0));
    let mut simulation = flown_until("blown", &mission, |it| 400.0 < it.east_m);
    simulation.inject_fault("wind", &["0", "16.5"]);
    let begun = simulation.now();
    let expected = [
        "`wind_too_strong`: return_home",
        "`wind_too_strong`: return_home failed (try 1 of 2): the wind has been 1",
        "`wind_too_strong`: land_elsewhere failed (try 1 of 2): the wind has been 1",
    ];
    assert!(simulation.fly_until("land_elsewhere failed", s(60)), "{}", simulation.decision_log());
    ends(&mut simulation, MissionOutcome::Emergency, &expected);
    assert!(simulation.now() - begun < s(200), "{}", simulation.decision_log());
}

#[test]
fn a_battery_that_reports_a_fault_brings_it_to_a_fit_place() {
    let mut simulation = when("step 2 of 5");
    simulation.inject_fault("battery_fault", &[]);
    ends(simulation, MissionOutcome::Emergency, &["flag `battery_faulty` raised: ", "`battery_faulty`: divert"]);
}
