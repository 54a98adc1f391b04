//! The shipped table: what every row watches raises its flag.

use domain::contingency::Row;
use domain::time::Pace;
use kittiwake_proto::topics::Topic;
use kittiwake_proto::v1::{self, FailureFlag};

use crate::stories::rig::{Rig, SHIPPED, Vehicle, s, shipped};

#[test]
fn no_flag_is_raised_while_all_is_well() {
    let mut rig = Rig::with(&shipped(), Pace::REAL_TIME);
    rig.fly(10.0);
    assert_eq!(rig.story(), [""; 0]);
}

/// A flag, what raises it, and after how many seconds at most.
type Cause = (&'static str, fn(&mut Rig), f64);

/// What raises the flag of each row with an expression, and the seconds after which it has fallen again once all is well.
const CAUSES: [Cause; 54] = [
    ("crashed", |rig| falls(rig), 0.2),
    ("motor_failure", |rig| reports(rig, FailureFlag::Motor), 0.1),
    ("attitude_exceeded", |rig| (rig.vehicle.attitude.q_x, rig.vehicle.attitude.q_w) = 0.6_f64.sin_cos(), 0.1),
    (
        "sinking",
        |rig| rig.vehicle.local_position.velocity = Some(v1::NedVelocity { down_m_s: 4.1, ..Default::default() }),
        0.1,
    ),
    ("autopilot_preempts", |rig| rig.vehicle.status.failsafe = true, 0.1),
    ("estimator_lost", |rig| reports(rig, FailureFlag::Estimator), 0.1),
    ("autopilot_comes_down", |rig| rig.vehicle.status.failsafe = true, 0.1),
    ("local_position_stale", |rig| rig.vehicle.silent.push(Topic::VehicleLocalPosition), 0.1),
    ("heading_fault", |rig| rig.vehicle.local_position.heading_rad = -1.1, 0.1),
    ("gnss_lost", |rig| reports(rig, FailureFlag::GnssLost), 0.1),
    ("attitude_stale", |rig| rig.vehicle.silent.push(Topic::VehicleAttitude), 0.1),
    ("position_uncertain", |rig| rig.vehicle.local_position.epv_m = 5.1, 0.1),
    ("position_jumped", |rig| rig.vehicle.local_position.position = Some(place(41.0)), 21.0),
    ("battery_emergency", |rig| rig.vehicle.battery.remaining = 0.049, 0.1),
    ("battery_critical", |rig| rig.vehicle.battery.remaining = 0.099, 0.1),
    ("energy_short", |rig| energy(rig).best = margin(-0.001), 0.1),
    ("battery_low", |rig| rig.vehicle.battery.remaining = 0.249, 0.1),
    ("home_out_of_reach", |rig| energy(rig).home = margin(-0.001), 0.1),
    ("battery_gone", |rig| rig.vehicle.silent.push(Topic::BatteryStatus), 0.1),
    ("battery_stale", |rig| rig.vehicle.silent.push(Topic::BatteryStatus), 0.1),
    ("battery_hot", |rig| rig.vehicle.battery.temperature_c = Some(60.1), 0.1),
    (
        "battery_hot_on_ground",
        |rig| {
            rig.vehicle.battery.temperature_c = Some(60.1);
            rig.vehicle.touch_down();
        },
        0.1,
    ),
    ("traffic_near", |rig| rig.vehicle.traffic = Some(aircraft(600.0, v1::TrafficKind::Unspecified)), 16.0),
    ("too_high", |rig| rig.vehicle.local_position.position = Some(v1::Ned { down_m: -150.1, ..place(30.0) }), 21.0),
    ("wind_too_strong", |rig| rig.vehicle.wind = Some(v1::WindEstimate { north_m_s: 9.0, east_m_s: -11.0 }), 121.0),
    ("wind_high", |rig| rig.vehicle.wind = Some(v1::WindEstimate { north_m_s: 8.0, east_m_s: 6.1 }), 120.1),
    ("gust_too_strong", |rig| rig.vehicle.wind = Some(v1::WindEstimate { north_m_s: 15.0, east_m_s: -9.0 }), 121.0),
    ("land_detector_contradicts", |rig| rig.vehicle.land_detected.landed = true, 0.1),
    ("status_stale", |rig| rig.vehicle.silent.push(Topic::VehicleStatus), 0.1),
    ("gust_at_landing", |rig| rig.vehicle.wind = Some(v1::WindEstimate { north_m_s: 13.1, east_m_s: 0.0 }), 121.0),
    ("vibration_extreme", |rig| rig.vehicle.status.vibration_m_s2 = Some(60.1), 0.1),
    ("vibration_high", |rig| rig.vehicle.status.vibration_m_s2 = Some(30.1), 0.1),
    ("offboard_link_lost", |rig| reports(rig, FailureFlag::OffboardSignalLost), 0.1),
    ("autopilot_not_ready", |rig| (rig.vehicle.status.armed, rig.vehicle.status.can_arm) = (false, Some(false)), 0.1),
    ("vessel_near", |rig| rig.vehicle.traffic = Some(aircraft(59.0, v1::TrafficKind::Vessel)), 16.0),
    ("drone_near", |rig| rig.vehicle.traffic = Some(aircraft(170.0, v1::TrafficKind::Uncrewed)), 16.0),
    ("path_deviated", |rig| progress(rig).path_deviation_m = Some(20.1), 0.1),
    ("consumption_high", |rig| energy(rig).consumption = Some(1.21), 0.1),
    ("link_gone", |rig| rig.vehicle.silent.push(Topic::GroundContact), 0.1),
    ("link_lost", |rig| rig.vehicle.silent.push(Topic::GroundContact), 0.1),
    ("tower_lost", |rig| rig.vehicle.silent.push(Topic::PermissionLedger), 0.1),
    ("skill_manager_lost", |rig| rig.vehicle.hung.push("skill-manager"), 0.1),
    ("planner_gone", |rig| rig.vehicle.hung.push("planner"), 0.1),
    ("planner_lost", |rig| rig.vehicle.hung.push("planner"), 0.1),
    ("manager_lost", |rig| rig.vehicle.hung.push("mcm"), 0.1),
    ("clock_jumped", |rig| rig.utc_ms += 1200, 61.0),
    ("cancel_ignored", |rig| progress(rig).cancel_s = 5.1, 0.1),
    ("skill_overruns", |rig| progress(rig).pace = Some(0.66), 0.1),
    ("battery_faulty", |rig| reports(rig, FailureFlag::Battery), 0.1),
    ("no_plan", |rig| (progress(rig).plan_s, energy(rig).best) = (1.1, margin(0.029)), 0.1),
    ("operator_silent", |rig| progress(rig).operator_s = 600.1, 0.1),
    ("record_unwritable", |rig| rig.vehicle.record_trouble = "the disk is full".into(), 0.1),
    ("skill_missing", |rig| rig.vehicle.manager.skills_needed.push("winch".into()), 0.1),
    ("landing_target_lost", |rig| rig.vehicle.status.landing_target_seen = Some(false), 1.0),
];

/// It comes down too fast.
fn falls(rig: &mut Rig) {
    rig.vehicle.local_position.velocity = Some(v1::NedVelocity { down_m_s: 2.6, ..Default::default() });
    rig.fly(0.1);
    rig.vehicle.touch_down();
}

/// The autopilot reports that something failed.
fn reports(rig: &mut Rig, failure: FailureFlag) {
    rig.vehicle.status.failures.push(failure as i32);
}

fn place(north_m: f64) -> v1::Ned {
    v1::Ned { north_m, east_m: 40.0, down_m: -10.0 }
}

fn energy(rig: &mut Rig) -> &mut v1::EnergyOutlook {
    rig.vehicle.manager.energy.get_or_insert_default()
}

fn progress(rig: &mut Rig) -> &mut v1::FlightProgress {
    rig.vehicle.manager.progress.get_or_insert_default()
}

fn margin(margin: f64) -> Option<v1::PlaceOutlook> {
    Some(v1::PlaceOutlook { margin, ..Default::default() })
}

/// Traffic that stands still so far north of the origin, at the height of the vehicle, which is 30 m north and 40 m east.
fn aircraft(north_m: f64, kind: v1::TrafficKind) -> v1::TransponderReport {
    let position = Some(v1::Ned { north_m, east_m: 40.0, down_m: -10.0 });
    let velocity = Some(v1::NedVelocity::default());
    v1::TransponderReport { id: "other".into(), position, velocity, kind: kind.into() }
}

#[test]
fn every_row_with_an_expression_is_raised_once_and_cleared_again() {
    let table = shipped();
    // It falls by a landing only: a test of its own.
    let rows = || table.rows().iter().filter(|row| row.when.is_some() && row.flag != "flight_too_long");
    let with_expression: Vec<&str> = rows().map(|row| row.flag.as_str()).collect();
    assert_eq!(with_expression, CAUSES.map(|(flag, ..)| flag), "each row needs a cause");
    for (row, (flag, cause, falls_after_s)) in rows().zip(CAUSES) {
        let mut rig = Rig::with(&table, Pace::REAL_TIME);
        rig.fly(2.0);
        cause(&mut rig);
        rig.fly(lasting_s(row) + 0.1);
        rig.vehicle = Vehicle::default();
        rig.fly(falls_after_s);
        let changes = rig.changes_of(flag);
        assert_eq!(changes, [true, false], "{flag}: {:?}", rig.story());
        // The vehicle of the rig is lifted and set down at once.
        assert!(rig.up().iter().all(|it| *it == "position_jumped"), "{flag}: {:?}", rig.up());
    }
}

/// How long what raises a row must last, silences included.
fn lasting_s(row: &Row) -> f64 {
    let when = row.when.as_ref().expect("an expression");
    let silences = when.raises.thresholds().into_iter().filter(|it| it.field.silence().is_some()).map(|it| it.value);
    when.hold.as_secs_f64() + silences.fold(0.0, f64::max)
}

#[test]
fn a_flight_that_is_too_long_is_one_until_it_has_landed() {
    let mut rig = Rig::with(&shipped(), Pace::REAL_TIME);
    rig.fly(2.0);
    rig.stall(s(3597.0));
    rig.utc_ms += 3_597_000;
    rig.fly(0.9);
    assert!(rig.up().is_empty(), "{:?}", rig.story());
    rig.fly(0.7);
    assert_eq!(rig.up(), ["flight_too_long"]);
    rig.vehicle.touch_down();
    rig.fly(0.1);
    assert!(rig.up().is_empty(), "{:?}", rig.story());
}

/// As after a landing, with an autopilot that estimates the wind in flight alone.
#[test]
fn much_wind_that_is_not_estimated_any_more_keeps_nothing_on_the_ground_for_longer_than_two_minutes() {
    let mut rig = Rig::with(&shipped(), Pace::REAL_TIME);
    rig.vehicle.wind = Some(v1::WindEstimate { north_m_s: 8.0, east_m_s: 6.1 });
    rig.fly(11.0);
    assert_eq!(rig.up(), ["wind_high"]);
    rig.vehicle.wind = None;
    rig.fly(9.0);
    assert_eq!(rig.up(), ["wind_high"], "the last estimate counts for ten seconds");
    rig.fly(121.0);
    assert!(rig.up().is_empty(), "{:?}", rig.story());
}

/// The autopilot has its own attitude, and flies on.
#[test]
fn an_attitude_that_was_never_heard_is_no_tilt() {
    let mut rig = Rig::with(&shipped(), Pace::REAL_TIME);
    rig.vehicle.silent = vec![Topic::VehicleAttitude];
    rig.fly(8.0);
    assert_eq!(rig.up(), ["attitude_stale"]);
}

#[test]
fn every_row_names_its_alarm_and_the_source_of_its_numbers() {
    let text = std::fs::read_to_string(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(SHIPPED)).unwrap();
    let table = shipped();
    for key in ["alarm", "source"] {
        let named = text.lines().filter(|line| line.starts_with(&format!("{key} = "))).count();
        assert_eq!(named, table.rows().len(), "rows with `{key}`");
    }
    assert!(table.rows().iter().all(|row| row.source.is_some()));
    assert!(35 <= table.rows().len());
}

#[test]
fn a_battery_that_runs_empty_raises_its_flags_in_order() {
    let mut rig = Rig::with(&shipped(), Pace::REAL_TIME);
    for remaining in [0.3, 0.2, 0.09] {
        rig.vehicle.battery.remaining = remaining;
        rig.fly(2.0);
    }
    rig.vehicle.silent = vec![Topic::BatteryStatus];
    rig.wait(s(0.005));
    rig.fly(16.0);
    rig.vehicle.touch_down();
    rig.fly(0.1);
    assert_eq!(
        rig.story(),
        [
            "3.000 battery_low up: battery.charge_percent 20.00 %",
            "4.500 battery_critical up: battery.charge_percent 9.00 %",
            "7.990 battery_stale up: battery status has been silent for 2.0 s",
            "20.990 battery_gone up: battery status has been silent for 15.0 s",
            "22.005 battery_gone down",
        ]
    );
}
