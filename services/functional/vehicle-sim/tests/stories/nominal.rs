use domain::geodesy::LatLon;
use domain::geometry::{Ned, NedVelocity};
use kittiwake_proto::v1::FlightMode;

use crate::stories::support::{Flight, arm, land, loiter, offboard, takeoff};

#[track_caller]
fn check(flight: &Flight, expected: &str) {
    let lines = |it: &str| it.lines().map(str::trim).map(String::from).collect::<Vec<_>>();
    assert_eq!(lines(&flight.story), lines(expected.trim()), "the flight was\n{}", flight.story);
}

#[test]
fn the_status_says_where_the_local_frame_has_its_origin() {
    let flight = Flight::new();
    let origin = flight.status.origin.expect("it knows where it is");
    assert_eq!((origin.latitude_deg, origin.longitude_deg, origin.altitude_amsl_m), (54.0, 6.6, Some(20.0)));
    // The vehicle stands there, but for the errors of its estimate.
    let at = |latitude_deg, longitude_deg| LatLon::new(latitude_deg, longitude_deg).unwrap();
    let stands = at(flight.global.latitude_deg, flight.global.longitude_deg);
    assert!(at(54.0, 6.6).distance_m(stands) < 5.0, "{stands}");
}

/// The times of PX4 for the same flight (measured in March 2026): 2.0 s from arming to leaving the
/// ground, 11.9 s to loiter at 10 m, 7.2 s for the 50 m, 18.5 s for the landing, 2.0 s to disarm.
#[test]
fn a_flight_from_arming_to_disarming() {
    let mut flight = Flight::new();
    flight.pass(1.0);
    flight.accepted(arm());
    flight.accepted(takeoff(10.0));
    flight.pass(15.0);
    flight.stream_position(Ned::new(0.0, 50.0, -10.0), None);
    flight.pass(0.1);
    flight.accepted(offboard());
    flight.until("the target", 15.0, |it| it.at().distance_m(Ned::new(0.0, 50.0, -10.0)) < 0.5);
    flight.note("at (0, 50, -10)");
    flight.pass(5.0);
    flight.accepted(land());
    flight.stop_streaming();
    flight.pass(30.0);
    check(
        &flight,
        "
        0.0  disarmed LOITER
        0.0  landed
        1.0  armed LOITER
        1.0  armed TAKEOFF
        3.3  in the air
       11.3  armed LOITER
       16.1  armed OFFBOARD
       23.1  at (0, 50, -10)
       28.1  armed LAND
       41.0  ground contact
       41.7  landed
       43.7  disarmed LOITER
        ",
    );
    assert!(flight.height_m().abs() < 0.6, "it believes to be at {} m", flight.height_m());
    assert!(flight.battery.remaining > 0.95, "{:?}", flight.battery);
}

#[test]
fn a_flight_of_a_kilometre_leaves_most_of_the_charge() {
    let mut flight = Flight::offboard();
    for east_m in [500.0, 0.0] {
        let target = Ned::new(0.0, east_m, -10.0);
        flight.stream_position(target, None);
        let took_s = flight.until("the target", 60.0, |it| it.at().distance_m(target) < 1.0);
        assert!((42.0..50.0).contains(&took_s), "{took_s}");
    }
    assert!((0.85..0.95).contains(&flight.battery.remaining), "{:?}", flight.battery);
    assert!(
        flight.battery.temperature_c.is_some_and(|it| it > 15.5) && flight.battery.voltage_v < 24.2,
        "{:?}",
        flight.battery
    );
}

#[test]
fn loiter_brakes_and_stays() {
    let mut flight = Flight::offboard();
    flight.stream_velocity(NedVelocity::new(0.0, 12.0, 0.0), None);
    flight.until("full speed", 20.0, |it| it.speed_m_s() > 11.5);
    let from = flight.at();
    flight.accepted(loiter());
    let took_s = flight.until("rest", 10.0, |it| it.speed_m_s() < 0.3);
    assert!((2.0..6.0).contains(&took_s), "{took_s}");
    let stopped = flight.at();
    assert!((10.0..30.0).contains(&from.distance_m(stopped)), "{from:?} {stopped:?}");
    flight.pass(20.0);
    assert!(flight.at().distance_m(stopped) < 1.0 && flight.speed_m_s() < 0.3);
    assert_eq!(flight.status.actual_mode(), FlightMode::Loiter, "its setpoints no longer count");
}

#[test]
fn setpoints_lift_it_off_as_well() {
    let mut flight = Flight::new();
    let target = Ned::new(0.0, 0.0, -5.0);
    flight.stream_position(target, None);
    flight.pass(0.2);
    flight.accepted(offboard());
    flight.accepted(arm());
    flight.until("5 m", 15.0, |it| it.at().distance_m(target) < 0.3);
}

#[test]
fn a_takeoff_given_up_on_the_ground_stays_there_and_one_in_the_air_loiters() {
    let mut flight = Flight::new();
    flight.accepted(arm());
    flight.accepted(takeoff(10.0));
    flight.pass(1.5);
    flight.accepted(loiter());
    flight.pass(5.0);
    assert!(flight.landed.landed);
    flight.accepted(takeoff(10.0));
    flight.until("2 m", 10.0, |it| it.height_m() > 2.0);
    flight.accepted(loiter());
    flight.pass(10.0);
    assert!(!flight.landed.landed && (1.5..5.0).contains(&flight.height_m()), "{}", flight.height_m());
}

#[test]
fn armed_and_left_alone_it_disarms() {
    let mut flight = Flight::new();
    flight.accepted(arm());
    let took_s = flight.until("disarmed", 15.0, |it| !it.status.armed);
    assert!((took_s - 10.0).abs() < 0.1, "{took_s}");
}

#[test]
fn it_flies_again_after_a_landing() {
    let mut flight = Flight::airborne();
    for _ in 0..2 {
        flight.accepted(land());
        flight.until("landed and disarmed", 40.0, |it| !it.status.armed && it.landed.landed);
        flight.accepted(arm());
        flight.accepted(takeoff(10.0));
        flight.until("10 m", 20.0, |it| it.height_m() > 9.0);
    }
}

#[test]
fn the_same_flight_succeeds_many_times_faster() {
    for speed in [0.5, 5.0, 20.0, 50.0, 100.0] {
        let mut flight = Flight::at_speed(speed, 3);
        flight.accepted(arm());
        flight.accepted(takeoff(10.0));
        let climb_s =
            flight.until("10 m", 25.0, |it| it.status.actual_mode() == FlightMode::Loiter && !it.landed.landed);
        assert!((9.0..14.0).contains(&climb_s), "{climb_s} at {speed}x");
        let target = Ned::new(0.0, 500.0, -10.0);
        flight.stream_position(target, None);
        flight.pass(2.0 * speed.max(1.0));
        flight.accepted(offboard());
        flight.until("the target", 70.0, |it| it.at().distance_m(target) < 1.0);
        flight.accepted(land());
        flight.until("disarmed", 40.0, |it| !it.status.armed);
        assert!(!flight.story.contains("failsafe"), "at {speed}x:\n{}", flight.story);
    }
}
