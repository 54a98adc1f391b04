//! The bridge's port to a PX4 over Zenoh: a router that PX4 connects to, apart from the one on board.

use bus::{BusError, Foreign, ForeignLink, ForeignMail, Nudge};
use domain::time::Time;
use px4_bridge::config::Config;
use px4_bridge::keys;
use px4_bridge::port::{Arrival, Port};

use crate::output;

/// Of these only the newest sample counts: they come a hundred times a second and more.
const STREAMS: [&str; 5] =
    ["vehicle_attitude", "vehicle_local_position", "vehicle_global_position", "battery_status", "sensor_combined"];

/// The port over Zenoh.
pub(crate) struct Px4Port(Foreign);

impl Px4Port {
    /// Listens where the configuration says; `nudge` is woken by what arrives.
    ///
    /// # Errors
    /// If the endpoint is taken.
    pub(crate) fn open(config: &Config, nudge: &Nudge) -> Result<Px4Port, BusError> {
        let link = ForeignLink {
            listen: config.endpoint.to_string(),
            receive: keys::outputs(config.domain),
            tokens: keys::tokens(config.domain),
            keeps_newest_only: is_stream,
        };
        let foreign = Foreign::open(&link, nudge)?;
        output::error_line(format_args!("px4-bridge: PX4 is awaited at {}", foreign.locators().join(", ")));
        Ok(Px4Port(foreign))
    }
}

fn is_stream(key: &str) -> bool {
    key.split('/').nth(3).is_some_and(|topic| STREAMS.contains(&topic))
}

impl Port for Px4Port {
    fn take(&mut self, _now: Time) -> Vec<Arrival> {
        let arrival = |mail| match mail {
            ForeignMail::Sample { key, payload } => Some(Arrival::Sample { key, payload }),
            ForeignMail::Token { key, alive } => Some(Arrival::Token { key, alive }),
            // Nothing is served to PX4.
            ForeignMail::Request { .. } => None,
        };
        self.0.take().into_iter().filter_map(arrival).collect()
    }

    fn put(&mut self, _now: Time, key: &str, payload: Vec<u8>) {
        self.0.put(key, payload, None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_streams_only_the_newest_counts_and_of_events_every_one() {
        let key = |topic| format!("0/fmu/out/{topic}/px4_msgs::msg::dds_::X_/RIHS01_00");
        assert!(is_stream(&key("vehicle_attitude")));
        assert!(!is_stream(&key("vehicle_status")) && !is_stream(&key("vehicle_command_ack")));
    }
}
