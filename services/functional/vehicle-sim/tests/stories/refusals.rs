use domain::geometry::Ned;
use kittiwake_proto::v1::{self, FlightMode};

use crate::stories::support::{Flight, arm, disarm, land, loiter, offboard, set_mode, takeoff};

#[test]
fn what_is_rejected_while_disarmed() {
    let mut flight = Flight::new();
    flight.pass(1.0);
    flight.rejected(takeoff(10.0), "the vehicle is disarmed");
    flight.rejected(land(), "the vehicle is on the ground");
    flight.rejected(offboard(), "there are no fresh offboard setpoints");
    flight.accepted(disarm());
    flight.accepted(loiter());
}

#[test]
fn what_is_rejected_while_armed_on_the_ground() {
    let mut flight = Flight::new();
    flight.accepted(arm());
    flight.accepted(arm());
    flight.rejected(land(), "the vehicle is on the ground");
    flight.rejected(offboard(), "there are no fresh offboard setpoints");
    let ack = flight.command(takeoff(0.0)).unwrap();
    assert!(ack.reason.starts_with("a takeoff to 0.0 m is not a climb from"), "{}", ack.reason);
    flight.accepted(disarm());
    assert!(!flight.status.armed);
}

#[test]
fn what_is_rejected_in_the_air() {
    let mut flight = Flight::airborne();
    flight.rejected(takeoff(20.0), "the vehicle is in the air");
    flight.rejected(disarm(), "the vehicle is in the air");
    flight.rejected(offboard(), "there are no fresh offboard setpoints");
    flight.stream_position(Ned::new(0.0, 0.0, -10.0), None);
    flight.pass(0.5);
    flight.stop_streaming();
    flight.pass(0.9);
    flight.accepted(offboard());
    flight.accepted(loiter());
    flight.pass(0.3);
    flight.rejected(offboard(), "there are no fresh offboard setpoints");
    flight.accepted(arm());
}

#[test]
fn an_invalid_command_is_rejected_with_what_is_wrong() {
    let mut flight = Flight::new();
    flight.accepted(arm());
    for mode in [FlightMode::Unspecified, FlightMode::Takeoff, FlightMode::Land, FlightMode::Return] {
        let reason = format!("the command is invalid: `mode` is {mode:?}, expected Loiter or Offboard");
        flight.rejected(set_mode(mode), &reason);
    }
    flight.rejected(takeoff(f64::NAN), "the command is invalid: `altitude_m` is NaN, expected a finite number");
    flight.rejected(takeoff(f64::INFINITY), "the command is invalid: `altitude_m` is inf, expected a finite number");
    flight.pass(3.0);
    assert!(flight.landed.landed);
    let reason = "fmu/in/vehicle_command: `altitude_m` is NaN, expected a finite number";
    assert_eq!((flight.refused.len(), flight.refused[4].as_str()), (6, reason), "and each is reported");
}

#[test]
fn a_command_without_content_is_rejected_by_its_id() {
    let mut flight = Flight::new();
    let ack = flight.send(v1::VehicleCommand { id: 77, command: None }).unwrap();
    assert_eq!((ack.id, ack.result()), (77, v1::CommandResult::Rejected));
    assert_eq!(ack.reason, "the command is invalid: `command` is missing");
}

#[test]
fn a_vehicle_that_cannot_fly_is_not_armed() {
    #[track_caller]
    fn check(fault: &str, reason: &str) {
        let mut flight = Flight::new();
        flight.fault(fault);
        flight.pass(0.1);
        flight.rejected(arm(), reason);
        flight.fault("clear");
        flight.fault("battery 1");
        flight.pass(10.0);
        flight.accepted(arm());
    }
    check("motor_failure", "a motor has failed");
    check("battery 0.04", "the battery is nearly empty");
    check("gnss_loss", "the position is not known");
    check("estimator_invalid", "the position is not known");
}
