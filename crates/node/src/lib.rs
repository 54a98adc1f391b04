//! What a service is: events in, effects out, time as a value.
//!
//! Every service is a [`Node`]. The `bus` crate runs one over the real transport; [`virtual_bus`]
//! runs any number of them in one thread on a virtual clock. Neither knows what a node decides,
//! and a node cannot tell which of them it runs on: there is nothing a core decides that a shell
//! could hide.

use std::time::Duration;

use domain::time::{Now, Time};
use kittiwake_proto::topics::{Message, Request, Response, Service, Topic};

pub mod virtual_bus;

/// Which vehicle something is about.
pub type VehicleId = std::sync::Arc<str>;

/// A service as its surroundings see it.
pub trait Node {
    /// Its name: the name of the process, of its liveliness token and in its heartbeat.
    fn name(&self) -> &'static str;

    /// The topics it wants to receive.
    fn subscriptions(&self) -> &'static [Topic];

    /// The requests it answers.
    fn serves(&self) -> &'static [Service] {
        &[]
    }

    /// Takes in one event. Effects are performed in order, after this returns; over the real transport
    /// commands to the vehicle come before all others.
    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>);

    /// Called once after each batch of events that arrived together, and when [`Node::deadline`]
    /// has come: the place for decisions that look at everything at once.
    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        let _ = (now, effects);
    }

    /// When it wants [`Node::act`] called even if nothing happens.
    fn deadline(&self) -> Option<Time>;

    /// True once it has nothing left to do and its process may end.
    fn is_over(&self) -> bool {
        false
    }
}

/// Something that happened.
// Passed on one at a time: nothing is gained by boxing the large variant.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// A message arrived.
    Message {
        /// Whose it is.
        vehicle: VehicleId,
        /// What it says.
        message: Message,
    },
    /// A request arrived; to be answered by [`Effect::Reply`] with the same token.
    Request {
        /// Whose it is.
        vehicle: VehicleId,
        /// Names the request in the reply.
        token: Token,
        /// What is asked.
        request: Request,
    },
    /// The reply to a call of one's own, or why there is none.
    Reply {
        /// The id given with [`Effect::Call`].
        call: CallId,
        /// The reply.
        result: Result<Response, CallError>,
    },
    /// A process appeared or vanished.
    Peer {
        /// Its vehicle; empty for a process that belongs to none.
        vehicle: VehicleId,
        /// Its service's name.
        service: String,
        /// Unique to each start of it.
        instance: String,
        /// Whether it is there.
        alive: bool,
    },
}

/// Something to be done.
// Passed on one at a time: nothing is gained by boxing the large variant.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, PartialEq)]
pub enum Effect {
    /// Publish a message.
    Publish {
        /// For which vehicle; `None`: the node's own.
        vehicle: Option<VehicleId>,
        /// What.
        message: Message,
    },
    /// Send a request; the outcome comes as [`Event::Reply`], exactly once.
    Call {
        /// Chosen by the node, unique among its open calls.
        call: CallId,
        /// Of which vehicle; `None`: the node's own.
        vehicle: Option<VehicleId>,
        /// The trace it belongs to, as a W3C `traceparent`; `None`: that of the event at hand.
        trace: Option<String>,
        /// What is asked.
        request: Request,
        /// After so much mission time the reply is [`CallError`], whatever happens.
        timeout: Duration,
    },
    /// Answer a request.
    Reply {
        /// The request's token.
        token: Token,
        /// The answer.
        response: Response,
    },
}

impl Effect {
    /// Publishes `message` for the node's own vehicle.
    pub fn publish(message: impl Into<Message>) -> Effect {
        Effect::Publish { vehicle: None, message: message.into() }
    }

    /// Publishes `message` for `vehicle`.
    pub fn publish_to(vehicle: &VehicleId, message: impl Into<Message>) -> Effect {
        Effect::Publish { vehicle: Some(vehicle.clone()), message: message.into() }
    }
}

/// Names a call among a node's open calls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CallId(pub u64);

/// Names a request that waits for its answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Token(pub u64);

/// Why a call has no reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CallError {
    /// Nobody served it within the deadline.
    Unavailable,
    /// Somebody serves it but did not answer within the deadline.
    Unanswered,
    /// It arrived too long after it was sent, and was not obeyed.
    Late,
    /// The answer was not a message of the expected type.
    Malformed,
}

impl std::fmt::Display for CallError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            CallError::Unavailable => "unavailable: nobody serves it",
            CallError::Unanswered => "unanswered: it is served but did not answer in time",
            CallError::Late => "late: it came too late to be obeyed, over a link that is slow or was cut",
            CallError::Malformed => "the answer was malformed",
        })
    }
}

impl std::error::Error for CallError {}
