//! What expressions of the contingency table raise, as whole flights: the fault, the flag with its values, the response, the
//! outcome.

use control_tower::policy::Policy;
use kittiwake_proto::v1::MissionOutcome;

use crate::stories::support::simulation;
use crate::stories::support::story::{ends, s, when};

#[test]
fn the_last_of_the_battery_brings_it_down_at_once() {
    let mut simulation = when("step 4 of 5");
    simulation.inject_fault("battery", &["0.045"]);
    let expected = ["flag `battery_emergency` raised: battery.charge_percent 4.", "`battery_emergency`: land_now"];
    ends(simulation, MissionOutcome::Emergency, &expected);
}

#[test]
fn a_battery_that_is_too_hot_brings_it_to_the_nearest_fit_place() {
    let mut simulation = when("step 4 of 5");
    simulation.inject_fault("battery_temperature", &["70"]);
    let expected = ["flag `battery_hot` raised: battery.temperature_c 69.", "`battery_hot`: divert"];
    ends(simulation, MissionOutcome::Emergency, &expected);
}

#[test]
fn hot_on_the_ground_it_waits_until_its_cells_have_cooled() {
    let mut simulation = simulation(None, Policy::Grant);
    simulation.inject_fault("battery_temperature", &["70"]);
    simulation.pass(s(120));
    assert!(simulation.is_on_ground(), "{}", simulation.decision_log());
    simulation.inject_fault("battery_temperature", &["40"]);
    let expected = [
        "flag `battery_hot_on_ground` raised: battery.temperature_c 69.",
        "`battery_hot_on_ground` is over",
        "every objective is settled",
    ];
    ends(simulation, MissionOutcome::Success, &expected);
}

#[test]
fn wind_that_is_too_strong_brings_it_home() {
    let mut simulation = when("step 2 of 5");
    simulation.inject_fault("wind", &["0", "15"]);
    let expected = ["flag `wind_too_strong` raised: wind.speed_m_s 14.", "`wind_too_strong`: return_home"];
    ends(simulation, MissionOutcome::Emergency, &expected);
}

#[test]
fn in_much_wind_nothing_takes_off_until_there_is_less() {
    let mut simulation = when("step 4 of 5");
    simulation.inject_fault("wind", &["0", "12"]);
    assert!(simulation.fly_until("`wind_high`: stop", s(120)), "{}", simulation.decision_log());
    simulation.pass(s(60));
    assert!(simulation.is_on_ground(), "{}", simulation.decision_log());
    simulation.inject_fault("wind", &["0", "0"]);
    let expected = ["flag `wind_high` raised: wind.speed_m_s 1", "`wind_high` is over", "every objective is settled"];
    ends(simulation, MissionOutcome::Success, &expected);
}

#[test]
fn it_keeps_out_of_the_way_of_another_aircraft_and_goes_on_once_it_has_passed() {
    let mut simulation = when("step 3 of 5");
    // It crosses the way from north to south, 10 m higher.
    simulation.inject_fault("intruder", &["2000", "200", "20", "-40", "0"]);
    let expected = [
        "flag `traffic_near` raised: traffic.closest_approach_m ",
        "`traffic_near`: avoid",
        "`traffic_near` is over",
        "every objective is settled",
    ];
    ends(simulation, MissionOutcome::Success, &expected);
}

#[test]
fn it_holds_without_satellites_and_flies_on_when_they_are_back_in_time() {
    let mut simulation = when("step 3 of 5");
    simulation.inject_fault("gnss_loss", &["on"]);
    assert!(simulation.fly_until("`gnss_lost`: stop", s(5)), "{}", simulation.decision_log());
    simulation.inject_fault("gnss_loss", &["off"]);
    let expected = [
        "flag `gnss_lost` raised: satellite navigation is reported lost",
        "`gnss_lost`: stop",
        "`gnss_lost` is over",
        "every objective is settled",
    ];
    ends(simulation, MissionOutcome::Success, &expected);
}

#[test]
fn a_position_that_is_uncertain_for_a_while_is_recorded() {
    let mut simulation = when("step 3 of 5");
    // From 0.4 m to 4.4 m in eight seconds; from 5 m on the estimator does not vouch for it.
    simulation.inject_fault("estimator_drift", &["0.5"]);
    simulation.pass(s(8));
    simulation.inject_fault("estimator_drift", &["0"]);
    let expected = [
        "flag `position_uncertain` raised: position.horizontal_deviation_m ",
        "`position_uncertain` is over",
        "every objective is settled",
    ];
    ends(simulation, MissionOutcome::Success, &expected);
}

#[test]
fn tilted_too_far_it_lands_where_it_is() {
    let mut simulation = when("step 4 of 5");
    simulation.inject_flag("attitude_exceeded");
    let expected = ["flag `attitude_exceeded` raised: by hand", "`attitude_exceeded`: land_now"];
    ends(simulation, MissionOutcome::Emergency, &expected);
}

#[test]
fn a_vehicle_that_falls_is_seen_to_sink() {
    let mut simulation = when("step 4 of 5");
    simulation.inject_fault("motor_failure", &["2"]);
    ends(simulation, MissionOutcome::Crash, &["flag `sinking` raised: motion.climb_m_s -"]);
}

#[test]
fn a_failsafe_that_misses_our_setpoints_is_ours_to_end() {
    let mut simulation = when("step 4 of 5");
    simulation.pass(s(5));
    simulation.freeze("skill-manager", s(4));
    let expected =
        ["flag `offboard_link_lost` raised", "`offboard_link_lost` is over", "plan 2: fly to (0, 500, 10); land"];
    ends(simulation, MissionOutcome::Success, &expected);
}

#[test]
fn sources_that_are_silent_for_seconds_are_recorded_and_cost_nothing() {
    for (topic, silence) in [
        ("vehicle_status", "flag `status_stale` raised: vehicle status has been silent for 3.0 s"),
        ("vehicle_attitude", "flag `attitude_stale` raised: attitude has been silent for 0.5 s"),
    ] {
        let mut simulation = when("step 4 of 5");
        simulation.inject_fault("drop", &[topic]);
        simulation.pass(s(5));
        simulation.inject_fault("clear", &[]);
        ends(simulation, MissionOutcome::Success, &[silence]);
    }
}

#[test]
fn without_contact_for_two_minutes_it_returns() {
    let mut simulation = when("step 3 of 5");
    // The ground's end of the link hangs.
    simulation.freeze("gateway", s(200));
    let expected = ["`link_lost`: stop", "flag `link_gone` raised", "`link_gone`: return_home"];
    ends(simulation, MissionOutcome::Emergency, &expected);
}
