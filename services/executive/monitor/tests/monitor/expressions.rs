//! Flags that are raised and cleared by expressions.

use kittiwake_proto::v1;

use crate::stories::rig::{Rig, Vehicle};

/// Flies two seconds in each state of the vehicle, and compares what the monitor says about its one flag.
#[track_caller]
fn check(keys: &str, states: &[fn(&mut Vehicle)], expected: &[&str]) {
    let mut rig = Rig::watching(keys);
    for state in states {
        state(&mut rig.vehicle);
        rig.fly(2.0);
    }
    assert_eq!(rig.story_with_rules(), expected);
}

const BATTERY: &str = "when = 'battery.charge_percent < 20 %'
    clear_when = 'battery.charge_percent > 30 %'
    for_s = 1.0
    clears_after_s = 0.5";

#[test]
fn a_flag_rises_and_falls_after_its_times_and_says_what_was_measured() {
    check(
        BATTERY,
        &[|it| it.battery.remaining = 0.125, |it| it.battery.remaining = 0.25, |it| it.battery.remaining = 0.5],
        &[
            "1.000 watched up: battery.charge_percent 12.50 %; the rule is `battery.charge_percent < 20 %` for 1.0 s",
            "4.500 watched down",
        ],
    );
    check(BATTERY, &[|it| it.battery.remaining = 0.25], &[]);
}

#[test]
fn what_was_never_heard_counts_as_raised_once_it_could_have_been() {
    let mut rig = Rig::watching("when = 'wind.speed_m_s > 10 m/s'");
    rig.vehicle.wind = None;
    rig.fly(6.0);
    rig.vehicle.wind = Some(v1::WindEstimate { north_m_s: 3.0, east_m_s: -4.0 });
    rig.fly(0.1);
    assert_eq!(
        rig.story_with_rules(),
        [
            "5.000 watched up: wind.speed_m_s is not known, which counts as raised; the rule is `wind.speed_m_s > 10 m/s`",
            "6.000 watched down",
        ]
    );
}

#[test]
fn what_the_estimator_does_not_vouch_for_counts_as_raised_unless_the_rule_asks_whether_it_is_known() {
    #[track_caller]
    fn check(keys: &str, expected: &[&str]) {
        let mut rig = Rig::watching(keys);
        rig.fly(6.0);
        rig.vehicle.local_position.vertical_valid = false;
        rig.fly(0.1);
        assert_eq!(rig.story_with_rules(), expected);
    }
    check(
        "when = 'position.height_m > 120 m'",
        &["6.000 watched up: position.height_m is not known, which counts as raised; the rule is \
           `position.height_m > 120 m`"],
    );
    check("when = 'known(position.height_m) and position.height_m > 120 m'", &[]);
}

#[test]
fn an_expression_counts_in_its_situation_only() {
    check(
        "when = 'battery.charge_percent < 20 %'
         during = 'flying'",
        &[
            |it| {
                it.battery.remaining = 0.125;
                it.touch_down();
            },
            Vehicle::lift_off,
            Vehicle::touch_down,
        ],
        &[
            "2.000 watched up: battery.charge_percent 12.50 %; the rule is `battery.charge_percent < 20 %`",
            "4.000 watched down",
        ],
    );
}

#[test]
fn modes_and_failsafes_are_read_by_name() {
    check(
        "when = 'autopilot.failsafe and autopilot.mode != autopilot.intended_mode'",
        &[
            |it| it.status.intended_mode = v1::FlightMode::Offboard as i32,
            |it| (it.status.actual_mode, it.status.failsafe) = (v1::FlightMode::Loiter as i32, true),
        ],
        &[
            "2.000 watched up: autopilot.failsafe true, autopilot.mode loiter, autopilot.intended_mode offboard; the rule is \
           `autopilot.failsafe and autopilot.mode != autopilot.intended_mode`",
        ],
    );
}
