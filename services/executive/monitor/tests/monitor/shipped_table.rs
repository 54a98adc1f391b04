//! The shipped table: the rule of every row raises its flag.

use domain::contingency::Rule;
use domain::contingency::rule::{Condition, DataSource, Quantity};
use domain::time::Pace;
use kittiwake_proto::topics::Topic;
use kittiwake_proto::v1::{self, FailureFlag};

use crate::rig::{Rig, Vehicle, s, shipped};

#[test]
fn no_flag_is_raised_while_all_is_well() {
    let mut rig = Rig::with(&shipped(), Pace::REAL_TIME);
    rig.fly(10.0);
    assert_eq!(rig.story(), [""; 0]);
}

#[test]
fn every_row_with_a_rule_is_raised_once_and_cleared_again() {
    let table = shipped();
    let rules = table.rows().iter().filter_map(|row| Some((row.flag.as_str(), row.raise?)));
    for (flag, rule) in rules {
        let mut rig = Rig::with(&table, Pace::REAL_TIME);
        rig.fly(2.0);
        make_it_so(&mut rig.vehicle, rule);
        if let Rule::Above { value: Quantity::TouchdownSpeed, .. } = rule {
            rig.fly(0.1);
            rig.vehicle.touch_down();
        }
        rig.fly(lasting_s(rule) + 0.1);
        rig.vehicle = Vehicle::default();
        rig.fly(0.1);
        let changes: Vec<_> = rig.events().filter(|(_, it)| it.name == flag).map(|(_, it)| it.raised).collect();
        assert_eq!(changes, [true, false], "{flag}");
        assert!(rig.up().is_empty(), "{flag}");
    }
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
            "3.000 battery_low up: battery remaining 0.20, below 0.25 for 1.0 s",
            "4.500 battery_critical up: battery remaining 0.09, below 0.10 for 0.5 s",
            "7.990 battery_stale up: battery status has been silent for 2.0 s, the limit is 2.0 s",
            "20.990 battery_gone up: battery status has been silent for 15.0 s, the limit is 15.0 s",
            "22.005 battery_gone down: the vehicle is no longer flying",
        ]
    );
}

fn lasting_s(rule: Rule) -> f64 {
    match rule {
        Rule::Below { for_s, .. } | Rule::Above { for_s, .. } | Rule::Reported { for_s, .. } => for_s,
        Rule::Stale { after_s, .. } => after_s.get(),
    }
}

fn make_it_so(vehicle: &mut Vehicle, rule: Rule) {
    match rule {
        Rule::Below { value, threshold, .. } => measure(vehicle, value, threshold - 0.01),
        Rule::Above { value, threshold, .. } => measure(vehicle, value, threshold + 0.01),
        Rule::Reported { condition: Condition::LandDetectorContradicts, .. } => vehicle.land_detected.landed = true,
        Rule::Reported { condition, .. } => vehicle.status.failures.push(failure(condition) as i32),
        Rule::Stale { source: DataSource::Planner, .. } => vehicle.hung.push("planner"),
        Rule::Stale { source: DataSource::SkillManager, .. } => vehicle.hung.push("skill-manager"),
        Rule::Stale { source: DataSource::MissionManager, .. } => vehicle.hung.push("mcm"),
        Rule::Stale { source, .. } => vehicle.silent.push(topic(source)),
    }
}

fn measure(vehicle: &mut Vehicle, quantity: Quantity, value: f64) {
    let local = &mut vehicle.local_position;
    match quantity {
        Quantity::BatteryRemaining => vehicle.battery.remaining = value,
        Quantity::BatteryVoltage => vehicle.battery.voltage_v = value,
        Quantity::BatteryTemperature => vehicle.battery.temperature_c = value,
        Quantity::HorizontalAccuracy => local.eph_m = value,
        Quantity::VerticalAccuracy => local.epv_m = value,
        Quantity::Height => local.position = Some(v1::Ned { down_m: -value, ..Default::default() }),
        Quantity::DistanceHome => local.position = Some(v1::Ned { north_m: value, ..Default::default() }),
        Quantity::GroundSpeed => local.velocity = Some(v1::NedVelocity { east_m_s: value, ..Default::default() }),
        Quantity::TouchdownSpeed => {
            local.velocity = Some(v1::NedVelocity { down_m_s: value, ..Default::default() });
        }
        Quantity::Tilt => (vehicle.attitude.q_x, vehicle.attitude.q_w) = (value / 2.0).sin_cos(),
    }
}

fn failure(condition: Condition) -> FailureFlag {
    match condition {
        Condition::EstimatorInvalid => FailureFlag::Estimator,
        Condition::OffboardSignalLost => FailureFlag::OffboardSignalLost,
        Condition::GnssLost => FailureFlag::GnssLost,
        Condition::MotorFailure => FailureFlag::Motor,
        Condition::BatteryFailure => FailureFlag::Battery,
        Condition::GroundLinkLost => FailureFlag::GroundLinkLost,
        Condition::LandDetectorContradicts => unreachable!("no failure that the vehicle reports"),
    }
}

fn topic(source: DataSource) -> Topic {
    match source {
        DataSource::Status => Topic::VehicleStatus,
        DataSource::Attitude => Topic::VehicleAttitude,
        DataSource::LocalPosition => Topic::VehicleLocalPosition,
        DataSource::GlobalPosition => Topic::VehicleGlobalPosition,
        DataSource::LandDetected => Topic::VehicleLandDetected,
        DataSource::Battery => Topic::BatteryStatus,
        DataSource::GroundLink => Topic::GroundContact,
        DataSource::Planner | DataSource::SkillManager | DataSource::MissionManager => Topic::Heartbeat,
    }
}
