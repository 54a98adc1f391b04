//! Alarms over the disturbances of the vehicle, held to the number of causes: at each moment one cause is one alarm, and none stands once
//! its cause is gone. A standing alarm, and one that says again what another one says, teach an operator to look away (ISA-18.2, EEMUA
//! 191).

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::ResumeMission;
use kittiwake_proto::v1::operator_command::Verb;

use crate::stories::support::story::{s, when_flown};
use crate::stories::support::{shipped, simulation_of};

/// How often it is looked.
const STEP: Duration = Duration::from_millis(100);
/// Two alarms may stand side by side for as long as it takes to say that one explains the other.
const SETTLES: Duration = Duration::from_millis(1200);
/// For how long the cause lasts.
const LASTS: Duration = s(60);

/// What goes wrong on the way, and the alarms that call for a human, one after the other: each takes the place of the one before it.
const CAUSES: [(&str, &[&str]); 25] = [
    ("battery 0.24", &["battery_low"]),
    ("battery 0.14", &["battery_low"]),
    ("battery 0.05", &["autopilot_comes_down", "battery_emergency", "battery_critical", "autopilot_not_ready"]),
    ("battery_temperature 70", &["battery_hot", "battery_hot_on_ground"]),
    (
        "gnss_loss",
        &["gnss_lost", "autopilot_comes_down", "estimator_lost", "autopilot_preempts", "autopilot_not_ready"],
    ),
    ("estimator_drift 1", &["autopilot_comes_down", "estimator_lost", "autopilot_preempts", "autopilot_not_ready"]),
    ("estimator_invalid", &["autopilot_comes_down", "estimator_lost", "autopilot_preempts", "autopilot_not_ready"]),
    ("motor_failure 1", &["motor_failure", "autopilot_not_ready"]),
    ("motor_failure 2", &["motor_failure", "autopilot_not_ready"]),
    ("wind 0 13", &["wind_high"]),
    ("wind 0 16", &["gust_at_landing", "wind_too_strong"]),
    ("wind 0 5 6", &["wind_high"]),
    ("vibration 40", &["vibration_high"]),
    ("vibration 70", &["vibration_extreme", "vibration_high"]),
    ("heading_error 90", &["heading_fault"]),
    ("position_jump 12 0 0", &["position_jumped"]),
    ("intruder 250 250 20 -10 0 crewed", &["traffic_near"]),
    ("intruder 250 250 20 -10 0 uncrewed", &["drone_near"]),
    ("freeze vehicle_local_position", &["local_position_stale"]),
    ("drop vehicle_local_position", &["local_position_stale"]),
    ("drop vehicle_attitude", &["attitude_stale"]),
    ("drop battery_status", &["battery_stale", "battery_gone"]),
    ("drop vehicle_status", &["status_stale"]),
    ("pilot_takes_over hold", &["somebody_else_flies"]),
    ("autopilot_failsafe hold", &["autopilot_preempts"]),
];

#[test]
fn one_cause_is_one_alarm_and_none_stands_when_it_is_gone() {
    let told: Vec<String> = CAUSES.iter().filter_map(|(cause, expected)| wrong(cause, expected)).collect();
    assert!(told.is_empty(), "{}", told.join("\n"));
}

/// What is wrong with the alarms of this cause.
fn wrong(cause: &str, expected: &[&str]) -> Option<String> {
    let mut simulation = when_flown(simulation_of(&shipped(), None, Policy::Grant), "step 2 of 5");
    simulation.pass(s(5));
    let words: Vec<&str> = cause.split(' ').collect();
    simulation.inject_fault(words[0], &words[1..]);
    let (mut raised, mut crowds, mut crowded) = (Vec::new(), Vec::new(), Duration::ZERO);
    for _ in 0..LASTS.as_millis() / STEP.as_millis() {
        simulation.pass(STEP);
        let alarms = simulation.alarms();
        crowded = if 1 < alarms.len() { crowded + STEP } else { Duration::ZERO };
        if crowded == SETTLES + STEP {
            crowds.push(alarms.join(" and "));
        }
        for alarm in alarms {
            if !raised.contains(&alarm) {
                raised.push(alarm);
            }
        }
    }
    simulation.inject_fault("clear", &[]);
    // Its battery is changed.
    simulation.inject_fault("battery", &["1.0"]);
    simulation.inject_fault("battery_temperature", &["20"]);
    // Who has taken the vehicle gives it back by an order, and so does the autopilot.
    simulation.order(Verb::Resume(ResumeMission {}));
    simulation.pass(LASTS);
    // Wind counts as less after two calmer minutes.
    if simulation.alarms() == ["wind_high"] {
        simulation.pass(LASTS * 2);
    }
    let standing = simulation.alarms();
    let is_right = raised == expected && crowds.is_empty() && standing.is_empty();
    (!is_right)
        .then(|| format!("{cause}: {raised:?}, expected {expected:?}; at once {crowds:?}; still up {standing:?}"))
}
