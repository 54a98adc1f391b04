//! The control tower's parameters.

use domain::quantity::{Fraction, Positive};
use serde::de::Error;
use serde::{Deserialize, Deserializer};

use crate::texts::MAX_REASON_BYTES;

/// The section `[control_tower]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Mission seconds between a request and its grant under [`Policy::Delay`](crate::policy::Policy::Delay).
    /// Ours: half of the 10 s for which the planner waits for an answer.
    pub delay_s: Positive,
    /// Probability that a request is denied under [`Policy::Random`](crate::policy::Policy::Random).
    /// Ours: one half exercises both equally.
    pub random_denial: Fraction,
    /// The reason given when a policy denies.
    #[serde(deserialize_with = "reason")]
    pub denial_reason: String,
    /// Mission seconds for which a grant is valid. Ours: several times the reference mission's legs.
    pub grant_valid_s: Positive,
    /// Publications of each ledger, or of one part of a large one, per second of wall time, besides those of changes. From
    /// the contract (`permission.proto`): 1.
    pub ledger_rate_hz: Positive,
}

fn reason<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    let reason = String::deserialize(deserializer)?;
    if MAX_REASON_BYTES < reason.len() {
        return Err(D::Error::custom(format!(
            "{} bytes, more than the {MAX_REASON_BYTES} that reach a vehicle",
            reason.len()
        )));
    }
    Ok(reason)
}
