//! What happens to a node.

use kittiwake_proto::topics::{Message, Request, Response};

use crate::VehicleId;

/// Something that happened.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// A message arrived.
    Message {
        /// The vehicle that it concerns.
        vehicle: VehicleId,
        /// Its content.
        message: Message,
    },
    /// A request arrived, to be answered by [`crate::Effect::Reply`] with the same token.
    Request {
        /// The vehicle that it concerns.
        vehicle: VehicleId,
        /// Names the request in the reply.
        token: Token,
        /// Its content.
        request: Request,
    },
    /// A call of this node has ended, with a reply or without.
    Reply {
        /// The id given with [`crate::Effect::Call`].
        call: CallId,
        /// The reply, or why there is none.
        result: Result<Response, CallError>,
    },
    /// A process appeared or vanished. A node sees its own process appear, too.
    Peer {
        /// The vehicle of the process; empty on the ground.
        vehicle: VehicleId,
        /// The name of its service.
        service: String,
        /// Unique to each start of a process.
        instance: String,
        /// Whether the process is there.
        alive: bool,
    },
}

/// Names a call among the open calls of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CallId(pub u64);

/// Names a request that waits for its reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Token(pub u64);

/// Why a call has no reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CallError {
    /// No process served it before the deadline.
    Unavailable,
    /// A process serves it and did not answer before the deadline, or not at all.
    Unanswered,
    /// It was too old when it arrived, and was refused.
    Late,
    /// The reply does not decode.
    Malformed,
}

impl std::fmt::Display for CallError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            CallError::Unavailable => "unavailable: no process serves it",
            CallError::Unanswered => "unanswered: the process that serves it did not answer in time",
            CallError::Late => "late: the request was too old when it arrived, over a link that is slow or was cut",
            CallError::Malformed => "the reply is malformed",
        })
    }
}

impl std::error::Error for CallError {}
