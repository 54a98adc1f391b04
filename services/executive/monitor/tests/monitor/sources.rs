//! Sources that are silent, frozen or absent, and samples that are invalid.

use domain::time::Pace;
use kittiwake_proto::topics::Topic;
use kittiwake_proto::v1;

use crate::stories::rig::{Rig, s, table};

const POSITION_STALE: &str = "when = 'position.silent_s >= 0.5 s'";
const POSITION_STALE_ARMED: &str = "when = 'position.silent_s >= 0.5 s'\nduring = 'armed'";

#[test]
fn ages_count_from_the_last_sample_and_are_absent_before_the_first() {
    let mut rig = Rig::watching(POSITION_STALE);
    rig.wait(s(1.0));
    assert_eq!(rig.last().ages, Some(v1::SourceAges::default()));
    assert_eq!(rig.last().battery, None);
    assert_eq!(rig.last().derived, None);

    rig.vehicle.silent = vec![Topic::BatteryStatus];
    rig.fly(1.0);
    rig.vehicle.silent = vec![Topic::VehicleAttitude];
    rig.fly(1.0);
    // Each sample arrives just after the introspection of its moment; the last is 10 ms old.
    let ages = rig.last().ages.unwrap();
    let one_by_one =
        [ages.status_s, ages.local_position_s, ages.global_position_s, ages.land_detected_s, ages.battery_s];
    assert_eq!(one_by_one, [Some(0.01); 5]);
    assert_eq!(ages.attitude_s, Some(1.01));
    assert!(rig.last().attitude.is_some(), "the value stays, with its age");
}

#[test]
fn the_introspection_holds_the_derived_values() {
    let mut rig = Rig::watching(POSITION_STALE);
    rig.vehicle.local_position.velocity = Some(v1::NedVelocity { north_m_s: 3.0, east_m_s: 4.0, down_m_s: -2.0 });
    rig.hear_every_source();
    rig.wait(s(0.01));
    let derived = rig.last().derived.unwrap();
    assert!((derived.ground_speed_m_s - 5.0).abs() < 1e-6);
    assert_eq!((derived.height_m, derived.climb_rate_m_s, derived.distance_home_m), (10.0, 2.0, 50.0));
    assert_eq!((derived.tilt_rad, derived.flying), (0.0, true));
}

#[test]
fn a_silent_source_is_stale_at_its_limit_and_fine_with_its_next_sample() {
    let mut rig = Rig::watching(POSITION_STALE);
    rig.fly(1.0);
    rig.vehicle.silent = vec![Topic::VehicleLocalPosition];
    rig.fly(1.0);
    rig.vehicle.silent.clear();
    rig.fly(1.0);
    assert_eq!(rig.story(), ["1.490 watched up: local position has been silent for 0.5 s", "2.000 watched down",]);
}

#[test]
fn silence_is_noticed_even_if_nothing_else_arrives() {
    let mut rig = Rig::watching(POSITION_STALE);
    rig.wait(s(0.0031));
    rig.hear_every_source();
    rig.wait(s(3.0));
    assert_eq!(rig.story(), ["0.503 watched up: local position has been silent for 0.5 s"]);
}

#[test]
fn what_the_monitor_did_not_listen_to_is_no_silence() {
    #[track_caller]
    fn check(after: impl FnOnce(&mut Rig), expected: &[&str]) {
        let mut rig = Rig::watching(POSITION_STALE);
        rig.fly(1.0);
        rig.stall(s(8.0));
        // What was said meanwhile is still under way.
        rig.wait(s(0.3));
        after(&mut rig);
        assert_eq!(rig.story(), expected);
    }
    check(|rig| rig.fly(1.0), &[]);
    check(|rig| rig.wait(s(1.0)), &["9.490 watched up: local position has been silent for 0.5 s"]);
}

#[test]
fn an_invalid_sample_counts_as_none() {
    let mut rig = Rig::watching(POSITION_STALE);
    rig.fly(1.0);
    rig.vehicle.local_position.position = Some(v1::Ned { north_m: f64::NAN, ..Default::default() });
    rig.fly(1.0);
    assert_eq!(rig.story(), ["1.490 watched up: local position has been silent for 0.5 s"]);
    assert!(rig.last().local_position.unwrap().position.unwrap().north_m.is_finite());
    assert_eq!(rig.last().ages.unwrap().local_position_s, Some(1.01));
    assert_eq!(rig.refused.len(), 100, "each is refused");
    let position = "north NaN, east 0.0, down 0.0";
    let expected = format!("fmu/out/vehicle_local_position: `position` is {position}, expected metres within 1,000 km");
    assert_eq!(rig.refused[0], expected);
}

#[test]
fn a_source_that_sent_only_invalid_samples_is_absent() {
    let mut rig = Rig::watching(POSITION_STALE);
    rig.vehicle.battery.remaining = f64::NAN;
    rig.fly(1.0);
    assert_eq!((rig.last().battery, rig.last().ages.unwrap().battery_s), (None, None));
}

#[test]
fn a_status_with_a_mode_that_has_no_name_here_is_still_a_status() {
    let mut rig = Rig::watching(POSITION_STALE);
    (rig.vehicle.status.intended_mode, rig.vehicle.status.actual_mode) = (0, 77);
    rig.fly(1.0);
    assert_eq!((rig.last().ages.unwrap().status_s, rig.last().status.as_ref().unwrap().armed), (Some(0.01), true));
    assert_eq!(rig.refused, [""; 0]);
}

#[test]
fn a_source_that_repeats_its_values_is_stale_but_only_while_armed() {
    let mut rig = Rig::watching(POSITION_STALE);
    rig.vehicle.status.armed = false;
    rig.vehicle.frozen = vec![Topic::VehicleLocalPosition];
    rig.fly(2.0);
    assert_eq!(rig.story(), [""; 0]);
    assert_eq!(rig.last().ages.unwrap().local_position_s, Some(0.01));

    rig.vehicle.status.armed = true;
    rig.fly(2.0);
    rig.vehicle.frozen.clear();
    rig.fly(1.0);
    // 60 repetitions at 100 Hz; by then the last new sample is 0.6 s old.
    assert_eq!(
        rig.story(),
        ["2.590 watched up: local position has repeated the same values for 0.6 s", "4.000 watched down",]
    );
}

#[test]
fn a_battery_without_a_measured_current_may_stay_as_it_is() {
    let mut rig = Rig::watching(POSITION_STALE);
    rig.vehicle.battery.current_a = None;
    rig.fly(5.0);
    assert_eq!(rig.last().ages.unwrap().battery_s, Some(0.01));
}

#[test]
fn each_source_that_measures_or_tells_its_time_can_be_found_frozen() {
    #[track_caller]
    fn check(topic: Topic, age: fn(&v1::SourceAges) -> Option<f64>, expected: bool) {
        let mut rig = Rig::watching(POSITION_STALE);
        rig.vehicle.frozen = vec![topic];
        rig.fly(3.0);
        assert_eq!(age(&rig.last().ages.unwrap()).unwrap() > 2.9, expected, "{topic:?}");
    }
    check(Topic::VehicleAttitude, |it| it.attitude_s, true);
    check(Topic::VehicleLocalPosition, |it| it.local_position_s, true);
    check(Topic::VehicleGlobalPosition, |it| it.global_position_s, true);
    check(Topic::BatteryStatus, |it| it.battery_s, true);
    check(Topic::VehicleStatus, |it| it.status_s, true);
    check(Topic::VehicleLandDetected, |it| it.land_detected_s, false);
}

#[test]
fn a_status_that_tells_no_time_may_stay_as_it_is() {
    let mut rig = Rig::watching(POSITION_STALE);
    (rig.vehicle.frozen, rig.vehicle.status.timestamp_us) = (vec![Topic::VehicleStatus], 0);
    rig.fly(3.0);
    assert_eq!(rig.last().ages.unwrap().status_s, Some(0.01));
}

#[test]
fn no_source_is_stale_before_any_was_heard() {
    let mut rig = Rig::watching(POSITION_STALE);
    rig.wait(s(60.0));
    assert_eq!(rig.story(), [""; 0]);
}

#[test]
fn a_source_that_was_never_heard_is_stale_once_others_have_been_for_a_while() {
    let mut rig = Rig::watching(POSITION_STALE);
    rig.wait(s(10.0));
    rig.vehicle.silent = vec![Topic::VehicleLocalPosition];
    rig.fly(6.0);
    assert_eq!(rig.last().ages.unwrap().local_position_s, None);
    rig.vehicle.silent.clear();
    rig.fly(1.0);
    assert_eq!(
        rig.story(),
        [
            "15.000 watched up: local position was not heard in the 5.0 s since the first other source",
            "16.000 watched down",
        ]
    );
}

#[test]
fn staleness_applies_in_its_situation_only() {
    let mut rig = Rig::watching(POSITION_STALE_ARMED);
    rig.vehicle.status.armed = false;
    rig.fly(1.0);
    rig.vehicle.silent = vec![Topic::VehicleLocalPosition];
    rig.fly(1.0);
    assert_eq!(rig.story(), [""; 0]);
    rig.vehicle.status.armed = true;
    rig.fly(1.0);
    rig.vehicle.status.armed = false;
    rig.fly(1.0);
    assert_eq!(rig.story(), ["2.000 watched up: local position has been silent for 1.0 s", "3.000 watched down",]);
}

#[test]
fn a_limit_keeps_its_wall_clock_floor_when_mission_time_runs_fast() {
    let table = table(&[("watched", POSITION_STALE)]);
    let mut rig = Rig::with(&table, Pace::new(20.0).unwrap());
    rig.fly(1.0);
    rig.wait(s(12.0));
    assert_eq!(rig.story(), ["10.990 watched up: local position has been silent for 0.5 s"]);
}

#[test]
fn samples_that_waited_while_the_process_paused_prove_that_no_source_was_silent() {
    let mut rig = Rig::watching(POSITION_STALE);
    rig.fly(1.0);
    rig.stall(s(2.0));
    rig.hear_every_source();
    rig.fly(1.0);
    assert_eq!(rig.story(), [""; 0]);
}

/// A monitor that is started while the ground and the tower are silent, and what it says; `told`: what the one before it has heard.
#[track_caller]
fn started_in_silence(armed: bool, told: v1::ToldByMonitor, expected: &[&str]) {
    let rules = [
        ("link", "when = 'known(link.silent_s) and link.silent_s >= 10 s'\nduring = 'armed'"),
        ("tower", "when = 'known(tower.silent_s) and tower.silent_s >= 10 s'\nduring = 'armed'"),
    ];
    let mut rig = Rig::with(&table(&rules), Pace::REAL_TIME);
    rig.vehicle.silent = vec![Topic::GroundContact, Topic::PermissionLedger];
    rig.vehicle.manager.told = Some(told);
    rig.vehicle.status.armed = armed;
    rig.fly(1.0);
    rig.vehicle.status.armed = true;
    rig.fly(30.0);
    assert_eq!(rig.story(), expected);
    let ages = rig.last().ages.unwrap();
    assert_eq!((ages.ground_link_s, ages.control_tower_s), (None, None), "this monitor has not heard them");
}

#[test]
fn what_was_lost_before_a_monitor_was_started_in_flight_is_still_lost() {
    let told = |ground_link, control_tower| v1::ToldByMonitor { ground_link, control_tower, flight_s: 0.0 };
    let link = "10.000 link up: the link to the ground was not heard in the 10.0 s since the first other source";
    let tower = "10.000 tower up: the control tower was not heard in the 10.0 s since the first other source";
    started_in_silence(true, told(true, false), &[link]);
    started_in_silence(true, told(false, true), &[tower]);
    started_in_silence(true, told(true, true), &[link, tower]);
    // It never had any, or begins a flight without.
    started_in_silence(true, told(false, false), &[]);
    started_in_silence(false, told(true, true), &[]);
}

#[test]
fn a_monitor_that_is_started_in_flight_goes_on_with_the_time_of_the_flight() {
    let mut rig = Rig::watching("when = \"known(flight.time_s) and flight.time_s > 3600 s\"");
    rig.vehicle.manager.told = Some(v1::ToldByMonitor { flight_s: 3590.0, ..Default::default() });
    rig.fly(2.0);
    let flown_s = rig.last().derived.unwrap().flight_s;
    // What the manager tells stands still here, and what has passed since it was heard first counts.
    assert!((3591.9..=3592.0).contains(&flown_s), "{flown_s}");
    rig.vehicle.manager.told = None;
    rig.fly(10.0);
    assert_eq!(rig.story().len(), 1, "{:?}", rig.story());
    rig.vehicle.touch_down();
    rig.fly(5.0);
    rig.vehicle.lift_off();
    rig.fly(5.0);
    let flown_s = rig.last().derived.unwrap().flight_s;
    assert!(flown_s < 10.0, "another flight: {flown_s}");
}

#[test]
fn a_link_is_lost_when_either_direction_is_lost_and_only_if_it_existed() {
    /// Flies with a contact to the ground, then with `change`, and compares what is said about the link.
    #[track_caller]
    fn check(before_s: f64, change: impl FnOnce(&mut crate::stories::rig::Vehicle), after_s: f64, expected: &[&str]) {
        let mut rig = Rig::watching("when = 'known(link.silent_s) and link.silent_s >= 2 s'");
        rig.vehicle.silent = vec![Topic::GroundContact];
        rig.fly(6.0);
        rig.vehicle.silent.clear();
        rig.fly(before_s);
        change(&mut rig.vehicle);
        rig.fly(after_s);
        assert_eq!(rig.story(), expected);
    }
    let silent = |vehicle: &mut crate::stories::rig::Vehicle| vehicle.silent = vec![Topic::GroundContact];
    check(0.0, silent, 10.0, &[]);
    check(1.0, |_| (), 10.0, &[]);
    check(1.0, silent, 1.9, &[]);
    check(1.0, silent, 3.0, &["8.990 watched up: the link to the ground has been silent for 2.0 s"]);
    let unheard = |vehicle: &mut crate::stories::rig::Vehicle| vehicle.unheard_s = 5.0;
    check(1.0, unheard, 1.0, &["7.000 watched up: the link to the ground has been silent for 5.0 s"]);
    check(1.0, |vehicle| vehicle.unheard_s = f64::NAN, 1.0, &[]);
    check(1.0, |vehicle| vehicle.unheard_s = -1.0, 1.0, &[]);
}

#[test]
fn a_process_that_does_not_turn_is_silent_whatever_the_vehicle_and_the_others_say() {
    const RULE: &str = "when = 'planner.silent_s >= 1 s'\nduring = 'flying'";
    /// Flies for two seconds at this speed, and then while these processes hang.
    #[track_caller]
    fn check(speed: f64, hung: &[&'static str], seconds: f64, expected: &[&str]) {
        let mut rig = Rig::with(&table(&[("watched", RULE)]), Pace::new(speed).unwrap());
        rig.fly(2.0);
        rig.vehicle.hung = hung.to_vec();
        rig.fly(seconds);
        rig.vehicle.hung.clear();
        rig.fly(0.1);
        assert_eq!(rig.story(), expected);
    }
    check(1.0, &["planner"], 0.9, &[]);
    check(1.0, &["mcm", "skill-manager", "vehicle-sim"], 10.0, &[]);
    let up = "2.990 watched up: the planner has been silent for 1.0 s";
    check(1.0, &["planner"], 3.0, &[up, "5.000 watched down"]);
    // Its limit is in wall time.
    check(20.0, &["planner"], 19.0, &[]);
    let up = "21.990 watched up: the planner has been silent for 1.0 s";
    check(20.0, &["planner"], 30.0, &[up, "32.000 watched down"]);
}
