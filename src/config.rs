//! The configuration file: every parameter of every process once.

use std::fmt;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::FromStr;

use control_tower::policy::Policy;
use domain::aircraft::{Aircraft, Flight};
use domain::energy::EnergyModel;
use domain::quantity::Seconds;
use domain::time::Pace;
use serde::{Deserialize, Deserializer, de};

/// The whole file. There are no defaults except those in the shipped file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// The vehicle's name, a part of its keys.
    pub vehicle: VehicleName,
    /// How many times faster than the wall clock mission time runs.
    pub speed: Speed,
    /// The seed of every random draw.
    pub seed: u64,
    /// The mission file, relative to this file's folder.
    pub mission: PathBuf,
    /// The contingency table, relative to this file's folder.
    pub contingencies: PathBuf,
    /// The folder of the behavior trees, relative to this file's folder.
    pub trees: PathBuf,
    /// The folder of the declared skills, relative to this file's folder.
    pub skills: PathBuf,
    /// How the control tower answers requests.
    #[serde(deserialize_with = "from_text")]
    pub permissions: Policy,
    /// Where the gateway listens.
    pub http: SocketAddr,
    /// Wall seconds for which a process tries to reach the router before it gives up.
    pub connect_limit_s: Seconds<1000, 600_000>,
    /// Starting and supervising the processes.
    pub launcher: crate::up::Config,
    /// Where traces go.
    pub telemetry: crate::telemetry::Config,
    /// The simulated vehicle and its autopilot.
    pub vehicle_sim: vehicle_sim::config::Config,
    /// The bridge to a PX4.
    pub px4_bridge: px4_bridge::config::Config,
    /// The bridge to an autopilot that speaks MAVLink.
    pub mavlink_bridge: mavlink_bridge::config::Config,
    /// Skills and how they are flown.
    pub skill_manager: skill_manager::config::Config,
    /// Rates, and the rules that raise flags.
    pub monitor: monitor::config::Config,
    /// How the aircraft flies.
    pub flight: Flight,
    /// What a flight takes out of the battery.
    pub energy: EnergyModel,
    /// How objectives become plans.
    pub planner: planner::config::Config,
    /// The mission and contingency manager.
    pub mcm: mcm::config::Config,
    /// How permissions are answered.
    pub control_tower: control_tower::config::Config,
    /// HTTP for operators, and recordings.
    pub gateway: gateway::config::Config,
}

impl Config {
    /// Of both of its sections.
    pub fn aircraft(&self) -> Aircraft {
        Aircraft { flight: self.flight, energy: self.energy }
    }
}

/// A vehicle's name: one part of a key, so it has no characters with a meaning in keys.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct VehicleName(String);

impl VehicleName {
    /// The name as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromStr for VehicleName {
    type Err = String;
    fn from_str(text: &str) -> Result<VehicleName, String> {
        let allowed = |it: char| it.is_ascii_lowercase() || it.is_ascii_digit() || it == '-' || it == '_';
        if !text.is_empty() && text.len() <= 64 && text.chars().all(allowed) {
            Ok(VehicleName(text.to_owned()))
        } else {
            Err(format!("found vehicle name `{text}`, expected up to 64 lower-case letters, digits, `-` and `_`"))
        }
    }
}

impl TryFrom<String> for VehicleName {
    type Error = String;
    fn try_from(text: String) -> Result<VehicleName, String> {
        text.parse()
    }
}

impl fmt::Display for VehicleName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// A speed factor that a [`Pace`] takes.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "f64")]
pub struct Speed(Pace);

impl Speed {
    /// The pace of mission time.
    pub fn pace(self) -> Pace {
        self.0
    }
}

impl TryFrom<f64> for Speed {
    type Error = String;
    fn try_from(factor: f64) -> Result<Speed, String> {
        Pace::new(factor).map(Speed).ok_or_else(|| format!("found speed {factor}, expected a number from 0.1 to 100"))
    }
}

impl FromStr for Speed {
    type Err = String;
    fn from_str(text: &str) -> Result<Speed, String> {
        let factor: f64 =
            text.parse().map_err(|_| format!("found speed `{text}`, expected a number from 0.1 to 100"))?;
        factor.try_into()
    }
}

impl fmt::Display for Speed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.speed().fmt(f)
    }
}

fn from_text<'de, D: Deserializer<'de>, T: FromStr<Err: fmt::Display>>(deserializer: D) -> Result<T, D::Error> {
    String::deserialize(deserializer)?.parse().map_err(de::Error::custom)
}
