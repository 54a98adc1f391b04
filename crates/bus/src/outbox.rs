//! What goes out: one publisher per key, declared at first use, with the topic's quality of service.

use std::collections::HashMap;

use kittiwake_proto::topics::{Message, Qos, Topic};
use kittiwake_proto::v1::Attachment;
use node::VehicleId;
use prost::Message as _;
use zenoh::bytes::Encoding;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::Locality;
use zenoh::{Session, Wait};

use crate::clock::monotonic_ns;
use crate::{BusError, Scope, trace};

pub(crate) struct Outbox<'a> {
    session: &'a Session,
    scope: &'a Scope,
    publishers: HashMap<(Option<VehicleId>, Topic), (Publisher<'a>, u64)>,
}

impl<'a> Outbox<'a> {
    pub(crate) fn new(session: &'a Session, scope: &'a Scope) -> Outbox<'a> {
        Outbox { session, scope, publishers: HashMap::new() }
    }

    /// Publishes without ever waiting for a receiver.
    pub(crate) fn publish(&mut self, vehicle: Option<VehicleId>, message: &Message) -> Result<(), BusError> {
        let topic = message.topic();
        let (session, scope) = (self.session, self.scope);
        let (publisher, sequence) = match self.publishers.entry((vehicle.clone(), topic)) {
            std::collections::hash_map::Entry::Occupied(it) => it.into_mut(),
            std::collections::hash_map::Entry::Vacant(it) => {
                it.insert((declare(session, &scope.publish(vehicle.as_ref(), topic.key()), topic)?, 0))
            }
        };
        *sequence += 1;
        let traceparent = if topic.qos().keeps_newest_only() { String::new() } else { parent_of(topic) };
        let payload = message.encode();
        let attachment = Attachment { sequence: *sequence, source_monotonic_ns: monotonic_ns(), traceparent };
        if let Err(cause) = publisher.put(payload).attachment(attachment.encode_to_vec()).wait() {
            tracing::warn!(topic = topic.key(), %cause, "not published");
        }
        Ok(())
    }
}

/// The trace that a message of `topic` belongs to; empty: none.
fn parent_of(topic: Topic) -> String {
    let present = trace::current();
    let begun = || topic.begins_trace().then(|| trace::span(topic.key(), None).in_scope(trace::current)).flatten();
    present.or_else(begun).unwrap_or_default()
}

/// The quality of service of a topic in zenoh's terms. Nothing blocks: correctness rests on
/// repetition, acknowledgement and request ids, and a peer that hangs must not delay a contingency.
/// Each class has a priority, and so a queue, of its own.
fn declare<'a>(session: &'a Session, key: &str, topic: Topic) -> Result<Publisher<'a>, BusError> {
    let (priority, express) = match topic.qos() {
        Qos::Sampled => (Priority::DataLow, false),
        Qos::State => (Priority::Data, false),
        // Not express: each express message takes one of the two batches of its queue, and a burst of
        // events would lose its third one to a link that is busy for a millisecond.
        Qos::Transition => (Priority::InteractiveLow, false),
        Qos::Command => (Priority::InteractiveHigh, true),
    };
    session
        .declare_publisher(key.to_owned())
        .congestion_control(CongestionControl::Drop)
        .priority(priority)
        .express(express)
        .allowed_destination(Locality::Remote)
        .encoding(Encoding::APPLICATION_PROTOBUF.with_schema(topic.type_name()))
        .wait()
        .map_err(|cause| BusError::Declare { key: key.to_owned(), cause: cause.to_string() })
}
