//! What goes out: one publisher per key, declared at first use, with the topic's quality of service.

use std::collections::HashMap;

use kittiwake_proto::topics::{Message, Qos, Topic};
use kittiwake_proto::v1::Attachment;
use node::VehicleId;
use prost::Message as _;
use zenoh::bytes::{Encoding, ZBytes};
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::Locality;
use zenoh::{Session, Wait};

use crate::clock::monotonic_ns;
use crate::direct::Links;
use crate::inbox::SharedClocks;
use crate::{BusError, Scope, trace};

pub(crate) struct Outbox<'a> {
    session: &'a Session,
    /// By which receivers know copies; 0 without direct links, where there are none.
    number: u64,
    scope: &'a Scope,
    clocks: SharedClocks,
    ways: HashMap<(Option<VehicleId>, Topic), Ways<'a>>,
}

/// How a topic leaves.
struct Ways<'a> {
    routed: Publisher<'a>,
    sequence: u64,
}

impl<'a> Outbox<'a> {
    /// Of the `place`-th node of the process.
    pub(crate) fn new(
        session: &'a Session,
        place: usize,
        has_links: bool,
        scope: &'a Scope,
        clocks: SharedClocks,
    ) -> Outbox<'a> {
        let number = if has_links { number_of(session, place) } else { 0 };
        Outbox { session, number, scope, clocks, ways: HashMap::new() }
    }

    /// Publishes without ever waiting for a receiver, as a part of the trace `traceparent`, if it is not empty.
    pub(crate) fn publish(
        &mut self,
        vehicle: Option<VehicleId>,
        message: &Message,
        traceparent: String,
        links: &mut Links,
    ) -> Result<(), BusError> {
        let topic = message.topic();
        let said = match (&vehicle, self.scope) {
            (Some(vehicle), Scope::Fleet) => match self.clocks.theirs(vehicle, monotonic_ns()) {
                Some(said) => said,
                // A vehicle that is not heard hears nothing either; what matters is repeated.
                None => return Ok(()),
            },
            _ => 0,
        };
        let key = self.scope.publish(vehicle.as_ref(), topic.key());
        let ways = match self.ways.entry((vehicle, topic)) {
            std::collections::hash_map::Entry::Occupied(it) => it.into_mut(),
            std::collections::hash_map::Entry::Vacant(it) => {
                it.insert(Ways { routed: declare(self.session, &key, topic)?, sequence: 0 })
            }
        };
        ways.sequence += 1;
        let payload = message.encode();
        let attachment = Attachment {
            sequence: ways.sequence,
            source_monotonic_ns: monotonic_ns(),
            traceparent,
            said_receiver_monotonic_ns: said,
            publisher: if goes_directly(topic) { self.number } else { 0 },
            key: self.scope.whole(&key),
        };
        let attachment = attachment.encode_to_vec();
        if goes_directly(topic) {
            links.send(topic, &attachment, &payload);
        }
        let (payload, attachment) = (ZBytes::from(payload), ZBytes::from(attachment));
        if let Err(cause) = ways.routed.put(payload).attachment(attachment).wait() {
            tracing::warn!(topic = topic.key(), %cause, "not published");
        }
        Ok(())
    }
}

/// What is for one receiver and urgent. Telemetry and state are for many, by the router.
pub(crate) fn goes_directly(topic: Topic) -> bool {
    !topic.qos().keeps_newest_only()
}

/// Another one for each start of a process and each of its nodes; never zero.
fn number_of(session: &Session, place: usize) -> u64 {
    let [a, b, c, d, e, f, g, h, ..] = session.zid().to_le_bytes();
    u64::from_le_bytes([a, b, c, d, e, f, g, h]).wrapping_add(place as u64).max(1)
}

/// The trace that a message belongs to; empty: none. Telemetry is not traced, unless others act on it.
pub(crate) fn parent_of(message: &Message) -> String {
    let (topic, begins) = (message.topic(), message.begins_trace());
    if topic.qos().keeps_newest_only() && !begins {
        return String::new();
    }
    let present = trace::current();
    let begun = || begins.then(|| trace::span(topic.key(), None).in_scope(trace::current)).flatten();
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
