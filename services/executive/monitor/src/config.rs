//! The monitor's parameters.

use std::num::NonZeroU32;

use domain::quantity::{Number, Positive};
use serde::Deserialize;

/// The section `[monitor]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Introspections per second of wall time. From the reference design: 100.
    pub introspection_rate_hz: Number<1, 1000>,
    /// Seconds from the first sample of any source until a source that was never heard counts as
    /// stale; never less than one second of wall time. Ours: longer than any process takes to start.
    pub absent_after_s: Positive,
    /// An attitude that was repeated this often in a row, while armed, counts as frozen. Ours: half
    /// a second at 240 Hz; none repeats in the recorded flight of a real PX4.
    pub attitude_frozen_samples: NonZeroU32,
    /// The same for the local and for the global position. Ours: half a second at 123 Hz; none
    /// repeats there either.
    pub position_frozen_samples: NonZeroU32,
    /// The same for the battery. Ours: a second at 99 Hz, since its sensors are coarser.
    pub battery_frozen_samples: NonZeroU32,
    /// The ids under which a receiver reports the vehicle itself, and the ship that it flies from: no traffic. An echo that is always
    /// where the vehicle is, and as fast, needs no entry.
    pub own_transponders: Vec<String>,
}
