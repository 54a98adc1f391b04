use domain::geometry::Ned;
use kittiwake_proto::topics::Topic;
use kittiwake_proto::v1::{CommandResult, FailureFlag, FaultRequest, FlightMode};
use vehicle_sim::faults::catalogue::catalogue;

use crate::stories::support::{Flight, arm, land, loiter, offboard, takeoff};

#[test]
fn a_rejected_command_is_not_carried_out() {
    let mut flight = Flight::new();
    flight.fault("reject_acks 2");
    flight.rejected(arm(), "an injected fault rejects it");
    flight.rejected(arm(), "an injected fault rejects it");
    flight.accepted(arm());
}

#[test]
fn a_swallowed_acknowledgement_belongs_to_a_command_that_is_carried_out() {
    let mut flight = Flight::new();
    flight.fault("swallow_acks 1");
    assert_eq!(flight.command(arm()), None);
    assert!(flight.status.armed);
    assert_eq!(flight.command(takeoff(10.0)).unwrap().result(), CommandResult::Accepted);
}

#[test]
fn a_frozen_topic_repeats_itself_at_its_rate() {
    let mut flight = Flight::offboard();
    flight.fault("freeze vehicle_local_position");
    flight.pass(0.1);
    let (frozen, count) = (flight.position, flight.counts[&Topic::VehicleLocalPosition]);
    flight.stream_position(Ned::new(0.0, 50.0, -10.0), None);
    let latitude = flight.global;
    flight.until("10 s", 11.0, |it| {
        assert_eq!(it.position, frozen);
        it.counts[&Topic::VehicleLocalPosition] >= count + 1230
    });
    assert_ne!(flight.global, latitude, "the others go on");
    flight.fault("thaw vehicle_local_position");
    flight.pass(0.1);
    assert!(flight.at().east_m > 40.0, "and it flew meanwhile: {:?}", flight.at());
}

#[test]
fn a_frozen_status_hides_a_change() {
    let mut flight = Flight::new();
    flight.fault("freeze vehicle_status");
    flight.accepted(arm());
    flight.pass(2.0);
    assert!(!flight.status.armed);
    flight.fault("thaw vehicle_status");
    flight.pass(0.01);
    assert!(flight.status.armed);
}

#[test]
fn a_frozen_acknowledgement_repeats_the_last_one() {
    let mut flight = Flight::new();
    flight.accepted(arm());
    let last = flight.last_id();
    flight.fault("freeze vehicle_command_ack");
    let ack = flight.send(kittiwake_proto::v1::VehicleCommand { id: 99, command: Some(loiter()) }).unwrap();
    assert_eq!(ack.id, last);
}

#[test]
fn a_dropped_topic_is_silent() {
    #[track_caller]
    fn check(name: &str, topic: Topic) {
        let mut flight = Flight::new();
        flight.pass(1.0);
        flight.fault(&format!("drop {name}"));
        let before = flight.counts[&topic];
        flight.pass(3.0);
        assert_eq!(flight.counts[&topic], before);
        flight.fault("clear");
        flight.pass(1.1);
        assert!(flight.counts[&topic] > before);
    }
    check("vehicle_status", Topic::VehicleStatus);
    check("vehicle_attitude", Topic::VehicleAttitude);
    check("vehicle_local_position", Topic::VehicleLocalPosition);
    check("vehicle_global_position", Topic::VehicleGlobalPosition);
    check("vehicle_land_detected", Topic::VehicleLandDetected);
    check("battery_status", Topic::BatteryStatus);

    let mut flight = Flight::new();
    flight.fault("drop vehicle_command_ack");
    assert_eq!(flight.command(arm()), None);
}

#[test]
fn a_low_battery_is_a_flag_and_a_nearly_empty_one_a_landing() {
    let mut flight = Flight::offboard();
    flight.fault("battery 0.06");
    flight.pass(0.5);
    assert!(flight.fails(FailureFlag::Battery) && flight.status.actual_mode() == FlightMode::Offboard);
    assert!((flight.battery.remaining - 0.06).abs() < 0.001);
    flight.fault("battery 0.045");
    flight.pass(0.1);
    assert_eq!((flight.status.actual_mode(), flight.status.failsafe), (FlightMode::Land, true));
    flight.rejected(loiter(), "the battery is nearly empty");
    flight.accepted(land());
    flight.until("landed and disarmed", 40.0, |it| it.landed.landed && !it.status.armed);
    assert!(!flight.fails(FailureFlag::Motor), "a soft landing");
}

#[test]
fn without_charge_it_falls() {
    let mut flight = Flight::airborne();
    flight.fault("battery 0");
    flight.until("the ground", 5.0, |it| it.landed.landed && !it.status.armed);
    flight.rejected(arm(), "the vehicle has crashed");
}

#[test]
fn without_satellites_it_descends_blindly_after_five_seconds() {
    let mut flight = Flight::offboard();
    flight.fault("wind 0 4");
    flight.pass(10.0);
    assert!((3.0..4.5).contains(&flight.wind.east_m_s), "{:?}", flight.wind);
    flight.fault("gnss_loss");
    flight.pass(0.1);
    assert!(flight.fails(FailureFlag::GnssLost) && flight.status.actual_mode() == FlightMode::Offboard);
    let took_s = flight.until("the descent", 6.0, |it| it.status.actual_mode() == FlightMode::Land);
    assert!((4.5..5.5).contains(&took_s), "{took_s}");
    flight.pass(0.1);
    assert!(flight.status.failsafe && flight.fails(FailureFlag::Estimator) && !flight.position.horizontal_valid);
    let from = flight.at();
    flight.until("the ground", 40.0, |it| it.landed.landed);
    assert!(flight.at().horizontal_distance_m(from) > 5.0, "the wind carries it along");
}

#[test]
fn when_satellites_return_the_intended_mode_flies_again() {
    let mut flight = Flight::offboard();
    flight.fault("gnss_loss on");
    flight.until("the descent", 6.0, |it| it.status.failsafe);
    flight.fault("gnss_loss off");
    flight.until("offboard", 3.0, |it| it.status.actual_mode() == FlightMode::Offboard);
    assert!(flight.position.horizontal_valid && !flight.fails(FailureFlag::GnssLost));
}

#[test]
fn a_drifting_estimate_leads_it_away_until_the_autopilot_notices() {
    let mut flight = Flight::offboard();
    flight.fault("estimator_drift 0.5");
    flight.pass(5.0);
    assert!((2.0..4.0).contains(&flight.position.eph_m), "{}", flight.position.eph_m);
    assert!(flight.at().distance_m(Ned::new(0.0, 0.0, -10.0)) < 1.0, "it believes to be where it was");
    flight.until("the descent", 6.0, |it| it.status.actual_mode() == FlightMode::Land);
    flight.fault("estimator_drift 0");
    flight.until("offboard", 5.0, |it| it.status.actual_mode() == FlightMode::Offboard);
}

#[test]
fn an_invalid_estimate_ends_the_flight_in_offboard() {
    let mut flight = Flight::offboard();
    flight.fault("estimator_invalid");
    flight.pass(0.1);
    assert!(!flight.position.horizontal_valid && !flight.position.vertical_valid);
    assert!(flight.fails(FailureFlag::Estimator) && flight.status.actual_mode() == FlightMode::Land);
    flight.rejected(offboard(), "the position is not known");
    flight.fault("estimator_invalid off");
    flight.pass(0.1);
    assert_eq!(flight.status.actual_mode(), FlightMode::Offboard);
}

#[test]
fn with_one_motor_lost_it_lands_spinning() {
    let mut flight = Flight::offboard();
    flight.fault("motor_failure");
    flight.pass(2.0);
    assert!(flight.fails(FailureFlag::Motor) && flight.status.actual_mode() == FlightMode::Land);
    assert!(flight.attitude.yaw_rate_rad_s > 3.0, "{:?}", flight.attitude);
    flight.until("landed and disarmed", 40.0, |it| it.landed.landed && !it.status.armed);
    flight.rejected(arm(), "a motor has failed");
}

#[test]
fn with_two_motors_lost_it_falls() {
    let mut flight = Flight::offboard();
    flight.fault("motor_failure 2");
    let took_s = flight.until("the ground", 5.0, |it| it.landed.landed && !it.status.armed);
    assert!((1.2..2.5).contains(&took_s), "{took_s}");
    flight.rejected(arm(), "the vehicle has crashed");
}

#[test]
fn a_gale_carries_it_away() {
    let mut flight = Flight::offboard();
    flight.fault("wind 0 8 1");
    flight.pass(20.0);
    assert!(flight.at().distance_m(Ned::new(0.0, 0.0, -10.0)) < 3.0, "it holds against 8 m/s: {:?}", flight.at());
    assert!(flight.attitude.q_x < -0.03, "leaning into it: {:?}", flight.attitude);
    flight.fault("wind 0 40");
    flight.pass(20.0);
    assert!(flight.at().east_m > 50.0, "but not against 40: {:?}", flight.at());
}

#[test]
fn a_lost_link_returns_after_its_time() {
    let mut flight = Flight::new();
    flight.fault("link_loss 5");
    flight.pass(0.1);
    assert!(flight.fails(FailureFlag::GroundLinkLost));
    let took_s = flight.until("the link", 6.0, |it| !it.fails(FailureFlag::GroundLinkLost));
    assert!((4.8..5.0).contains(&took_s), "{took_s}");
}

#[test]
fn a_blocked_site_keeps_a_landing_above_it() {
    let mut flight = Flight::airborne();
    flight.fault("blocked_landing");
    flight.accepted(land());
    flight.pass(60.0);
    assert!(flight.status.armed && !flight.landed.ground_contact);
    assert!((1.5..2.5).contains(&flight.height_m()), "{}", flight.height_m());
    flight.fault("blocked_landing off");
    flight.until("landed", 15.0, |it| it.landed.landed);
}

#[test]
fn an_intruder_reports_once_a_second() {
    let mut flight = Flight::new();
    flight.fault("intruder 100 -50 30 -10 0");
    flight.fault("intruder 0 0 100 0 20");
    flight.pass(10.0);
    assert!((18..=22).contains(&flight.traffic.len()), "{}", flight.traffic.len());
    let last = flight.traffic.iter().rfind(|it| it.id == "intruder-1").unwrap();
    let position = Ned::try_from(last.position.unwrap()).unwrap();
    assert!((-5.0..15.0).contains(&position.north_m), "{position:?}");
    assert_eq!((position.east_m, position.height_m()), (-50.0, 30.0));
    assert_eq!(last.velocity.unwrap().north_m_s, -10.0);
    flight.fault("clear");
    flight.traffic.clear();
    flight.pass(3.0);
    assert!(flight.traffic.is_empty());
}

#[test]
fn clear_ends_all_faults() {
    let mut flight = Flight::offboard();
    for fault in [
        "reject_acks 3",
        "swallow_acks 3",
        "drop battery_status",
        "freeze vehicle_status",
        "gnss_loss",
        "estimator_drift 0.1",
        "motor_failure",
        "wind 5 5 1",
        "link_loss 100",
        "blocked_landing",
    ] {
        flight.fault(fault);
    }
    flight.pass(1.0);
    flight.fault("clear");
    flight.pass(5.0);
    assert!(flight.status.failures.is_empty() && flight.status.actual_mode() == FlightMode::Offboard);
    assert!(flight.at().distance_m(Ned::new(0.0, 0.0, -10.0)) < 2.0, "{:?}", flight.at());
    flight.accepted(land());
    flight.until("landed", 40.0, |it| it.landed.landed);
}

#[test]
fn an_unknown_fault_is_refused_with_help() {
    let mut flight = Flight::new();
    let reply = flight.request(FaultRequest { name: "wnd".into(), args: vec![] });
    assert!(!reply.accepted);
    assert_eq!(reply.detail, "there is no fault `wnd`; did you mean `wind`?");
    assert_eq!(flight.refused, ["sim/fault: there is no fault `wnd`; did you mean `wind`?"]);
}

#[test]
fn a_request_without_a_name_is_answered_with_all_faults() {
    let mut flight = Flight::new();
    let reply = flight.request(FaultRequest::default());
    assert!(!reply.accepted);
    assert_eq!(flight.refused, [""; 0]);
    let names: Vec<&str> = reply.known.iter().map(|it| it.name.as_str()).collect();
    assert_eq!(names, catalogue().iter().map(|it| it.name).collect::<Vec<_>>());
    let wind = reply.known.iter().find(|it| it.name == "wind").unwrap();
    assert_eq!(wind.arguments, "NORTH EAST [GUST]");
    let other = flight.request(FaultRequest { name: "batery".into(), args: Vec::new() });
    assert!(other.known.is_empty(), "a mistyped name is answered with a similar one, not with all");
}
