//! One end of the link: how it is set up, and what becomes of its connections.

use std::path::PathBuf;

use credentials::CALLER;
use zenoh::sample::SampleKind;
use zenoh::{Config, Session, Wait};

use crate::BusError;
use crate::crossing::{Crossing, Side, aircraft_name};
use crate::session::{set, set_value};

/// One end of the link between an aircraft and the ground.
#[derive(Debug, Clone)]
pub struct LinkEnd {
    /// What crosses.
    pub table: Crossing,
    /// The folder with this router's certificate.
    pub credentials: PathBuf,
    /// Where this end stands, and how the link is made.
    pub way: Way,
}

/// How the link is made: the aircraft calls, since nobody can call it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Way {
    /// The ground listens at `locator` and lets these vehicles in.
    Accept {
        /// Such as `tls/0.0.0.0:7448`.
        locator: String,
        /// Their names.
        vehicles: Vec<String>,
    },
    /// A vehicle calls the ground at `locator`, again and again until it answers.
    Dial {
        /// Such as `tls/ground-router:7448`.
        locator: String,
        /// The vehicle's own name.
        vehicle: String,
    },
}

impl LinkEnd {
    /// Where it stands.
    pub fn side(&self) -> Side {
        match self.way {
            Way::Accept { .. } => Side::Ground,
            Way::Dial { .. } => Side::Aircraft,
        }
    }

    /// The name that its certificate must bear.
    pub fn name(&self) -> String {
        match &self.way {
            Way::Accept { .. } => self.table.ground.clone(),
            Way::Dial { vehicle, .. } => aircraft_name(vehicle),
        }
    }

    /// Those who may be at the other end.
    pub(super) fn peers(&self) -> Vec<String> {
        match &self.way {
            Way::Accept { vehicles, .. } => vehicles.iter().map(|it| aircraft_name(it)).collect(),
            Way::Dial { .. } => vec![self.table.ground.clone()],
        }
    }
}

/// The settings of one end of the link.
pub(super) fn set_up(config: &mut Config, link: &LinkEnd) -> Result<(), BusError> {
    let vehicles = match &link.way {
        Way::Accept { vehicles, .. } => vehicles.clone(),
        Way::Dial { vehicle, .. } => vec![vehicle.clone()],
    };
    for (key, value) in link.table.settings(link.side(), &vehicles, &link.credentials) {
        set_value(config, key, &value)?;
    }
    if let Way::Dial { locator, .. } = &link.way {
        // Not with the certificate of another aircraft: it would be that one for the ground, and take its link.
        let named = format!("{locator}#{CALLER}={}", link.name());
        set(config, "connect/endpoints", &quoted(&[named]))?;
        set(config, "connect/timeout_ms", "-1")?;
        set(config, "connect/exit_on_failure", "false")?;
        set(config, "connect/retry", "{ period_init_ms: 100, period_max_ms: 200, period_increase_factor: 2 }")?;
    }
    Ok(())
}

pub(super) fn quoted(locators: &[String]) -> String {
    serde_json::json!(locators).to_string()
}

pub(super) fn is_link(locator: &str) -> bool {
    locator.starts_with("tls/")
}

/// A connection over the link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Connection {
    /// The name in the certificate at its other end.
    pub(super) peer: String,
    /// Zenoh's id of the other end: another one for each start of a process.
    pub(super) id: String,
    /// The address of the other end.
    pub(super) from: String,
}

/// Calls `told` for every connection over the link, with whether it is up or down.
pub(super) fn watch_links(
    session: &Session,
    told: impl Fn(Connection, bool) + Send + Sync + 'static,
) -> Result<(), BusError> {
    session
        .info()
        .link_events_listener()
        .history(true)
        .callback(move |event| {
            let link = event.link();
            if is_link(link.src().as_str()) {
                let peer = link.auth_identifier().unwrap_or_default().to_owned();
                let from = link.dst().as_str().trim_start_matches("tls/").to_owned();
                told(Connection { peer, id: link.zid().to_string(), from }, event.kind() == SampleKind::Put);
            }
        })
        .background()
        .wait()
        .map_err(|cause| BusError::Declare { key: "link events".into(), cause: cause.to_string() })
}
