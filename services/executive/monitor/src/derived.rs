//! What follows from the samples: the values that thresholds are set on, and the conditions that
//! the vehicle reports.

use domain::contingency::rule::{Condition, DataSource, Quantity};
use domain::geometry::{Ned, NedVelocity};
use kittiwake_proto::v1;

use crate::sources::Sources;

/// The derived values for the introspection; `None` until every source they follow from was heard,
/// since a zero would pass for a measurement.
pub fn derived(sources: &Sources) -> Option<v1::Derived> {
    let (position, velocity) = motion(sources)?;
    sources.heard(DataSource::LandDetected)?;
    Some(v1::Derived {
        height_m: position.height_m(),
        ground_speed_m_s: velocity.ground_speed_m_s(),
        climb_rate_m_s: velocity.climb_rate_m_s(),
        distance_home_m: distance_home_m(position),
        tilt_rad: tilt_rad(sources.attitude.latest()?),
        flying: sources.flying(),
    })
}

/// The last value of `quantity`; `None` where it was never measured or the estimator does not
/// vouch for it.
pub fn value(quantity: Quantity, sources: &Sources) -> Option<f64> {
    let battery = sources.battery.latest();
    let local = sources.local_position.latest();
    let horizontal = || motion(sources).filter(|_| local.is_some_and(|it| it.horizontal_valid));
    let vertical = || motion(sources).filter(|_| local.is_some_and(|it| it.vertical_valid));
    match quantity {
        Quantity::BatteryRemaining => battery.map(|it| it.remaining),
        Quantity::BatteryVoltage => battery.map(|it| it.voltage_v),
        Quantity::BatteryTemperature => battery.map(|it| it.temperature_c),
        Quantity::HorizontalAccuracy => local.map(|it| it.eph_m),
        Quantity::VerticalAccuracy => local.map(|it| it.epv_m),
        Quantity::Height => vertical().map(|(position, _)| position.height_m()),
        Quantity::DistanceHome => horizontal().map(|(position, _)| distance_home_m(position)),
        Quantity::GroundSpeed => horizontal().map(|(_, velocity)| velocity.ground_speed_m_s()),
        Quantity::Tilt => sources.attitude.latest().map(tilt_rad),
    }
}

/// Whether the vehicle reports `condition`; `None` where no source that could has been heard.
pub fn reported(condition: Condition, sources: &Sources) -> Option<bool> {
    let failure = match condition {
        Condition::EstimatorInvalid => v1::FailureFlag::Estimator,
        Condition::OffboardSignalLost => v1::FailureFlag::OffboardSignalLost,
        Condition::GnssLost => v1::FailureFlag::GnssLost,
        Condition::MotorFailure => v1::FailureFlag::Motor,
        Condition::BatteryFailure => v1::FailureFlag::Battery,
        Condition::GroundLinkLost => v1::FailureFlag::GroundLinkLost,
    };
    let flagged = sources.status.latest().map(|it| it.failures().any(|it| it == failure));
    let unvouched = sources.local_position.latest().map(|it| !(it.horizontal_valid && it.vertical_valid));
    match (condition, flagged, unvouched) {
        (Condition::EstimatorInvalid, Some(flagged), Some(unvouched)) => Some(flagged || unvouched),
        (Condition::EstimatorInvalid, None, unvouched) => unvouched,
        (_, flagged, _) => flagged,
    }
}

fn motion(sources: &Sources) -> Option<(Ned, NedVelocity)> {
    let sample = sources.local_position.latest()?;
    Some((sample.position?.try_into().ok()?, sample.velocity?.try_into().ok()?))
}

fn distance_home_m(position: Ned) -> f64 {
    position.horizontal_distance_m(Ned::default())
}

/// Between the body's down axis and the local one.
fn tilt_rad(it: &v1::VehicleAttitude) -> f64 {
    let (upright, sideways) = (it.q_w * it.q_w + it.q_z * it.q_z, it.q_x * it.q_x + it.q_y * it.q_y);
    2.0 * sideways.sqrt().atan2(upright.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tilt_is_the_angle_from_upright_whatever_the_heading() {
        #[track_caller]
        fn check(q: [f64; 4], expected_deg: f64) {
            let [q_w, q_x, q_y, q_z] = q;
            let tilt = tilt_rad(&v1::VehicleAttitude { q_w, q_x, q_y, q_z, ..Default::default() });
            assert!((tilt.to_degrees() - expected_deg).abs() < 1e-9, "{}", tilt.to_degrees());
        }
        let half = std::f64::consts::FRAC_1_SQRT_2;
        check([1.0, 0.0, 0.0, 0.0], 0.0);
        check([half, 0.0, 0.0, half], 0.0);
        check([half, half, 0.0, 0.0], 90.0);
        check([0.0, 0.0, 1.0, 0.0], 180.0);
        check([0.5, 0.5, 0.5, 0.5], 90.0);
        check([0.99_f64.sqrt(), 0.0, 0.1, 0.0], 2.0 * 0.1_f64.asin().to_degrees());
    }
}
