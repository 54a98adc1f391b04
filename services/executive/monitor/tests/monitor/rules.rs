//! When flags are raised and cleared.

use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1::{self, FailureFlag};

use crate::stories::rig::{Rig, Vehicle, s};

const BATTERY_LOW: &str = "when = 'known(battery.charge_percent) and battery.charge_percent < 20 %'\nclear_when = 'battery.charge_percent >= 30 %'\nfor_s = 1.0";
const BATTERY_LOW_AT_ONCE: &str = "when = 'known(battery.charge_percent) and battery.charge_percent < 20 %'\nclear_when = 'battery.charge_percent >= 30 %'";

/// Flies two seconds in each state of the vehicle, and compares what the monitor says about its one flag.
#[track_caller]
fn check(rule: &str, states: &[fn(&mut Vehicle)], expected: &[&str]) {
    let mut rig = Rig::watching(rule);
    for state in states {
        state(&mut rig.vehicle);
        rig.fly(2.0);
    }
    assert_eq!(rig.story(), expected);
}

fn battery(remaining: f64) -> Message {
    v1::BatteryStatus { voltage_v: 22.0, current_a: Some(1.0), remaining, temperature_c: Some(20.0) }.into()
}

#[test]
fn a_value_below_its_threshold_raises_after_its_time_and_clears_higher_up() {
    check(
        BATTERY_LOW,
        &[|it| it.battery.remaining = 0.19, |it| it.battery.remaining = 0.25, |it| it.battery.remaining = 0.31],
        &["1.000 watched up: battery.charge_percent 19.00 %", "4.000 watched down"],
    );
    check(BATTERY_LOW, &[|it| it.battery.remaining = 0.2, |it| it.battery.remaining = 0.25], &[]);
    check(BATTERY_LOW, &[|it| it.battery.remaining = 0.1999], &["1.000 watched up: battery.charge_percent 19.99 %"]);
}

#[test]
fn a_value_above_its_threshold_raises_and_clears_lower_down() {
    check(
        "when = 'known(position.height_m) and position.height_m > 120 m'\nclear_when = 'position.height_m <= 110 m'",
        &[
            |it| it.local_position.position = Some(v1::Ned { down_m: -121.0, ..Default::default() }),
            |it| it.local_position.position = Some(v1::Ned { down_m: -115.0, ..Default::default() }),
            |it| it.local_position.position = Some(v1::Ned { down_m: -110.0, ..Default::default() }),
        ],
        &["0.000 watched up: position.height_m 121.00 m", "4.000 watched down"],
    );
}

#[test]
fn a_height_that_the_estimator_does_not_vouch_for_raises_nothing() {
    check(
        "when = 'known(position.height_m) and position.height_m > 120 m'\nclear_when = 'position.height_m <= 110 m'",
        &[|it| {
            it.local_position.position = Some(v1::Ned { down_m: -500.0, ..Default::default() });
            it.local_position.vertical_valid = false;
        }],
        &[],
    );
}

#[test]
fn a_condition_that_is_reported_raises_and_clears_with_the_report() {
    check(
        "when = 'known(autopilot.setpoints_lost) and autopilot.setpoints_lost'\nduring = 'flying'",
        &[
            |_| {},
            |it| it.status.failures = vec![FailureFlag::OffboardSignalLost as i32],
            |it| it.status.failures.clear(),
        ],
        &["2.000 watched up: the offboard signal is reported lost", "4.000 watched down"],
    );
    check(
        "when = 'known(estimator.invalid) and estimator.invalid'\nfor_s = 0.5",
        &[|it| it.local_position.horizontal_valid = false, |it| it.local_position.horizontal_valid = true],
        &["0.500 watched up: the estimator is reported invalid", "2.000 watched down"],
    );
    check(
        "when = 'known(estimator.invalid) and estimator.invalid'\nfor_s = 0.5",
        &[|it| it.status.failures = vec![77, FailureFlag::Estimator as i32]],
        &["0.500 watched up: the estimator is reported invalid"],
    );
}

#[test]
fn a_rule_applies_in_its_situation_only() {
    let rule = |during| format!("{BATTERY_LOW}\nduring = '{during}'");
    check(
        &rule("flying"),
        &[
            |it| {
                it.battery.remaining = 0.1;
                it.touch_down();
            },
            Vehicle::lift_off,
            Vehicle::touch_down,
        ],
        &["3.000 watched up: battery.charge_percent 10.00 %", "4.000 watched down"],
    );
    check(
        &rule("armed"),
        &[
            |it| {
                it.battery.remaining = 0.1;
                it.status.armed = false;
            },
            |it| it.status.armed = true,
            |it| it.status.armed = false,
        ],
        &["3.000 watched up: battery.charge_percent 10.00 %", "4.000 watched down"],
    );
}

#[test]
fn a_dip_that_ends_in_time_raises_nothing() {
    let mut rig = Rig::watching(BATTERY_LOW);
    rig.hear([battery(0.1)]);
    rig.wait(s(0.9));
    rig.hear([battery(0.25)]);
    rig.hear([battery(0.1)]);
    rig.wait(s(0.9));
    assert_eq!(rig.story(), [""; 0]);
}

#[test]
fn a_value_that_was_bad_when_its_source_fell_silent_raises_on_time() {
    let mut rig = Rig::watching(BATTERY_LOW);
    rig.wait(s(0.0051));
    rig.hear([battery(0.19)]);
    rig.wait(s(2.0));
    assert_eq!(rig.story(), ["1.005 watched up: battery.charge_percent 19.00 %"]);
}

#[test]
fn a_flag_that_is_up_for_one_sample_of_a_batch_is_listed_for_long_enough_to_be_seen() {
    let mut rig = Rig::watching(BATTERY_LOW_AT_ONCE);
    rig.wait(s(0.005));
    rig.hear([battery(0.5), battery(0.1), battery(0.5)]);
    rig.wait(s(1.0));
    assert_eq!(rig.story(), ["0.005 watched up: battery.charge_percent 10.00 %", "0.105 watched down"]);
}

#[test]
fn a_flag_that_rises_or_falls_is_published_at_once() {
    let mut rig = Rig::watching(BATTERY_LOW_AT_ONCE);
    rig.fly(1.0);
    rig.wait(s(0.003));
    rig.hear([battery(0.1)]);
    rig.wait(s(0.5));
    rig.hear([battery(0.5)]);
    rig.wait(s(0.5));
    let told = rig.introspections().filter(|(_, it)| it.flags_changed);
    let told: Vec<_> = told.map(|(at, it)| (at.since_start().as_millis(), it.flags.len())).collect();
    assert_eq!(told, [(1003, 1), (1503, 0)]);
}

#[test]
fn a_flag_that_stays_up_is_listed_with_its_numbers() {
    let mut rig = Rig::watching(BATTERY_LOW_AT_ONCE);
    rig.vehicle.battery.remaining = 0.125;
    rig.fly(3.0);
    assert_eq!(rig.changes_of("watched"), [true]);
    let flag = &rig.last().flags[0];
    assert_eq!((flag.since_s, flag.rise), (3.0, 1));
    assert!(flag.reason.starts_with("battery.charge_percent 12.50 %; the rule is `known("), "{}", flag.reason);
    assert_eq!((flag.value, flag.threshold, flag.unit.as_str()), (Some(12.5), Some(20.0), "%"));
}

#[test]
fn a_flag_that_is_raised_by_hand_stays_up_until_it_is_cleared_by_hand() {
    let mut rig = Rig::watching(BATTERY_LOW_AT_ONCE);
    rig.inject("transition_failed", true);
    rig.fly(1.0);
    assert_eq!(rig.up(), ["transition_failed"]);
    rig.inject("transition_failed", true);
    rig.fly(1.0);
    let flag = &rig.last().flags[0];
    assert_eq!((flag.since_s, flag.reason.as_str(), flag.rise), (2.0, "raised by hand", 2), "raised once more");
    rig.inject("transition_failed", false);
    rig.fly(0.1);
    assert!(rig.up().is_empty());
}

#[test]
fn a_flag_is_up_while_its_rule_or_somebody_by_hand_says_so() {
    let mut rig = Rig::watching(BATTERY_LOW_AT_ONCE);
    #[track_caller]
    fn check(rig: &mut Rig, remaining: f64, by_hand: bool, expected_up: bool) {
        rig.vehicle.battery.remaining = remaining;
        rig.inject("watched", by_hand);
        rig.fly(0.2);
        assert_eq!(!rig.up().is_empty(), expected_up);
    }
    check(&mut rig, 0.8, true, true);
    check(&mut rig, 0.1, true, true);
    check(&mut rig, 0.1, false, true);
    check(&mut rig, 0.1, true, true);
    check(&mut rig, 0.8, true, true);
    check(&mut rig, 0.8, false, false);
}

#[test]
fn only_flags_that_have_a_row_are_raised_by_hand() {
    let mut rig = Rig::watching(BATTERY_LOW_AT_ONCE);
    rig.inject("made_up", true);
    rig.fly(0.1);
    assert!(rig.up().is_empty());
    assert_eq!(rig.refused, ["monitor/flag: `name` is \"made_up\", expected a flag of the contingency table"]);
}

/// A monitor that is started in flight: whether its flag is undecided after this time.
#[track_caller]
fn undecided(keys: &str, prepare: fn(&mut Vehicle), seconds: f64, expected: bool) {
    let mut rig = Rig::watching(keys);
    prepare(&mut rig.vehicle);
    rig.fly(seconds);
    assert!(rig.up().is_empty(), "{keys} after {seconds} s: {:?}", rig.story());
    let lists = rig.last().undecided_flags.iter().any(|it| it == "watched");
    assert_eq!(lists, expected, "{keys} after {seconds} s");
}

#[test]
fn a_monitor_that_was_just_started_leaves_open_what_it_cannot_know_yet() {
    // Nothing was heard.
    undecided(BATTERY_LOW, |it| it.silent.push(Topic::BatteryStatus), 1.0, true);
    const BATTERY: &str = "when = 'known(battery.charge_percent) and battery.charge_percent < 20 %'";
    undecided(BATTERY, |it| it.silent.push(Topic::BatteryStatus), 6.0, false);
    // All is well, it has not lasted yet, and it is between its two thresholds.
    undecided(BATTERY_LOW, |_| (), 0.1, false);
    undecided(BATTERY_LOW, |it| it.battery.remaining = 0.1, 0.9, true);
    undecided(BATTERY_LOW, |it| it.battery.remaining = 0.25, 9.0, true);
    // Somebody may have been silent for longer than this monitor runs, if there is somebody.
    const LINK: &str = "when = 'known(link.silent_s) and link.silent_s >= 10 s'";
    const PLANNER: &str = "when = 'planner.silent_s >= 1 s'";
    undecided(LINK, |_| (), 0.1, false);
    undecided(LINK, |it| it.silent.push(Topic::GroundContact), 4.0, true);
    undecided(LINK, |it| it.silent.push(Topic::GroundContact), 6.0, false);
    let heard_before = |it: &mut Vehicle| {
        it.silent.push(Topic::GroundContact);
        it.manager.told = Some(v1::ToldByMonitor { ground_link: true, ..Default::default() });
    };
    undecided(LINK, heard_before, 9.0, true);
    undecided(PLANNER, |_| (), 0.1, false);
    undecided(PLANNER, |it| it.hung.push("planner"), 4.9, true);
}

#[test]
fn what_somebody_has_cleared_by_hand_is_decided() {
    let mut rig = Rig::watching(BATTERY_LOW);
    rig.vehicle.battery.remaining = 0.25;
    rig.inject("watched", true);
    rig.fly(1.0);
    rig.inject("watched", false);
    rig.fly(1.0);
    assert_eq!((rig.up(), rig.last().undecided_flags.iter().any(|it| it == "watched")), (vec![], false));
}
