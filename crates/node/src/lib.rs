//! What a service is: events in, effects out, time as a value.
//!
//! Every service is a [`Node`]. The `bus` crate runs one node over the real transport; [`virtual_bus`] runs any number
//! of nodes in one thread on a virtual clock. Both are called shells below. A shell does not know what a node decides,
//! and a node cannot find out on which of them it runs: one suite of checks, `crates/bus/tests/contract`, runs over
//! both.

use domain::time::{Now, Time};
use kittiwake_proto::topics::{Service, Topic};

mod answers;
mod effect;
mod event;
mod scope;
pub mod virtual_bus;

pub use answers::Answers;
pub use effect::{Effect, MessageKind, commands_first};
pub use event::{CallError, CallId, Event, Token};
pub use scope::Scope;

/// The name of a vehicle.
pub type VehicleId = std::sync::Arc<str>;

/// A service as its shell sees it.
///
/// Every request is answered: a node that takes in an [`Event::Request`] gives one [`Effect::Reply`] with its token
/// before the next [`Node::act`] returns, unless it says [`Node::answers_later`]. Work that takes longer is accepted or refused at once, and its result is
/// published. A request without a reply is a mistake in the node; the shell counts it, logs the first of each service,
/// and the caller gets [`CallError::Unanswered`].
pub trait Node {
    /// The name of the service, also in its liveliness token and in its heartbeat.
    fn name(&self) -> &'static str;

    /// The topics that the node receives.
    fn subscriptions(&self) -> &'static [Topic];

    /// The services that the node answers requests to.
    fn serves(&self) -> &'static [Service] {
        &[]
    }

    /// Takes in one event. The effects are performed after this returns, in the order of [`commands_first`].
    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>);

    /// Called once after each batch of events that arrived together, and when [`Node::deadline`] has come: the place
    /// for decisions that look at everything at once. A batch has one order at most ([`Service::is_order`]): the next ones wait until
    /// everybody else in the loop has had a turn.
    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        let _ = (now, effects);
    }

    /// Whether the reply to this request comes later than with the next [`Node::act`], because it must wait for something
    /// outside of the node, such as a disk. What it waits for wakes the shell.
    fn answers_later(&self, token: Token) -> bool {
        let _ = token;
        false
    }

    /// When [`Node::act`] is to be called even if no event arrives.
    fn deadline(&self) -> Option<Time>;

    /// True when the node has nothing left to do; the shell then ends it.
    fn is_over(&self) -> bool {
        false
    }
}
