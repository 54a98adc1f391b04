//! What a node wants done.

use std::time::Duration;

use kittiwake_proto::topics::{Message, Qos, Request, Response, Service, Topic};

use crate::{CallId, Token, VehicleId};

/// Something to be done.
#[derive(Debug, Clone, PartialEq)]
pub enum Effect {
    /// Publish a message.
    Publish {
        /// The vehicle that it concerns; `None`: the node's own.
        vehicle: Option<VehicleId>,
        /// Its content.
        message: Message,
    },
    /// Send a request; the outcome comes as [`crate::Event::Reply`], exactly once.
    Call {
        /// Chosen by the node, unique among its open calls.
        call: CallId,
        /// The vehicle that it concerns; `None`: the node's own.
        vehicle: Option<VehicleId>,
        /// The trace it belongs to, as a W3C `traceparent`; `None`: that of the event at hand.
        trace: Option<String>,
        /// Its content.
        request: Request,
        /// The mission time after which the call ends with a [`crate::CallError`].
        timeout: Duration,
    },
    /// Answer a request.
    Reply {
        /// The token of the request.
        token: Token,
        /// The answer.
        response: Response,
    },
    /// Report that a message was refused because its content is invalid. Nothing is sent: the shell counts it, logs the
    /// first of each kind and shows the count in the heartbeat.
    Refused {
        /// What kind of message it was.
        what: MessageKind,
        /// What is wrong with its content, for the log.
        why: String,
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

    /// Reports that a message of this topic, or a request or reply of this service, was refused because of `why`.
    pub fn refused(what: impl Into<MessageKind>, why: impl ToString) -> Effect {
        Effect::Refused { what: what.into(), why: why.to_string() }
    }

    fn is_command(&self) -> bool {
        matches!(self, Effect::Publish { message, .. } if message.topic().qos() == Qos::Command)
    }
}

/// Puts commands to the vehicle before all other effects: sending takes time, and a command must not wait until a
/// message for readers is out. Otherwise the order stays.
pub fn commands_first(effects: &mut [Effect]) {
    effects.sort_by_key(|effect| !effect.is_command());
}

/// The topic or the service that a message belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum MessageKind {
    /// A message of a topic.
    Topic(Topic),
    /// A request to a service, or its reply.
    Service(Service),
}

impl MessageKind {
    /// The key of the topic or service, relative to the vehicle's namespace.
    pub fn key(self) -> &'static str {
        match self {
            MessageKind::Topic(topic) => topic.key(),
            MessageKind::Service(service) => service.key(),
        }
    }
}

impl From<Topic> for MessageKind {
    fn from(topic: Topic) -> MessageKind {
        MessageKind::Topic(topic)
    }
}

impl From<Service> for MessageKind {
    fn from(service: Service) -> MessageKind {
        MessageKind::Service(service)
    }
}
