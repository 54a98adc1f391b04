//! The gateway's parameters.

use std::num::{NonZeroU16, NonZeroU32};
use std::path::PathBuf;

use domain::quantity::Positive;
use serde::Deserialize;

/// The section `[gateway]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Renewals of the state behind the HTTP answers a second of wall time, at most. Ours: what an eye sees.
    pub snapshot_rate_hz: Positive,
    /// `status` events a second of wall time on each event stream, and renewals of the state while
    /// nothing arrives. Ours: the rate of the mission manager's own status.
    pub status_rate_hz: Positive,
    /// Wall seconds without a heartbeat after which a process counts as stale. Heartbeats come at
    /// 2 Hz of wall time whatever the speed factor (`health.proto`); ours: four of them.
    pub heartbeat_stale_s: Positive,
    /// Events kept for each vehicle. Ours: some missions' worth.
    pub history_records: NonZeroU16,
    /// Event streams open at a time. Ours: far more than there are operators.
    pub max_event_streams: NonZeroU16,
    /// Wall seconds after which a request that is not answered is given up. Ours.
    pub request_timeout_s: Positive,
    /// Bytes of a request's body. Ours: a mission file's text.
    pub max_body_bytes: NonZeroU32,
    /// Requests a second of wall time that one token may make, and so many at once. Ours: a page that
    /// is used in a hurry needs a tenth.
    pub requests_per_s: Positive,
    /// See there.
    pub requests_at_once: Positive,
    /// Wall seconds without a request of its holder after which command of a vehicle lapses. An open
    /// event stream counts as a request. Ours: longer than a page takes to be loaded anew.
    pub command_lease_s: Positive,
    /// Whether flags and faults may be injected: only where the vehicle is simulated.
    pub simulation: bool,
    /// The certificate that the gateway shows, its own first and those that lead to its CA after it, as
    /// PEM, and the key that belongs to it. Paths are relative to this file's folder. Absent: plain HTTP.
    pub tls_certificate: Option<PathBuf>,
    /// See there.
    pub tls_key: Option<PathBuf>,
    /// Whether plain HTTP may be spoken on other addresses than the loopback's; absent: it may not, since
    /// whoever is on the way could read tokens.
    #[serde(default)]
    pub plain_http_beyond_loopback: bool,
    /// Connections open at a time; more are closed at once. Ours: more than event streams.
    pub max_connections: NonZeroU16,
    /// Wall seconds that a client may take for a TLS handshake, and for the head of a request. A
    /// connection on which nothing is asked is closed after as long. Ours.
    pub head_timeout_s: Positive,
    /// What is kept of each mission.
    pub recording: crate::recording::config::Config,
}
