//! Messages as fast as a rate says, for the programs that measure and trouble a system. Nothing that flies uses it.

use std::time::Duration;

use domain::time::{Now, Time};
use kittiwake_proto::topics::{Message, Topic};
use node::{Effect, Event, Node};

/// Messages are sent in batches of this period.
pub const PERIOD: Duration = Duration::from_millis(10);

/// A process on the bus that ends when it has sent all its messages.
#[derive(Debug)]
pub struct Flood<E> {
    message: E,
    per_batch: u64,
    total: u64,
    sent: u64,
    next: Time,
    is_over: bool,
}

/// How many messages at `rate_hz` are sent in one period.
pub fn per_batch(rate_hz: u32) -> u64 {
    (f64::from(rate_hz) * PERIOD.as_secs_f64()).ceil() as u64
}

impl<M: Into<Message>, E: Fn(u64) -> M> Flood<E> {
    /// Sends `total` messages, `rate_hz` of them a second; `message` makes each from its number, which counts from 0.
    pub fn new(rate_hz: u32, total: u64, message: E) -> Flood<E> {
        Flood { message, per_batch: per_batch(rate_hz), total, sent: 0, next: Time::ZERO, is_over: false }
    }
}

impl<M: Into<Message>, E: Fn(u64) -> M> Node for Flood<E> {
    fn name(&self) -> &'static str {
        "flood"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[]
    }

    fn on(&mut self, _: Now, _: Event, _: &mut Vec<Effect>) {}

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        if now.time < self.next {
            return;
        }
        // One period after the last batch, which has left by then.
        self.is_over = self.total <= self.sent;
        self.next = now.time + PERIOD;
        let until = self.total.min(self.sent.saturating_add(self.per_batch));
        effects.extend((self.sent..until).map(|number| Effect::publish((self.message)(number))));
        self.sent = until;
    }

    fn deadline(&self) -> Option<Time> {
        Some(self.next)
    }

    fn is_over(&self) -> bool {
        self.is_over
    }
}
