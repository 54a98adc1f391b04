//! What leaves the vehicle and when: telemetry at its rates and on changes, acknowledgements, and
//! the faults that keep them from leaving.
//!
//! Knows no values: they are asked for when they are due.

use std::collections::BTreeMap;

use domain::time::{Now, Pace};
use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1;
use node::Effect;

use crate::config::Rates;
use crate::schedule::Schedule;

/// Every topic the vehicle sends.
pub const OUT_TOPICS: [Topic; 9] = [
    Topic::VehicleCommandAck,
    Topic::VehicleStatus,
    Topic::VehicleAttitude,
    Topic::VehicleLocalPosition,
    Topic::VehicleGlobalPosition,
    Topic::VehicleLandDetected,
    Topic::BatteryStatus,
    Topic::TransponderReport,
    Topic::WindEstimate,
];

/// Sent on every change besides their rates.
const ON_CHANGE: [Topic; 2] = [Topic::VehicleStatus, Topic::VehicleLandDetected];

/// What is wrong with a topic.
#[derive(Debug)]
enum TopicFault {
    /// This goes out in place of anything new.
    Frozen(Vec<Message>),
    /// Nothing goes out.
    Dropped,
}

/// Sends what is due.
#[derive(Debug)]
pub struct Publisher {
    schedule: Schedule,
    faults: BTreeMap<Topic, TopicFault>,
    /// So many of the next acknowledgements are not sent.
    pub acks_to_swallow: u32,
    /// What went out last on the topics where a change or a repetition matters.
    last: BTreeMap<Topic, Vec<Message>>,
}

impl Publisher {
    /// Sends everything at once first, then at its rate.
    pub fn new(rates: &Rates, pace: Pace) -> Publisher {
        Publisher {
            schedule: Schedule::new(rates, pace),
            faults: BTreeMap::new(),
            acks_to_swallow: 0,
            last: BTreeMap::new(),
        }
    }

    /// When something is due next.
    pub fn deadline(&self) -> domain::time::Time {
        self.schedule.deadline()
    }

    /// Sends what is due at `now` or has changed; `current` gives the values.
    pub fn publish(&mut self, now: Now, mut current: impl FnMut(Topic) -> Vec<Message>, effects: &mut Vec<Effect>) {
        for topic in self.schedule.due(now.time) {
            if self.faults.contains_key(&topic) {
                self.send(topic, Vec::new(), effects);
            } else {
                self.send(topic, current(topic), effects);
            }
        }
        for topic in ON_CHANGE {
            if !self.faults.contains_key(&topic) {
                let messages = current(topic);
                if self.last.get(&topic) != Some(&timeless(&messages)) {
                    self.send(topic, messages, effects);
                }
            }
        }
    }

    /// Answers a command, unless a fault swallows the answer.
    pub fn acknowledge(&mut self, ack: v1::VehicleCommandAck, effects: &mut Vec<Effect>) {
        if self.acks_to_swallow > 0 {
            self.acks_to_swallow -= 1;
        } else {
            self.send(Topic::VehicleCommandAck, vec![ack.into()], effects);
        }
    }

    /// From now on `topic` says what it says at present.
    pub fn freeze(&mut self, topic: Topic, mut current: impl FnMut(Topic) -> Vec<Message>) {
        let held = match topic {
            Topic::VehicleCommandAck => self.last.get(&topic).cloned().unwrap_or_default(),
            _ => current(topic),
        };
        self.faults.insert(topic, TopicFault::Frozen(held));
    }

    /// From now on `topic` says nothing.
    pub fn drop(&mut self, topic: Topic) {
        self.faults.insert(topic, TopicFault::Dropped);
    }

    /// From now on `topic` says the truth.
    pub fn thaw(&mut self, topic: Topic) {
        self.faults.remove(&topic);
    }

    /// Nothing is wrong with any topic or acknowledgement any more.
    pub fn clear(&mut self) {
        self.faults.clear();
        self.acks_to_swallow = 0;
    }

    fn send(&mut self, topic: Topic, messages: Vec<Message>, effects: &mut Vec<Effect>) {
        match self.faults.get(&topic) {
            Some(TopicFault::Dropped) => {}
            Some(TopicFault::Frozen(held)) => effects.extend(held.iter().cloned().map(Effect::publish)),
            None => {
                if topic == Topic::VehicleCommandAck || ON_CHANGE.contains(&topic) {
                    self.last.insert(topic, timeless(&messages));
                }
                effects.extend(messages.into_iter().map(Effect::publish));
            }
        }
    }
}

/// What is said, whenever it was measured: that alone is no change.
fn timeless(messages: &[Message]) -> Vec<Message> {
    let mut said = messages.to_vec();
    for message in &mut said {
        if let Message::VehicleLandDetected(it) = message {
            it.timestamp_us = 0;
        }
    }
    said
}
