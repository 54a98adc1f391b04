//! Values that follow from the samples.

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

/// Over ground, from the origin.
pub(crate) fn distance_home_m(position: Ned) -> f64 {
    position.horizontal_distance_m(Ned::default())
}
