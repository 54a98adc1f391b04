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
    /// Places that must be ready before the air round them is granted, with distinct names.
    #[serde(default, rename = "site", deserialize_with = "sites")]
    pub sites: Vec<Site>,
}

impl Config {
    /// The names of its sites.
    pub fn site_names(&self) -> Vec<&str> {
        self.sites.iter().map(|it| it.name.as_str()).collect()
    }
}

/// A place to land at whose party says whether it is ready, and what that takes; at least one condition.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Site {
    /// As a mission's `ready` names it.
    pub name: String,
    /// Its rotor must be at rest.
    #[serde(default)]
    pub rotor_stopped: bool,
    /// Nothing and nobody may be on its deck.
    #[serde(default)]
    pub deck_clear: bool,
    /// The strongest wind at its deck, in metres per second.
    pub wind_at_most_m_s: Option<Positive>,
    /// A report counts for this long, in mission seconds.
    pub silent_after_s: Positive,
    /// Without a party, for flights of the simulator: what the site says by itself.
    pub simulated: Option<Simulated>,
}

/// What a site says that has no party. A report takes its place, and counts for ever.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Simulated {
    /// Mission seconds that the rotor takes to stop once somebody asks.
    pub rotor_stops_s: Positive,
    /// Whether something is on the deck.
    pub deck_occupied: bool,
    /// The wind at the deck.
    pub wind_m_s: Positive,
}

/// Longer ones do not fit into the reasons that reach a vehicle.
const LONGEST_SITE_BYTES: usize = 100;

fn sites<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Site>, D::Error> {
    let sites = Vec::<Site>::deserialize(deserializer)?;
    for (index, site) in sites.iter().enumerate() {
        let Site { name, rotor_stopped, deck_clear, wind_at_most_m_s, .. } = site;
        let wrong = if name.trim().is_empty() || LONGEST_SITE_BYTES < name.len() {
            Some(format!("the name of a site has {} bytes, expected 1 to {LONGEST_SITE_BYTES}", name.len()))
        } else if sites[..index].iter().any(|it| it.name == *name) {
            Some(format!("two sites with the name `{name}`"))
        } else if !rotor_stopped && !deck_clear && wind_at_most_m_s.is_none() {
            Some(format!("site `{name}` has no condition: give it `rotor_stopped`, `deck_clear` or `wind_at_most_m_s`"))
        } else {
            None
        };
        if let Some(wrong) = wrong {
            return Err(D::Error::custom(wrong));
        }
    }
    Ok(sites)
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
