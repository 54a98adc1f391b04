//! What all handlers share.

use std::sync::Arc;

use tokio::sync::watch;

use crate::fleet::Snapshot;
use crate::http::Api;
use crate::http::answer_memory::AnswerMemory;
use crate::http::commands::Missions;
use crate::http::idempotency::AnswerCache;
use crate::http::latency::Latencies;
use crate::http::limit::RateLimiter;
use crate::shares::Shares;

/// What all handlers share.
#[derive(Clone)]
pub(crate) struct Site {
    pub(crate) api: Api,
    /// Its sender is dropped when the server stops.
    pub(crate) closing: watch::Receiver<()>,
    /// The event streams.
    pub(crate) streams: Arc<Shares>,
    /// The bodies larger than most may be, until they are answered.
    pub(crate) large_bodies: Arc<Shares>,
    pub(crate) limiter: Arc<RateLimiter>,
    pub(crate) answers: Arc<AnswerCache>,
    /// What the mission managers have told of their missions.
    pub(crate) missions: Arc<Missions>,
    /// Of answers that wait for their clients.
    pub(crate) memory: AnswerMemory,
    /// How long orders took.
    pub(crate) latencies: Latencies,
}

impl Site {
    /// The newest snapshot, cloned at once: a snapshot that stays borrowed would block the gateway's loop.
    pub(crate) fn snapshot(&self) -> Arc<Snapshot> {
        self.api.snapshot.borrow().clone()
    }
}
