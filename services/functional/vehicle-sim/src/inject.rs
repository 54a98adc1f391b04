//! What each fault does.

use std::time::Duration;

use domain::geometry::{Ned, NedVelocity};
use domain::time::Time;

use crate::VehicleSim;
use crate::estimator::EstimatorFaults;
use crate::faults::Fault;

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
            format!("the ground link is lost for {seconds} s")
        }
        Fault::BlockedLanding(on) => {
            vehicle.site_blocked = on;
            format!("the landing site is {}", if on { "blocked" } else { "free" })
        }
        Fault::LandDetector(stuck) => {
            vehicle.detector_stuck = stuck;
            match stuck {
                Some(true) => "the land detector is stuck at the ground".into(),
                Some(false) => "the land detector is stuck in the air".into(),
                None => "the land detector works".into(),
            }
        }
        Fault::Intruder { north_m, east_m, height_m, north_m_s, east_m_s } => {
            let from = Ned::new(north_m, east_m, 0.0).at_height(height_m);
            let id = traffic.appear(from, NedVelocity::new(north_m_s, east_m_s, 0.0), now);
            format!("`{id}` appears")
        }
        Fault::Clear => {
            *estimator = EstimatorFaults::default();
            *commands_to_reject = 0;
            publisher.clear();
            traffic.clear();
            vehicle.repair();
            vehicle.wind.set(0.0, 0.0, 0.0);
            vehicle.link_lost_until = now;
            vehicle.site_blocked = false;
            vehicle.detector_stuck = None;
            "all faults are over".into()
        }
    }
}
