//! The monitor's parameters.

use std::num::NonZeroU32;

use domain::quantity::Positive;
use serde::Deserialize;

/// The section `[monitor]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Introspections a second of wall time. From the reference design: 100.
    pub introspection_rate_hz: Positive,
    /// Seconds, never less than 250 ms of wall time: a source that has never been heard counts as
    /// stale so long after the first of the others has been heard. Ours: longer than any process
    /// takes to start.
    pub absent_after_s: Positive,
    /// Repetitions in a row of the very same attitude, while armed, after which it counts as
    /// frozen. Ours: half a second at 240 Hz; none repeats in the
    /// recorded flight of a real PX4.
    pub attitude_frozen_samples: NonZeroU32,
    /// The same for the local and for the global position. Ours: half a second at 123 Hz; none
    /// repeats there either.
    pub position_frozen_samples: NonZeroU32,
    /// The same for the battery. Ours: a second at 99 Hz, since its sensors are coarser.
    pub battery_frozen_samples: NonZeroU32,
}
