//! The bridge's parameters.

use std::path::PathBuf;

use domain::quantity::Positive;
use serde::Deserialize;

use crate::ground::GroundEndpoint;
use crate::socket::Endpoint;

/// The section `[mavlink_bridge]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Where the autopilot is.
    pub connect: Endpoint,
    /// Where ground stations are that watch; without the key none may.
    pub ground: Option<GroundEndpoint>,
    /// The file of the key with which everything is signed, on both sides; without the key nothing is.
    pub signing_key: Option<PathBuf>,
    /// The system id of the autopilot; 0: that of the only autopilot on the link.
    pub system: u8,
    /// Silence after which the autopilot counts as gone.
    pub silence_s: Positive,
    /// Without an acknowledgement a command is sent again after this time.
    pub retry_s: Positive,
    /// How often a command is sent in all.
    pub tries: u32,
    /// A command whose effect is not seen after this time is rejected.
    pub effect_limit_s: Positive,
    /// Setpoints of the layers above that are older than this are no longer passed on.
    pub setpoint_age_limit_s: Positive,
    /// The vehicle's own limits, by which a target is moved: over ground.
    pub cruise_m_s: Positive,
    /// The same up and down.
    pub climb_m_s: Positive,
    /// See `climb_m_s`.
    pub descent_m_s: Positive,
    /// How fast a moving target gains and loses speed.
    pub acceleration_m_s2: Positive,
    /// The same up and down.
    pub vertical_acceleration_m_s2: Positive,
    /// A vehicle that stays behind its moving target by more than it should, for this long, does not fly its setpoints.
    pub unflown_s: Positive,
    /// A position that changes by more than this beyond what the speed explains has jumped.
    pub jump_m: Positive,
}
