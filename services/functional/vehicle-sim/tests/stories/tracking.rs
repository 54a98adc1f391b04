use domain::geometry::{Ned, NedVelocity};
use kittiwake_proto::v1;

use crate::stories::support::Flight;

/// A small generator of random numbers, with the same sequence everywhere.
struct Draw(u64);

impl Draw {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

#[test]
fn it_comes_to_rest_at_any_target_in_any_moderate_wind() {
    let mut draw = Draw(1);
    for _ in 0..25 {
        let target = Ned::new(draw.between(-200.0, 200.0), draw.between(-200.0, 200.0), draw.between(-60.0, -5.0));
        let (north, east) = (draw.between(-6.0, 6.0), draw.between(-6.0, 6.0));
        let mut flight = Flight::offboard();
        flight.fault(&format!("wind {north} {east} 0.5"));
        flight.stream_position(target, None);
        flight.until(&format!("{target:?} in wind {north} {east}"), 90.0, |it| it.at().distance_m(target) < 0.5);
        let mut furthest = 0.0_f64;
        let end = flight.seconds() + 20.0;
        flight.until("20 s more", 21.0, |it| {
            furthest = furthest.max(it.at().distance_m(target));
            it.seconds() >= end
        });
        assert!(furthest < 2.5, "{furthest} m from {target:?} in wind {north} {east}");
        assert!(flight.speed_m_s() < 1.0, "{} m/s", flight.speed_m_s());
    }
}

#[test]
fn it_overshoots_a_little() {
    let mut flight = Flight::offboard();
    let target = Ned::new(0.0, 500.0, -10.0);
    flight.stream_position(target, None);
    let mut furthest = 0.0_f64;
    flight.until("a minute", 61.0, |it| {
        furthest = furthest.max(it.at().east_m);
        it.seconds() > 70.0
    });
    assert!((500.1..502.0).contains(&furthest), "{furthest}");
}

#[test]
fn it_flies_straight_and_within_its_speed_limit() {
    #[track_caller]
    fn check(target: Ned, speed_limit_m_s: Option<f64>, fastest_m_s: f64, beside_m: f64) {
        let mut flight = Flight::offboard();
        flight.stream_position(target, speed_limit_m_s);
        let (start, mut top_m_s, mut aside_m) = (flight.at(), 0.0_f64, 0.0_f64);
        flight.until("the target", 120.0, |it| {
            let at = it.at();
            let share = start.distance_m(at) / start.distance_m(target);
            aside_m = aside_m.max(at.distance_m(start.towards(target, share.min(1.0))));
            top_m_s = top_m_s.max(it.speed_m_s());
            at.distance_m(target) < 0.5
        });
        assert!(aside_m < beside_m, "{aside_m} m beside the line");
        // The published velocity has noise of some centimetres per second.
        assert!((fastest_m_s * 0.85..fastest_m_s * 1.05 + 0.1).contains(&top_m_s), "{top_m_s} m/s");
    }
    check(Ned::new(0.0, 200.0, -10.0), None, 12.0, 0.3);
    check(Ned::new(0.0, 200.0, -10.0), Some(100.0), 12.0, 0.3);
    check(Ned::new(100.0, 100.0, -10.0), Some(5.0), 5.0, 0.3);
    check(Ned::new(20.0, 0.0, -10.0), Some(1.0), 1.0, 0.3);
    check(Ned::new(0.0, 0.0, -60.0), None, 3.0, 0.3);
    // It gains height before speed, as a real one does, and so starts above the line.
    check(Ned::new(0.0, 100.0, -40.0), Some(8.0), 8.0, 1.5);
}

#[test]
fn it_flies_at_a_velocity_and_turns() {
    let mut flight = Flight::offboard();
    flight.stream_velocity(NedVelocity::new(3.0, -2.0, -0.5), Some(0.2));
    flight.pass(10.0);
    let velocity = NedVelocity::try_from(flight.position.velocity.unwrap()).unwrap();
    assert!((velocity.north_m_s - 3.0).abs() < 0.4 && (velocity.east_m_s + 2.0).abs() < 0.4, "{velocity:?}");
    assert!((velocity.climb_rate_m_s() - 0.5).abs() < 0.2, "{velocity:?}");
    assert!((flight.position.heading_rad - 2.0).abs() < 0.2, "{}", flight.position.heading_rad);
}

#[test]
fn it_turns_to_the_demanded_heading_and_leans_into_its_flight() {
    let mut flight = Flight::offboard();
    let target = Some(Ned::new(0.0, 0.0, -10.0).into());
    let setpoint = v1::TrajectorySetpoint { position: target, yaw_rad: Some(-2.0), ..Default::default() };
    flight.stream(v1::OffboardControl::Position, setpoint);
    flight.pass(8.0);
    assert!((flight.position.heading_rad + 2.0).abs() < 0.05, "{}", flight.position.heading_rad);
    // Half of a turn by -2 rad about the downward axis.
    assert!((flight.attitude.q_z.abs() - 1.0_f64.sin()).abs() < 0.05, "{:?}", flight.attitude);

    let mut flight = Flight::offboard();
    flight.stream_velocity(NedVelocity::new(12.0, 0.0, 0.0), None);
    flight.pass(1.0);
    assert!(flight.attitude.q_y < -0.1, "nose down to go north: {:?}", flight.attitude);
}

#[test]
fn the_global_position_moves_along() {
    let mut flight = Flight::offboard();
    assert!((flight.global.latitude_deg - 54.0).abs() < 1e-5 && (flight.global.longitude_deg - 6.6).abs() < 1e-5);
    let target = Ned::new(100.0, 100.0, -10.0);
    flight.stream_position(target, None);
    flight.until("the target", 60.0, |it| it.at().distance_m(target) < 0.5);
    // A degree of latitude is 111.3 km there, one of longitude 65.6 km.
    assert!((flight.global.latitude_deg - 54.0 - 100.0 / 111_305.0).abs() < 1e-5, "{:?}", flight.global);
    assert!((flight.global.longitude_deg - 6.6 - 100.0 / 65_576.0).abs() < 2e-5, "{:?}", flight.global);
    assert!((flight.global.altitude_amsl_m - 30.0).abs() < 1.0, "{:?}", flight.global);
}
