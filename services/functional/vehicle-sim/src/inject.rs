//! What each fault does.

use std::time::Duration;

use domain::geometry::{Ned, NedVelocity};
use domain::time::Time;
use nalgebra::Vector3;

use crate::VehicleSim;
use crate::estimator::EstimatorFaults;
use crate::faults::Fault;
use crate::frame::{horizontal, ned, ned_velocity};
use crate::multirotor::Multirotor;
use crate::traffic::Course;

/// Carries out `fault`. Returns what was done, for a human.
pub(crate) fn inject(sim: &mut VehicleSim, fault: Fault, now: Time) -> String {
    let VehicleSim { vehicle, publisher, telemetry, traffic, commands_to_reject } = sim;
    let estimator = &mut vehicle.estimator.faults;
    match fault {
        Fault::RejectAcks(count) => {
            *commands_to_reject = count;
            format!("the next commands are rejected: {count}")
        }
        Fault::SwallowAcks(count) => {
            publisher.acks_to_swallow = count;
            format!("the next commands are carried out without acknowledgement: {count}")
        }
        Fault::Freeze(topic) => {
            publisher.freeze(topic, |topic| telemetry.messages(topic, vehicle, traffic, now));
            format!("`{}` is frozen", topic.key())
        }
        Fault::Drop(topic) => {
            publisher.drop(topic);
            format!("`{}` is dropped", topic.key())
        }
        Fault::Thaw(topic) => {
            publisher.thaw(topic);
            format!("`{}` is sent again", topic.key())
        }
        Fault::Battery(fraction) => {
            vehicle.battery.set_remaining(fraction);
            format!("the battery is at {:.1} %", fraction * 100.0)
        }
        Fault::BatteryTemperature(temperature_c) => {
            vehicle.battery.set_temperature_c(temperature_c);
            format!("the battery's cells are at {temperature_c:.1} degrees Celsius")
        }
        Fault::GnssLoss(on) => {
            estimator.gnss_lost = on;
            format!("satellites are {}", if on { "lost" } else { "back" })
        }
        Fault::EstimatorDrift(drift_m_s) => {
            estimator.drift_m_s = drift_m_s;
            format!("the estimate drifts at {drift_m_s} m/s")
        }
        Fault::EstimatorInvalid(on) => {
            estimator.invalid = on;
            format!("the estimate is {}", if on { "invalid" } else { "valid" })
        }
        Fault::MotorFailure(count) => {
            vehicle.motors_lost = count;
            format!("motors failed: {count}")
        }
        Fault::Wind { north_m_s, east_m_s, gust_m_s } => {
            vehicle.wind.set(north_m_s, east_m_s, gust_m_s);
            format!("the wind blows towards north {north_m_s}, east {east_m_s} m/s, gusts {gust_m_s} m/s")
        }
        Fault::LinkLoss(seconds) => {
            vehicle.link_lost_until = now + Duration::from_secs_f64(seconds);
            format!("the autopilot reports its own ground link as lost for {seconds} s; the link to the gateway stays")
        }
        Fault::BlockedLanding(on) => {
            vehicle.site_blocked = on;
            format!("the landing site is {}", if on { "blocked" } else { "free" })
        }
        Fault::GripperStuck(on) => {
            vehicle.gripper.stuck = on;
            format!("the gripper {}", if on { "is stuck" } else { "works" })
        }
        Fault::LandDetector(stuck) => {
            vehicle.detector_stuck = stuck;
            match stuck {
                Some(true) => "the land detector is stuck at the ground".into(),
                Some(false) => "the land detector is stuck in the air".into(),
                None => "the land detector works".into(),
            }
        }
        Fault::Intruder { north_m, east_m, height_m, north_m_s, east_m_s, kind } => {
            let from = Ned::new(north_m, east_m, 0.0).at_height(height_m);
            let course = Course::Straight { from, velocity: NedVelocity::new(north_m_s, east_m_s, 0.0) };
            format!("`{}` appears", traffic.appear(course, kind, now))
        }
        Fault::Circling { north_m, east_m, height_m, radius_m, speed_m_s, kind } => {
            let round = Ned::new(north_m, east_m, 0.0).at_height(height_m);
            let id = traffic.appear(Course::Circle { round, radius_m, speed_m_s }, kind, now);
            format!("`{id}` circles")
        }
        Fault::HeadOn { distance_m, speed_m_s, kind } => {
            format!("`{}` comes head-on", traffic.appear(head_on(&vehicle.body, distance_m, speed_m_s), kind, now))
        }
        Fault::PilotTakesOver(mode) => {
            vehicle.taken_over(mode, now);
            format!("somebody else flies {mode:?}")
        }
        Fault::AutopilotFailsafe(Some((mode, why))) => {
            let text = format!("the autopilot flies {mode:?} by a failsafe: {why}");
            vehicle.others.begin_failsafe(mode, why);
            vehicle.review(now);
            text
        }
        Fault::AutopilotFailsafe(None) => {
            vehicle.others.end_failsafe();
            vehicle.review(now);
            "the failsafe is over".into()
        }
        Fault::RestartAutopilot(holds) => {
            vehicle.restart(holds, now);
            "the autopilot starts again".into()
        }
        Fault::FlightTermination => {
            vehicle.disarm();
            "the flight is terminated".into()
        }
        Fault::FrameJump { north_m, east_m, down_m } => {
            vehicle.boot.move_frame(Vector3::new(north_m, east_m, down_m));
            "the local frame has moved".into()
        }
        Fault::NotReady(why) => {
            let text = why.as_ref().map_or_else(|| "it would arm".to_owned(), |why| format!("it would not arm: {why}"));
            vehicle.others.not_ready = why;
            text
        }
        Fault::HideTarget(below_m) => {
            vehicle.target_hidden_below_m = below_m;
            format!("the landing target is not seen at {below_m} m and below")
        }
        Fault::Vibration(vibration_m_s2) => {
            vehicle.vibration_m_s2 = vibration_m_s2;
            format!("the frame shakes with {vibration_m_s2} m/s2")
        }
        Fault::Drain(factor) => {
            vehicle.battery.drain = factor;
            format!("the motors take {factor} times what they should")
        }
        Fault::FaultyBattery(faulty) => {
            vehicle.battery.faulty = faulty;
            format!("the battery reports a fault: {faulty}")
        }
        Fault::PositionJump { north_m, east_m, up_m } => {
            estimator.offset += nalgebra::Vector3::new(north_m, east_m, -up_m);
            format!("the estimate jumps by north {north_m}, east {east_m}, up {up_m} m")
        }
        Fault::HeadingError(degrees) => {
            vehicle.heading_error_rad = degrees.to_radians();
            format!("the heading of the estimate is off by {degrees} degrees")
        }
        Fault::SteeringError { north_m, east_m } => {
            vehicle.steering_error = Vector3::new(north_m, east_m, 0.0);
            format!("the autopilot steers {north_m} m north, {east_m} m east of what it is sent")
        }
        Fault::SlowFlight(limit_m_s) => {
            vehicle.slow_m_s = limit_m_s;
            limit_m_s.map_or("it flies as fast as it can".into(), |it| format!("it flies no faster than {it} m/s"))
        }
        Fault::Clear => {
            vehicle.steering_error = Vector3::zeros();
            vehicle.slow_m_s = None;
            vehicle.vibration_m_s2 = 0.0;
            vehicle.battery.drain = 1.0;
            vehicle.battery.faulty = false;
            vehicle.heading_error_rad = 0.0;
            *estimator = EstimatorFaults::default();
            *commands_to_reject = 0;
            publisher.clear();
            traffic.clear();
            vehicle.repair();
            vehicle.wind.set(0.0, 0.0, 0.0);
            vehicle.link_lost_until = now;
            vehicle.site_blocked = false;
            vehicle.target_hidden_below_m = 0.0;
            vehicle.gripper.stuck = false;
            vehicle.detector_stuck = None;
            vehicle.others.end_failsafe();
            vehicle.others.not_ready = None;
            "all faults are over".into()
        }
    }
}

/// Towards where `body` is, at its height, from where it flies to; from the north of one that hovers.
fn head_on(body: &Multirotor, distance_m: f64, speed_m_s: f64) -> Course {
    let ahead = horizontal(body.velocity).try_normalize(1.0).unwrap_or(Vector3::x());
    Course::Straight { from: ned(body.position + ahead * distance_m), velocity: ned_velocity(ahead * -speed_m_s) }
}
