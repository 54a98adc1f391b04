use domain::geometry::{Ned, NedVelocity};
use kittiwake_proto::v1::{self, FailureFlag, FlightMode};

use crate::stories::support::{Flight, land, loiter};

#[test]
fn it_loiters_when_the_proof_of_life_stops_and_resumes_by_itself() {
    let mut flight = Flight::offboard();
    let target = Ned::new(0.0, 200.0, -10.0);
    flight.stream_position(target, None);
    flight.pass(5.0);
    flight.stop_streaming();
    let took_s = flight.until("loiter", 2.0, |it| it.status.actual_mode() == FlightMode::Loiter);
    assert!((0.9..1.1).contains(&took_s), "{took_s}");
    assert_eq!(flight.status.intended_mode(), FlightMode::Offboard);
    assert!(flight.status.failsafe && flight.fails(FailureFlag::OffboardSignalLost));
    flight.until("rest", 10.0, |it| it.speed_m_s() < 0.3);

    flight.stream_position(target, None);
    let took_s = flight.until("offboard", 1.0, |it| it.status.actual_mode() == FlightMode::Offboard);
    assert!(took_s < 0.05, "{took_s}");
    assert!(!flight.status.failsafe && flight.status.failures.is_empty());
    flight.until("the target", 40.0, |it| it.at().distance_m(target) < 0.5);
}

#[test]
fn a_deliberate_mode_is_not_left_when_setpoints_return() {
    for command in [land(), loiter()] {
        let mut flight = Flight::offboard();
        flight.stop_streaming();
        flight.pass(2.0);
        flight.accepted(command);
        assert!(!flight.status.failsafe && flight.status.failures.is_empty(), "{:?}", flight.status);
        let mode = flight.status.actual_mode();
        flight.stream_position(Ned::new(0.0, 50.0, -10.0), None);
        flight.pass(3.0);
        assert_eq!(flight.status.actual_mode(), mode);
    }
}

#[test]
fn half_of_the_stream_is_no_proof_of_life_and_neither_is_an_invalid_one() {
    /// `refused` is what the simulator reports about each of these messages; empty: they are valid.
    #[track_caller]
    fn check(control: v1::OffboardControl, setpoint: v1::TrajectorySetpoint, refused: &str) {
        let mut flight = Flight::offboard();
        flight.stream(control, setpoint);
        flight.until("loiter", 1.2, |it| it.status.actual_mode() == FlightMode::Loiter);
        assert!(flight.at().distance_m(Ned::new(0.0, 0.0, -10.0)) < 5.0, "{:?}", flight.at());
        assert_eq!(flight.refused.first().map_or("", String::as_str), refused);
    }
    let sound = v1::TrajectorySetpoint { position: Some(Ned::new(0.0, 9.0, -10.0).into()), ..Default::default() };
    check(v1::OffboardControl::Velocity, sound, "");
    let refused = "fmu/in/offboard_control_mode: `control` is missing";
    check(v1::OffboardControl::Unspecified, sound, refused);
    let position = Some(v1::Ned { north_m: f64::NAN, ..Default::default() });
    let nan = "north NaN, east 0.0, down 0.0";
    let refused = format!("fmu/in/trajectory_setpoint: `position` is {nan}, expected metres within 1,000 km");
    check(v1::OffboardControl::Position, v1::TrajectorySetpoint { position, ..sound }, &refused);
    let refused = "fmu/in/trajectory_setpoint: `speed_limit_m_s` is -1.0, expected more than zero";
    check(v1::OffboardControl::Position, v1::TrajectorySetpoint { speed_limit_m_s: Some(-1.0), ..sound }, refused);
    let velocity = Some(NedVelocity::new(f64::INFINITY, 0.0, 0.0).into());
    let infinite = "north inf, east 0.0, down 0.0";
    let refused = format!("fmu/in/trajectory_setpoint: `velocity` is {infinite}, expected below 1,000 m/s");
    check(v1::OffboardControl::Velocity, v1::TrajectorySetpoint { velocity, ..Default::default() }, &refused);
    let both = v1::TrajectorySetpoint { velocity: Some(v1::NedVelocity::default()), ..sound };
    let still = "NedVelocity { north_m_s: 0.0, east_m_s: 0.0, down_m_s: 0.0 }";
    let refused = format!("fmu/in/trajectory_setpoint: `velocity` is {still}, expected none beside a position");
    check(v1::OffboardControl::Position, both, &refused);
}

/// 1 s is a limit of the machine: at 20x it is 20 s of mission time, which are 1 s of wall time.
#[test]
fn the_limit_keeps_its_wall_clock_floor() {
    let mut flight = Flight::at_speed(20.0, 1);
    flight.accepted(crate::stories::support::arm());
    flight.accepted(crate::stories::support::takeoff(10.0));
    flight.pass(20.0);
    flight.stream_position(Ned::new(0.0, 0.0, -10.0), None);
    flight.pass(1.0);
    flight.accepted(crate::stories::support::offboard());
    flight.pass(20.0);
    flight.stop_streaming();
    let took_s = flight.until("loiter", 30.0, |it| it.status.actual_mode() == FlightMode::Loiter);
    assert!((19.0..20.2).contains(&took_s), "{took_s}");
}
