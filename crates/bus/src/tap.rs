//! Looks on: hands over every message of some topics with what travels beside it, missing none.
//!
//! For measurements. A node sees the newest sample of a telemetry topic and no stamps; a tap sees all
//! samples as they come, and says nothing on the bus.

use kittiwake_proto::topics::{Message, Topic};
use node::VehicleId;
use zenoh::{Session, Wait};

use crate::clock::monotonic_ns;
use crate::{BusError, Link, Scope, session, trace};

/// A message as it passed by.
#[derive(Debug, Clone)]
pub struct Tapped {
    /// Whose it is.
    pub vehicle: VehicleId,
    /// What it says.
    pub message: Message,
    /// Counts up per publisher and topic.
    pub sequence: u64,
    /// When it was published, by [`monotonic_ns`].
    pub published_ns: u64,
    /// When it came by here.
    pub received_ns: u64,
    /// The trace it belongs to: 32 hexadecimal digits, empty for none.
    pub trace: String,
    /// Bytes of its payload.
    pub size: usize,
}

/// Looks on until it is dropped.
pub struct Tap {
    session: Session,
}

impl Tap {
    /// Hands every message of `topics` to `heard`, on the transport's own threads: it must be quick.
    pub fn open(
        link: &Link,
        topics: &[Topic],
        heard: impl Fn(Tapped) + Clone + Send + Sync + 'static,
    ) -> Result<Tap, BusError> {
        let session = session::open(link)?;
        let keys = |topic: Topic| {
            // As in a process's inbox: those on the ground belong to no vehicle.
            let on_ground = topic == Topic::Heartbeat && link.scope == Scope::Fleet;
            std::iter::once(link.scope.listen(topic.key())).chain(on_ground.then(|| topic.key().to_owned()))
        };
        for (topic, key) in topics.iter().flat_map(|&topic| keys(topic).map(move |key| (topic, key))) {
            let (scope, heard) = (link.scope.clone(), heard.clone());
            session
                .declare_subscriber(&key)
                .callback(move |sample| {
                    let received_ns = monotonic_ns();
                    let payload = sample.payload().to_bytes();
                    let Ok(message) = Message::decode(topic, &payload) else { return };
                    let attachment = sample.attachment().and_then(|it| trace::read(&it.to_bytes())).unwrap_or_default();
                    heard(Tapped {
                        vehicle: scope.vehicle_of(sample.key_expr().as_str()),
                        message,
                        sequence: attachment.sequence,
                        published_ns: attachment.source_monotonic_ns,
                        received_ns,
                        trace: trace::id(&attachment.traceparent),
                        size: payload.len(),
                    });
                })
                .background()
                .wait()
                .map_err(|cause| BusError::Declare { key: key.clone(), cause: cause.to_string() })?;
        }
        Ok(Tap { session })
    }
}

impl Drop for Tap {
    fn drop(&mut self) {
        // A router that has ended needs no event.
        let _ = self.session.close().wait();
    }
}
