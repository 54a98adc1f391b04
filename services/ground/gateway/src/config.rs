//! The gateway's parameters.

use std::num::{NonZeroU16, NonZeroU32};
use std::path::PathBuf;

use domain::quantity::{Number, Positive, Seconds};
use serde::Deserialize;

/// The section `[gateway]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// The highest rate at which the state behind the HTTP answers is renewed, per second of wall time. Ours: an eye
    /// sees no faster changes.
    pub snapshot_rate_hz: Positive,
    /// `status` events per second of wall time on each event stream, and renewals of the state while nothing
    /// arrives. Ours: the rate of the mission manager's own status.
    pub status_rate_hz: Positive,
    /// Wall seconds without a heartbeat after which a process counts as stale. Heartbeats come at
    /// 4 Hz of wall time whatever the speed factor (`health.proto`); ours: eight of them.
    pub heartbeat_stale_s: Seconds<50, 60_000>,
    /// Events kept for each vehicle. Ours: enough for several missions.
    pub history_records: NonZeroU16,
    /// Files of the audit trail: days on which something was ordered. Ours: a year.
    pub audit_files: NonZeroU16,
    /// Event streams open at a time. Ours: far more than there are operators.
    pub max_event_streams: NonZeroU16,
    /// Wall seconds after which a request without an answer fails. Ours.
    pub request_timeout_s: Seconds<50, 600_000>,
    /// The most bytes of a request's body. Ours: room for the text of a mission file without data sets.
    pub max_body_bytes: NonZeroU32,
    /// The same where the body is the text of a mission, which may have the zones of a country; at most 4 MiB, since the bus takes no more.
    /// A few of those that exceed `max_body_bytes` are read at a time.
    pub max_mission_bytes: Number<1, 4_194_304>,
    /// Requests per second of wall time that one token may make, and of all clients together that have none. `/`, `/docs`, `/page/*`,
    /// `/openapi.json`, `/healthz` and `/readyz` are not limited. Ours: ten times what a page in busy use needs.
    pub requests_per_s: Positive,
    /// Requests that may be made at once, of the same, before that rate applies.
    pub requests_at_once: Number<1, 1_000_000>,
    /// Wall seconds without a request of its holder after which command of a vehicle lapses. An open
    /// event stream counts as a request. Ours: longer than a page takes to be reloaded.
    pub command_lease_s: Positive,
    /// Whether flags and faults may be injected: only where the vehicle is simulated.
    pub simulation: bool,
    /// The gateway's certificate as PEM, followed by those that lead to its CA. Paths are relative to this
    /// file's folder. Absent: plain HTTP.
    pub tls_certificate: Option<PathBuf>,
    /// The certificate's private key as PEM.
    pub tls_key: Option<PathBuf>,
    /// Whether plain HTTP is allowed on other addresses than the loopback's. Absent: it is not,
    /// because others on the network could read tokens.
    #[serde(default)]
    pub plain_http_beyond_loopback: bool,
    /// Connections open at a time, those of strangers included. Ours: more than event streams.
    pub max_connections: NonZeroU16,
    /// What one client may take of these.
    pub clients: Clients,
    /// Wall seconds that a client may take for a TLS handshake, and for the head of a request. A
    /// connection without a request is closed after the same time. Ours.
    pub head_timeout_s: Seconds<50, 86_400_000>,
    /// How missions are recorded.
    pub recording: crate::recording::config::Config,
}

/// The section `[gateway.clients]`: what strangers, and the holder of one token, may take.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Clients {
    /// Connections that have shown no valid token, at a time; one that is drawn by lot makes place for a newcomer. The others are kept for
    /// token holders. Ours: a tenth of all.
    pub strangers: NonZeroU16,
    /// Of those, from one IPv4 address or one IPv6 network of 64 bits. Ours: several browsers.
    pub strangers_per_address: NonZeroU16,
    /// Connections of one token, its event streams included. Ours: a wall of screens.
    pub connections_per_token: NonZeroU16,
    /// Event streams of one token.
    pub streams_per_token: NonZeroU16,
    /// Downloads of recordings of one token at a time, of 16 in all; and apart from them as many lists and recordings that are read.
    pub downloads_per_token: NonZeroU16,
    /// Wall seconds after which a client that takes no byte of what waits for it is disconnected. Ours: a network that
    /// changes over; a page then connects again and goes on where it was.
    pub write_timeout_s: Positive,
}
