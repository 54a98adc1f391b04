use kittiwake_proto::v1::Gripper;

use crate::stories::support::{Flight, release};

#[test]
fn it_opens_a_second_after_the_command() {
    let mut flight = Flight::airborne();
    assert_eq!(flight.status.gripper(), Gripper::Holding);
    flight.accepted(release());
    assert_eq!(flight.status.gripper(), Gripper::Holding, "accepted is not done");
    let took_s = flight.until("an open gripper", 3.0, |it| it.status.gripper() == Gripper::Released);
    assert!((0.9..1.1).contains(&took_s), "{took_s}");
    flight.accepted(release());
    flight.pass(5.0);
    assert_eq!(flight.status.gripper(), Gripper::Released);
    assert!((9.0..11.0).contains(&flight.height_m()), "it flies as before: {} m", flight.height_m());
}

#[test]
fn one_that_is_stuck_takes_the_command_and_holds_its_load() {
    let mut flight = Flight::airborne();
    flight.fault("gripper_stuck");
    flight.accepted(release());
    flight.pass(10.0);
    assert_eq!(flight.status.gripper(), Gripper::Holding);
    flight.fault("gripper_stuck off");
    flight.until("an open gripper", 1.0, |it| it.status.gripper() == Gripper::Released);
}
