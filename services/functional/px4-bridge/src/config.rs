//! `[px4_bridge]` in the configuration file.

use std::fmt;
use std::str::FromStr;

use domain::quantity::Positive;
use serde::Deserialize;

/// Where PX4 is met, and the limits of what is believed.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Where PX4's Zenoh module connects to.
    pub endpoint: Endpoint,
    /// The first part of its keys (`ZENOH_DOMAIN_ID`).
    pub domain: u8,
    /// A topic that was silent for this long is not relied on: no arming, no command, nothing is said of PX4. In seconds.
    pub silent_after_s: Positive,
    /// PX4's own limit over ground (`MPC_XY_VEL_MAX`): position setpoints with this limit or a higher one go through as they are.
    pub own_speed_m_s: Positive,
    /// How far the moving target may be ahead of the vehicle, in seconds of its speed.
    pub lead_s: Positive,
    /// A reset of the estimator that moves the vehicle by at least this much counts as another frame, in metres.
    pub frame_jump_m: Positive,
    /// A takeoff that has ended this much below its height, in metres, was ended by somebody else.
    pub takeoff_short_m: Positive,
}

/// A locator such as `tcp/127.0.0.1:7447`.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct Endpoint(String);

impl Endpoint {
    /// The locator as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromStr for Endpoint {
    type Err = String;
    fn from_str(text: &str) -> Result<Endpoint, String> {
        let address = text.strip_prefix("tcp/").and_then(|it| it.rsplit_once(':'));
        match address {
            Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok() => Ok(Endpoint(text.to_owned())),
            _ => Err(format!("found endpoint `{text}`, expected `tcp/HOST:PORT` such as `tcp/127.0.0.1:7447`")),
        }
    }
}

impl TryFrom<String> for Endpoint {
    type Error = String;
    fn try_from(text: String) -> Result<Endpoint, String> {
        text.parse()
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_endpoint_is_a_tcp_locator() {
        #[track_caller]
        fn check(text: &str, expected: bool) {
            assert_eq!(text.parse::<Endpoint>().is_ok(), expected, "{text}");
        }
        check("tcp/127.0.0.1:7447", true);
        check("tcp/[::1]:0", true);
        check("udp/127.0.0.1:7447", false);
        check("tcp/127.0.0.1", false);
        check("tcp/:7447", false);
        check("7447", false);
    }
}
