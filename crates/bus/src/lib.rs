//! The only crate that knows zenoh: runs a [`node::Node`] over the real transport.
//!
//! One loop on one thread per process. Zenoh's callbacks only decode and hand over into the
//! `mailbox` (the newest sample of a telemetry topic, a bounded queue for the rest), so a slow
//! node never blocks the transport; the loop takes everything that arrived together, shows it to
//! the node event by event, lets it act, and performs its effects. It never waits for a peer.
//! A loop may have several nodes ([`Composition`]): they take turns, and hand each other messages in memory.

use std::time::Duration;

mod calls;
mod clock;
pub mod crossing;
mod direct;
mod duplicates;
mod foreign;
mod freshness;
mod inbox;
mod keys;
pub mod link_credentials;
mod losses;
mod mailbox;
mod neighbours;
mod nudge;
mod only_one;
mod outbox;
mod presence;
mod process;
pub mod router;
mod seat;
mod session;
mod shell;
pub mod sockets;
mod stop;
mod tap;
mod trace;
mod turns;
mod wake;

pub use clock::{Clock, monotonic_ns};
pub use direct::Direct;
pub use foreign::{Foreign, ForeignLink, ForeignMail};
pub use nudge::Nudge;
pub use presence::{Presence, RouterView, look_at_router, look_for};
pub use process::{Composition, Hosted, Process};
pub use router::{run_linked_router, run_router};
pub use stop::Stop;
pub use tap::{Tap, Tapped};

/// Where a process stands: on a vehicle, or on the ground and in sight of all vehicles.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Scope {
    /// Speaks within the namespace of one vehicle.
    Vehicle(String),
    /// Receives from every vehicle and names one when it publishes.
    Fleet,
}

/// How to get onto the bus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Link {
    /// Locators of the router, such as `unixsock-stream//run/kittiwake/router.sock`; the first that answers is used.
    pub connect: Vec<String>,
    /// Where the process stands.
    pub scope: Scope,
    /// How long to try before giving up, in wall time.
    pub open_timeout: Duration,
}

/// Why a process could not get onto the bus, or stay on it.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// No router answered.
    #[error("no router reached at {locators} within {waited:?}: {cause}")]
    Unreachable {
        /// What was tried.
        locators: String,
        /// For how long.
        waited: Duration,
        /// What zenoh said last.
        cause: String,
    },
    /// A Unix socket that is not to be used.
    #[error(transparent)]
    Socket(#[from] sockets::InvalidSocket),
    /// The router could not listen.
    #[error("cannot listen on {locators}: {cause}")]
    Listen {
        /// What was tried.
        locators: String,
        /// What zenoh said.
        cause: String,
    },
    /// The second connection over the link cannot even be tried.
    #[error("no second connection to {locator}: {cause}")]
    Link {
        /// Whom it would call.
        locator: String,
        /// What zenoh said.
        cause: String,
    },
    /// Another process of the same service has the same vehicle.
    #[error(
        "another {service} runs already for the same vehicle, on the same router (instance {instance}): end one of them"
    )]
    RunsAlready {
        /// The service.
        service: String,
        /// The other process.
        instance: String,
    },
    /// Another process of the same service was started later for the same vehicle, while this one was away.
    #[error("a newer {service} runs for the same vehicle (instance {instance}): this one ends, so that only one flies")]
    Superseded {
        /// The service.
        service: String,
        /// The other process.
        instance: String,
    },
    /// Nobody says whether another process of the same service has the same vehicle.
    #[error("the router did not say within {waited:?} whether another {service} runs for the same vehicle: try again")]
    Unanswered {
        /// The service.
        service: String,
        /// For how long.
        waited: Duration,
    },
    /// A declaration was refused.
    #[error("cannot declare `{key}`: {cause}")]
    Declare {
        /// The key.
        key: String,
        /// What zenoh said.
        cause: String,
    },
    /// The loop cannot be woken.
    #[error("the operating system refuses an event counter: {cause}")]
    NoWake {
        /// What it said.
        cause: String,
    },
    /// A setting that this zenoh does not know: a mistake of ours, or another zenoh.
    #[error("zenoh refuses the setting `{key}`: {cause}")]
    Setting {
        /// The setting's path.
        key: &'static str,
        /// What zenoh said.
        cause: String,
    },
}

// The stories use this crate as others do, in the program of its unit tests: one program links faster than two.
#[cfg(test)]
extern crate self as bus;
#[cfg(test)]
#[path = "../tests/main.rs"]
mod stories;
