//! When flags are raised and cleared.

use kittiwake_proto::topics::Message;
use kittiwake_proto::v1::{self, FailureFlag};

use crate::stories::rig::{Rig, Vehicle, s};

const BATTERY_LOW: &str =
    "{ fact = 'below', value = 'battery-remaining', threshold = 0.2, clear = 0.3, for_s = 1.0, during = 'always' }";
const BATTERY_LOW_AT_ONCE: &str =
    "{ fact = 'below', value = 'battery-remaining', threshold = 0.2, clear = 0.3, for_s = 0.0, during = 'always' }";

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
        &[
            "1.000 watched up: battery remaining 0.19, below 0.20 for 1.0 s",
            "4.000 watched down: battery remaining 0.31, no longer below 0.30",
        ],
    );
    check(BATTERY_LOW, &[|it| it.battery.remaining = 0.2, |it| it.battery.remaining = 0.25], &[]);
    check(
        BATTERY_LOW,
        &[|it| it.battery.remaining = 0.1999],
        &["1.000 watched up: battery remaining 0.1999, below 0.2000 for 1.0 s"],
    );
}

#[test]
fn a_value_above_its_threshold_raises_and_clears_lower_down() {
    check(
        "{ fact = 'above', value = 'height', threshold = 120.0, clear = 110.0, for_s = 0.0, during = 'always' }",
        &[
            |it| it.local_position.position = Some(v1::Ned { down_m: -121.0, ..Default::default() }),
            |it| it.local_position.position = Some(v1::Ned { down_m: -115.0, ..Default::default() }),
            |it| it.local_position.position = Some(v1::Ned { down_m: -110.0, ..Default::default() }),
        ],
        &[
            "0.000 watched up: height 121.00 m, above 120.00 m",
            "4.000 watched down: height 110.00 m, no longer above 110.00 m",
        ],
    );
}

#[test]
fn a_height_that_the_estimator_does_not_vouch_for_raises_nothing() {
    check(
        "{ fact = 'above', value = 'height', threshold = 120.0, clear = 110.0, for_s = 0.0, during = 'always' }",
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
        "{ fact = 'reported', condition = 'offboard-signal-lost', for_s = 0.0, during = 'flying' }",
        &[
            |_| {},
            |it| it.status.failures = vec![FailureFlag::OffboardSignalLost as i32],
            |it| it.status.failures.clear(),
        ],
        &[
            "2.000 watched up: the offboard signal is reported lost",
            "4.000 watched down: the offboard signal is no longer reported lost",
        ],
    );
    check(
        "{ fact = 'reported', condition = 'estimator-invalid', for_s = 0.5, during = 'always' }",
        &[|it| it.local_position.horizontal_valid = false, |it| it.local_position.horizontal_valid = true],
        &[
            "0.500 watched up: the estimator has been reported invalid for 0.5 s",
            "2.000 watched down: the estimator is no longer reported invalid",
        ],
    );
    check(
        "{ fact = 'reported', condition = 'estimator-invalid', for_s = 0.5, during = 'always' }",
        &[|it| it.status.failures = vec![77, FailureFlag::Estimator as i32]],
        &["0.500 watched up: the estimator has been reported invalid for 0.5 s"],
    );
}

#[test]
fn a_rule_applies_in_its_situation_only() {
    let rule = |during| BATTERY_LOW.replace("always", during);
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
        &[
            "3.000 watched up: battery remaining 0.10, below 0.20 for 1.0 s",
            "4.000 watched down: the vehicle is no longer flying",
        ],
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
        &[
            "3.000 watched up: battery remaining 0.10, below 0.20 for 1.0 s",
            "4.000 watched down: the vehicle is no longer armed",
        ],
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
    assert_eq!(rig.story(), ["1.005 watched up: battery remaining 0.19, below 0.20 for 1.0 s"]);
}

#[test]
fn a_flag_that_is_up_for_one_sample_of_a_batch_gives_two_events() {
    let mut rig = Rig::watching(BATTERY_LOW_AT_ONCE);
    rig.wait(s(0.005));
    rig.hear([battery(0.5), battery(0.1), battery(0.5)]);
    assert_eq!(
        rig.story(),
        [
            "0.005 watched up: battery remaining 0.10, below 0.20",
            "0.005 watched down: battery remaining 0.50, no longer below 0.30",
        ]
    );
}

#[test]
fn a_flag_that_stays_up_gives_one_event_with_its_numbers() {
    let mut rig = Rig::watching(BATTERY_LOW_AT_ONCE);
    rig.vehicle.battery.remaining = 0.1;
    rig.fly(3.0);
    let events: Vec<_> = rig.events().map(|(_, it)| it.clone()).collect();
    assert_eq!(
        events,
        [v1::FlagEvent {
            name: "watched".into(),
            raised: true,
            source: "monitor".into(),
            reason: "battery remaining 0.10, below 0.20".into(),
            value: Some(0.1),
            threshold: Some(0.2),
            unit: "ratio".into(),
        }]
    );
    let flag = &rig.last().flags[0];
    assert_eq!((flag.since_s, flag.reason.as_str()), (3.0, "battery remaining 0.10, below 0.20"));
    assert_eq!((flag.value, flag.threshold, flag.unit.as_str()), (Some(0.1), Some(0.2), "ratio"));
}

#[test]
fn a_flag_that_is_raised_by_hand_stays_up_until_it_is_cleared_by_hand() {
    let mut rig = Rig::watching(BATTERY_LOW_AT_ONCE);
    rig.inject("transition_failed", true);
    rig.fly(1.0);
    assert_eq!(rig.up(), ["transition_failed"]);
    rig.inject("transition_failed", true);
    rig.fly(1.0);
    assert_eq!((rig.last().flags[0].since_s, rig.last().flags[0].reason.as_str()), (2.0, "raised by hand"));
    rig.inject("transition_failed", false);
    rig.fly(0.1);
    assert!(rig.up().is_empty());
    assert_eq!(rig.story(), [""; 0], "the injector has published it already");
}

#[test]
fn a_flag_is_up_while_its_rule_or_the_injector_says_so() {
    let mut rig = Rig::watching(BATTERY_LOW_AT_ONCE);
    #[track_caller]
    fn check(rig: &mut Rig, remaining: f64, by_hand: bool, expected_up: bool, expected_events: usize) {
        rig.vehicle.battery.remaining = remaining;
        rig.inject("watched", by_hand);
        rig.fly(0.1);
        assert_eq!(!rig.up().is_empty(), expected_up);
        assert_eq!(rig.events().count(), expected_events);
    }
    check(&mut rig, 0.8, true, true, 0);
    check(&mut rig, 0.1, true, true, 1);
    check(&mut rig, 0.1, false, true, 1);
    check(&mut rig, 0.1, true, true, 1);
    check(&mut rig, 0.8, true, true, 2);
    check(&mut rig, 0.8, false, false, 2);
}

#[test]
fn only_the_injector_injects_and_only_flags_that_have_a_row() {
    let mut rig = Rig::watching(BATTERY_LOW_AT_ONCE);
    for (name, source) in [("watched", "monitor"), ("watched", ""), ("made_up", "injector")] {
        let event = v1::FlagEvent { name: name.into(), raised: true, source: source.into(), ..Default::default() };
        rig.hear([event.into()]);
    }
    rig.fly(0.1);
    assert!(rig.up().is_empty());
    assert_eq!(rig.refused, ["monitor/flag: `name` is \"made_up\", expected a flag of the contingency table"]);
}
