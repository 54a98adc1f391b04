//! What may cross the link between an aircraft and the ground, how often and how urgently.
//!
//! One table, `config/zenoh/link.toml`, read by the routers of both sides ([`Crossing::read`]). From it
//! follow who may say what to whom (`grants`), and zenoh's settings for it (`settings`): access control
//! by the name in the peer's certificate, thinning on the aircraft, priorities and a limit on size.
//! Everything that is not in the table is denied. What does not come over TLS comes from one's own side
//! and is not looked at.

use std::time::Duration;

use kittiwake_proto::topics::{Service, Topic};
use serde::Deserialize;

mod grants;
mod settings;
mod table;

/// A side of the link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// On board of one vehicle.
    Aircraft,
    /// Where operators and the control tower are.
    Ground,
}

/// How urgent something is, and so which of the others it overtakes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Class {
    /// Orders, decisions, and their answers.
    Command,
    /// What the operator's picture is made of.
    State,
    /// What can wait.
    Bulk,
}

/// The checked table.
#[derive(Debug, Clone, PartialEq)]
pub struct Crossing {
    /// The name in the certificate of the ground's router.
    pub ground: String,
    pub(crate) carrier: Carrier,
    pub(crate) priority: Priorities,
    pub(crate) topics: Vec<TopicRow>,
    pub(crate) services: Vec<ServiceRow>,
}

/// The transport of the link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Carrier {
    pub(crate) lease: Duration,
    pub(crate) open_limit: Duration,
    pub(crate) batch_bytes: u16,
    pub(crate) queue_batches: u8,
    pub(crate) send_buffer_bytes: u32,
    pub(crate) largest_message_bytes: u32,
}

/// Zenoh's priority of each class.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Priorities {
    command: Priority,
    state: Priority,
    bulk: Priority,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Priority {
    RealTime,
    InteractiveHigh,
    InteractiveLow,
    DataHigh,
    Data,
    DataLow,
    Background,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TopicRow {
    pub(crate) topic: Topic,
    /// Who publishes it.
    pub(crate) from: Side,
    pub(crate) class: Class,
    pub(crate) rate_hz: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ServiceRow {
    pub(crate) service: Service,
    pub(crate) answered_by: Side,
    pub(crate) class: Class,
}

impl Priorities {
    pub(crate) fn of(self, class: Class) -> Priority {
        match class {
            Class::Command => self.command,
            Class::State => self.state,
            Class::Bulk => self.bulk,
        }
    }
}

/// The name in the certificate of a vehicle's router.
pub fn aircraft_name(vehicle: &str) -> String {
    format!("{vehicle}-router")
}
