//! A node whose inputs and decisions are written down.

use std::cell::RefCell;
use std::rc::Rc;

use domain::time::{Now, Time};
use kittiwake_proto::topics::{Message, Service, Topic};
use node::{Effect, Event, Node, Token};

use super::content::{Entry, Input};

/// Where entries go: must not wait.
pub trait Sink {
    /// Takes the next one.
    fn take(&mut self, entry: Entry);
}

/// Keeps them all.
#[derive(Debug, Clone, Default)]
pub struct Tape(Rc<RefCell<Vec<Entry>>>);

impl Tape {
    /// What it holds; it is empty then.
    pub fn take_all(&self) -> Vec<Entry> {
        std::mem::take(&mut *self.0.borrow_mut())
    }
}

impl Sink for Tape {
    fn take(&mut self, entry: Entry) {
        self.0.borrow_mut().push(entry);
    }
}

/// A node, and what writes down what it is given and what it decides.
pub struct Recorded<N, S> {
    node: N,
    number: u8,
    sink: S,
    /// Of the newest event or turn.
    last: Now,
}

impl<N: Node, S: Sink> Recorded<N, S> {
    /// `node`, the one of this number in [`super::RECORDED`].
    pub fn new(node: N, number: u8, sink: S) -> Recorded<N, S> {
        Recorded { node, number, sink, last: Now { time: Time::ZERO, utc_ms: 0 } }
    }

    /// The same, of a process that follows one that was killed, as this instance.
    pub fn restarted(node: N, number: u8, sink: S, now: Now, instance: u64) -> Recorded<N, S> {
        let mut recorded = Recorded { node, number, sink, last: now };
        recorded.note(now, Input::Restart(instance));
        recorded
    }

    /// The node itself.
    pub fn node(&self) -> &N {
        &self.node
    }

    /// The node, to be given this outside of the bus.
    pub fn given(&mut self, input: Input) -> &mut N {
        self.note(self.last, input);
        &mut self.node
    }

    fn note(&mut self, now: Now, input: Input) {
        self.last = now;
        self.sink.take(Entry::Given { node: self.number, now, input });
    }

    fn write_down(&mut self, effects: &[Effect]) {
        for what in effects.iter().filter_map(decision) {
            self.sink.take(Entry::Did { node: self.number, what });
        }
    }
}

/// What a node has decided, in words: what it says about it, what it asks of others, what it answers. Its status and its tree follow
/// from these, and hold how long its ticks have taken, which is not a decision.
pub(super) fn decision(effect: &Effect) -> Option<String> {
    match effect {
        Effect::Publish { message: Message::DecisionRecord(it), .. } => {
            Some(format!("decides {}: {}", it.topic, it.text))
        }
        Effect::Publish { .. } => None,
        Effect::Call { call, request, .. } => {
            Some(format!("calls {} as {}: {request:?}", request.service().key(), call.0))
        }
        Effect::Reply { token, response } => Some(format!("answers {}: {response:?}", token.0)),
        Effect::Refused { what, why } => Some(format!("refuses {}: {why}", what.key())),
    }
}

impl<N: Node, S: Sink> Node for Recorded<N, S> {
    fn name(&self) -> &'static str {
        self.node.name()
    }

    fn subscriptions(&self) -> &'static [Topic] {
        self.node.subscriptions()
    }

    fn serves(&self) -> &'static [Service] {
        self.node.serves()
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        self.note(now, Input::Event(event.clone()));
        let before = effects.len();
        self.node.on(now, event, effects);
        self.write_down(&effects[before..]);
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.note(now, Input::Act);
        let before = effects.len();
        self.node.act(now, effects);
        self.write_down(&effects[before..]);
    }

    fn answers_later(&self, token: Token) -> bool {
        self.node.answers_later(token)
    }

    fn deadline(&self) -> Option<Time> {
        self.node.deadline()
    }

    fn is_over(&self) -> bool {
        self.node.is_over()
    }
}
