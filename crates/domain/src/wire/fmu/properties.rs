//! A value survives the wire, and a number that makes no sense never becomes a value.

use std::fmt::Debug;
use std::ops::RangeInclusive;

use kittiwake_proto::v1;
use proptest::prelude::*;

use super::samples;
use crate::fmu::{
    Attitude, Battery, CommandAck, GlobalPosition, LandDetected, LocalPosition, OffboardControl, Setpoint, Status,
    TransponderReport, VehicleCommand, Wind,
};
use crate::wire::InvalidMessage;

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_command_survives_the_wire(it in samples::command()) {
        prop_assert_eq!(VehicleCommand::try_from(v1::VehicleCommand::from(it)), Ok(it));
    }

    #[test]
    fn an_acknowledgement_survives_the_wire(it in samples::ack()) {
        prop_assert_eq!(CommandAck::try_from(v1::VehicleCommandAck::from(it.clone())), Ok(it));
    }

    #[test]
    fn a_proof_of_life_survives_the_wire(it in samples::control()) {
        prop_assert_eq!(OffboardControl::try_from(v1::OffboardControlMode::from(it)), Ok(it));
    }

    #[test]
    fn a_setpoint_survives_the_wire(it in samples::setpoint()) {
        prop_assert_eq!(Setpoint::try_from(v1::TrajectorySetpoint::from(it)), Ok(it));
    }

    #[test]
    fn a_status_survives_the_wire(it in samples::status()) {
        prop_assert_eq!(Status::from(v1::VehicleStatus::from(it.clone())), it);
    }

    #[test]
    fn an_attitude_survives_the_wire(it in samples::attitude()) {
        prop_assert_eq!(Attitude::try_from(v1::VehicleAttitude::from(it)), Ok(it));
    }

    #[test]
    fn a_local_position_survives_the_wire(it in samples::local_position()) {
        prop_assert_eq!(LocalPosition::try_from(v1::VehicleLocalPosition::from(it)), Ok(it));
    }

    #[test]
    fn a_global_position_survives_the_wire(it in samples::global_position()) {
        prop_assert_eq!(GlobalPosition::try_from(v1::VehicleGlobalPosition::from(it)), Ok(it));
    }

    #[test]
    fn a_land_detection_survives_the_wire(it in samples::land_detected()) {
        prop_assert_eq!(LandDetected::from(v1::VehicleLandDetected::from(it)), it);
    }

    #[test]
    fn a_battery_survives_the_wire(it in samples::battery()) {
        prop_assert_eq!(Battery::try_from(v1::BatteryStatus::from(it)), Ok(it));
    }

    #[test]
    fn a_wind_survives_the_wire(it in samples::wind()) {
        prop_assert_eq!(Wind::try_from(v1::WindEstimate::from(it)), Ok(it));
    }

    #[test]
    fn a_transponder_report_survives_the_wire(it in samples::transponder_report()) {
        prop_assert_eq!(TransponderReport::try_from(v1::TransponderReport::from(it.clone())), Ok(it));
    }
}

/// A number of a message, and the range in which it makes sense.
type Number<M> = (fn(&mut M) -> &mut f64, RangeInclusive<f64>);

const FINITE: RangeInclusive<f64> = f64::MIN..=f64::MAX;
/// From the smallest number above zero.
const POSITIVE: RangeInclusive<f64> = 5e-324..=f64::MAX;
const REACH_M: RangeInclusive<f64> = -1e6..=1e6;
const SPEED_M_S: RangeInclusive<f64> = -1e3..=1e3;
const DEVIATION_M: RangeInclusive<f64> = 0.0..=1e6;

/// Checks that each number, one at a time, is refused as not a number, as infinite, and just outside its range.
#[track_caller]
fn check_numbers<T, M>(message: &M, numbers: &[Number<M>])
where
    T: TryFrom<M, Error = InvalidMessage>,
    M: Clone + Debug,
{
    assert!(T::try_from(message.clone()).is_ok(), "{message:?}");
    for (field, range) in numbers {
        let outside = [range.start().next_down(), range.end().next_up()];
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY].into_iter().chain(outside) {
            let mut spoiled = message.clone();
            *field(&mut spoiled) = value;
            assert!(T::try_from(spoiled.clone()).is_err(), "{spoiled:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_setpoint_is_checked(it in samples::setpoint()) {
        let mut message = v1::TrajectorySetpoint::from(it);
        let mut numbers: Vec<Number<v1::TrajectorySetpoint>> = vec![
            (|it| it.speed_limit_m_s.get_or_insert_default(), POSITIVE),
            (|it| it.yaw_rad.get_or_insert_default(), FINITE),
            (|it| it.yaw_rate_rad_s.get_or_insert_default(), FINITE),
        ];
        if message.position.is_some() {
            numbers.push((|it| &mut it.position.get_or_insert_default().north_m, REACH_M));
            numbers.push((|it| &mut it.position.get_or_insert_default().east_m, REACH_M));
            numbers.push((|it| &mut it.position.get_or_insert_default().down_m, REACH_M));
        } else {
            numbers.push((|it| &mut it.velocity.get_or_insert_default().north_m_s, SPEED_M_S));
            numbers.push((|it| &mut it.velocity.get_or_insert_default().east_m_s, SPEED_M_S));
            numbers.push((|it| &mut it.velocity.get_or_insert_default().down_m_s, SPEED_M_S));
        }
        check_numbers::<Setpoint, v1::TrajectorySetpoint>(&message, &numbers);
        (message.position, message.velocity) = (Some(v1::Ned::default()), Some(v1::NedVelocity::default()));
        prop_assert!(Setpoint::try_from(message).is_err(), "either position or velocity");
    }

    #[test]
    fn an_attitude_is_checked(it in samples::attitude(), scale in prop_oneof![0.0..0.98, 1.02..100.0]) {
        check_numbers::<Attitude, v1::VehicleAttitude>(&it.into(), &[
            (|it| &mut it.q_w, FINITE),
            (|it| &mut it.q_x, FINITE),
            (|it| &mut it.q_y, FINITE),
            (|it| &mut it.q_z, FINITE),
            (|it| &mut it.roll_rate_rad_s, FINITE),
            (|it| &mut it.pitch_rate_rad_s, FINITE),
            (|it| &mut it.yaw_rate_rad_s, FINITE),
        ]);
        let [q_w, q_x, q_y, q_z] = [it.q_w, it.q_x, it.q_y, it.q_z].map(|it| it * scale);
        let scaled = v1::VehicleAttitude { q_w, q_x, q_y, q_z, ..it.into() };
        prop_assert!(Attitude::try_from(scaled).is_err(), "not a rotation");
    }

    #[test]
    fn a_local_position_is_checked(it in samples::local_position()) {
        check_numbers::<LocalPosition, v1::VehicleLocalPosition>(&it.into(), &[
            (|it| &mut it.position.get_or_insert_default().north_m, REACH_M),
            (|it| &mut it.position.get_or_insert_default().east_m, REACH_M),
            (|it| &mut it.position.get_or_insert_default().down_m, REACH_M),
            (|it| &mut it.velocity.get_or_insert_default().north_m_s, SPEED_M_S),
            (|it| &mut it.velocity.get_or_insert_default().east_m_s, SPEED_M_S),
            (|it| &mut it.velocity.get_or_insert_default().down_m_s, SPEED_M_S),
            (|it| &mut it.heading_rad, FINITE),
            (|it| &mut it.eph_m, DEVIATION_M),
            (|it| &mut it.epv_m, DEVIATION_M),
        ]);
    }

    #[test]
    fn a_global_position_is_checked(it in samples::global_position()) {
        check_numbers::<GlobalPosition, v1::VehicleGlobalPosition>(&it.into(), &[
            (|it| &mut it.latitude_deg, -90.0..=90.0),
            (|it| &mut it.longitude_deg, -180.0..=180.0),
            (|it| &mut it.altitude_amsl_m, REACH_M),
            (|it| &mut it.eph_m, DEVIATION_M),
            (|it| &mut it.epv_m, DEVIATION_M),
        ]);
    }

    #[test]
    fn a_battery_is_checked(it in samples::battery()) {
        check_numbers::<Battery, v1::BatteryStatus>(&it.into(), &[
            (|it| &mut it.voltage_v, 0.0..=1e4),
            (|it| it.current_a.get_or_insert_default(), FINITE),
            (|it| &mut it.remaining, 0.0..=1.0),
            (|it| it.temperature_c.get_or_insert_default(), -273.15..=1e3),
        ]);
    }

    #[test]
    fn a_wind_is_checked(it in samples::wind()) {
        check_numbers::<Wind, v1::WindEstimate>(&it.into(), &[(|it| &mut it.north_m_s, SPEED_M_S), (|it| &mut it.east_m_s, SPEED_M_S)]);
    }

    #[test]
    fn a_transponder_report_is_checked(it in samples::transponder_report()) {
        check_numbers::<TransponderReport, v1::TransponderReport>(&it.into(), &[
            (|it| &mut it.position.get_or_insert_default().north_m, REACH_M),
            (|it| &mut it.position.get_or_insert_default().east_m, REACH_M),
            (|it| &mut it.position.get_or_insert_default().down_m, REACH_M),
            (|it| &mut it.velocity.get_or_insert_default().north_m_s, SPEED_M_S),
            (|it| &mut it.velocity.get_or_insert_default().east_m_s, SPEED_M_S),
            (|it| &mut it.velocity.get_or_insert_default().down_m_s, SPEED_M_S),
        ]);
    }
}

#[test]
fn the_ends_of_a_range_belong_to_it() {
    for (voltage_v, current_a, remaining, temperature_c) in [(0.0, 0.0, 0.0, -273.15), (1e4, -1.0, 1.0, 1e3)] {
        let (current_a, temperature_c) = (Some(current_a), Some(temperature_c));
        let battery = v1::BatteryStatus { voltage_v, current_a, remaining, temperature_c };
        assert!(Battery::try_from(battery).is_ok(), "{battery:?}");
    }
    for (latitude_deg, longitude_deg, altitude_amsl_m, eph_m) in [(-90.0, -180.0, -1e6, 0.0), (90.0, 180.0, 1e6, 1e6)] {
        let epv_m = eph_m;
        let position = v1::VehicleGlobalPosition { latitude_deg, longitude_deg, altitude_amsl_m, eph_m, epv_m };
        assert!(GlobalPosition::try_from(position).is_ok(), "{position:?}");
    }
}

#[test]
fn a_part_that_is_missing_is_named() {
    #[track_caller]
    fn check<T: Debug + PartialEq>(result: Result<T, InvalidMessage>, part: &'static str) {
        assert_eq!(result, Err(InvalidMessage::Missing(part)));
    }
    check(VehicleCommand::try_from(v1::VehicleCommand { id: 1, command: None }), "command");
    check(CommandAck::try_from(v1::VehicleCommandAck { id: 1, ..Default::default() }), "result");
    check(CommandAck::try_from(v1::VehicleCommandAck { id: 1, result: 77, ..Default::default() }), "result");
    check(OffboardControl::try_from(v1::OffboardControlMode { control: 0 }), "control");
    check(OffboardControl::try_from(v1::OffboardControlMode { control: 77 }), "control");
    check(Setpoint::try_from(v1::TrajectorySetpoint::default()), "position or velocity");
    let (position, velocity) = (Some(v1::Ned::default()), Some(v1::NedVelocity::default()));
    check(LocalPosition::try_from(v1::VehicleLocalPosition { velocity, ..Default::default() }), "position");
    check(LocalPosition::try_from(v1::VehicleLocalPosition { position, ..Default::default() }), "velocity");
    check(TransponderReport::try_from(v1::TransponderReport { position, velocity, ..Default::default() }), "id");
}

#[test]
fn no_command_climbs_to_what_is_no_number() {
    for altitude_m in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let command = Some(v1::vehicle_command::Command::Takeoff(v1::TakeoffCommand { altitude_m }));
        assert!(VehicleCommand::try_from(v1::VehicleCommand { id: 1, command }).is_err(), "{altitude_m}");
    }
}

#[test]
fn only_loiter_and_offboard_can_be_set() {
    for mode in [0, 2, 3, 5, 77] {
        let command = Some(v1::vehicle_command::Command::SetMode(v1::SetMode { mode }));
        assert!(VehicleCommand::try_from(v1::VehicleCommand { id: 1, command }).is_err(), "{mode}");
    }
}

#[test]
fn what_has_no_name_here_is_left_out_of_a_status() {
    let message = v1::VehicleStatus { intended_mode: 77, failures: vec![77, 3], ..Default::default() };
    let status = Status::from(message);
    assert_eq!((status.intended, status.actual), (None, None));
    assert_eq!(status.failures, [crate::fmu::Failure::Estimator]);
    let status = Status::from(v1::VehicleStatus { gripper: 77, ..Default::default() });
    assert_eq!(status.gripper, None);
}
