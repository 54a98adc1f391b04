//! What a run hears.

use kittiwake_proto::topics::Message;

use crate::figures::How;
use crate::system::Reach;
use crate::trouble::{Order, Victim};

/// What a run hears, in order.
#[derive(Debug)]
pub(crate) enum Heard {
    /// From the bus.
    Message(Message),
    /// A line of the system with this number.
    Line(u32, String),
    /// That system is up, and can be reached there.
    Up(u32, Reach),
    /// That system's launcher has ended.
    Ended(u32),
    /// A process is about to be killed or stopped.
    Lost { victim: Victim, id: u32, how: How },
    /// A stopped process goes on.
    Continued { id: u32 },
    /// An order is about to be given; its outcome is not known yet.
    Given(Order),
    /// The sender of an order has an answer.
    Answered { order: Order, accepted: bool },
    /// An order was accepted, or was not in the end.
    Ordered { order: Order, accepted: bool, said: String },
    /// An order was given once, into a link that was cut just before, and was not accepted.
    NotAccepted { order: Order, said: String },
    /// For the story.
    Note(String),
}
