//! Values that follow from the samples: those that rules compare with thresholds, and the
//! conditions that the vehicle reports.

use domain::contingency::rule::{Condition, Quantity};
use domain::fmu::{Failure, Status};
use domain::geometry::Ned;
use domain::time::Time;

use crate::sources::Sources;

/// What the introspection says beyond the samples themselves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Derived {
    pub(crate) height_m: f64,
    pub(crate) ground_speed_m_s: f64,
    pub(crate) climb_rate_m_s: f64,
    pub(crate) distance_home_m: f64,
    pub(crate) tilt_rad: f64,
    pub(crate) flying: bool,
    pub(crate) flight_s: f64,
}

/// The derived values; `None` until every source that they follow from was heard, since a zero
/// would pass for a measurement.
pub(crate) fn derived(now: Time, sources: &Sources) -> Option<Derived> {
    let local = sources.local_position.latest()?;
    let attitude = sources.attitude.latest()?;
    Some(Derived {
        height_m: local.position.height_m(),
        ground_speed_m_s: local.velocity.ground_speed_m_s(),
        climb_rate_m_s: local.velocity.climb_rate_m_s(),
        distance_home_m: distance_home_m(local.position),
        tilt_rad: attitude.tilt_rad(),
        flying: sources.flying()?,
        flight_s: sources.flight_time(now)?.as_secs_f64(),
    })
}

/// The last value of `quantity`; `None` where it was never measured or the estimator does not
/// vouch for it.
pub(crate) fn value(quantity: Quantity, sources: &Sources) -> Option<f64> {
    let battery = sources.battery.latest();
    let local = sources.local_position.latest();
    let horizontal = local.filter(|it| it.horizontal_valid);
    let vertical = local.filter(|it| it.vertical_valid);
    match quantity {
        Quantity::BatteryRemaining => battery.map(|it| it.remaining),
        Quantity::BatteryVoltage => battery.map(|it| it.voltage_v),
        Quantity::BatteryTemperature => battery.and_then(|it| it.temperature_c),
        Quantity::HorizontalAccuracy => local.map(|it| it.eph_m),
        Quantity::VerticalAccuracy => local.map(|it| it.epv_m),
        Quantity::Height => vertical.map(|it| it.position.height_m()),
        Quantity::DistanceHome => horizontal.map(|it| distance_home_m(it.position)),
        Quantity::GroundSpeed => horizontal.map(|it| it.velocity.ground_speed_m_s()),
        Quantity::TouchdownSpeed => sources.touchdown_m_s(),
        Quantity::Tilt => sources.attitude.latest().map(|it| it.tilt_rad()),
    }
}

/// Whether the vehicle reports `condition`; `None` where no source that could report it was heard.
pub(crate) fn reported(condition: Condition, sources: &Sources) -> Option<bool> {
    let failure = match condition {
        Condition::EstimatorInvalid => Failure::Estimator,
        Condition::OffboardSignalLost => Failure::OffboardSignalLost,
        Condition::GnssLost => Failure::GnssLost,
        Condition::MotorFailure => Failure::Motor,
        Condition::BatteryFailure => Failure::Battery,
        Condition::GroundLinkLost => Failure::GroundLinkLost,
        Condition::LandDetectorContradicts => return sources.contradicts_detector(),
        Condition::WouldNotArm => {
            // One that is armed has no more to say about it.
            let refuses = |it: &Status| if it.armed { Some(false) } else { it.can_arm.map(|can_arm| !can_arm) };
            return sources.status.latest().and_then(refuses);
        }
        Condition::AutopilotPreempts => return sources.pre_empts(),
    };
    let flagged = sources.status.latest().map(|it| it.failures.contains(&failure));
    let doubtful = sources.local_position.latest().map(|it| !(it.horizontal_valid && it.vertical_valid));
    match (condition, flagged, doubtful) {
        (Condition::EstimatorInvalid, Some(flagged), Some(doubtful)) => Some(flagged || doubtful),
        (Condition::EstimatorInvalid, None, doubtful) => doubtful,
        (_, flagged, _) => flagged,
    }
}

fn distance_home_m(position: Ned) -> f64 {
    position.horizontal_distance_m(Ned::default())
}
