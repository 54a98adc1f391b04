//! What the vehicle sends and when: telemetry at its rates and on changes, acknowledgements, and the
//! faults that freeze or drop them.
//!
//! It knows no values: it asks for them when they are due.

use std::collections::BTreeMap;

use domain::fmu::CommandAck;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1;
use node::Effect;

use crate::config::Rates;
use crate::schedule::Schedule;

/// Every topic that the vehicle sends.
pub(crate) const OUT_TOPICS: [Topic; 9] = [
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

/// Sent on every change, too.
const ON_CHANGE: [Topic; 2] = [Topic::VehicleStatus, Topic::VehicleLandDetected];

/// An injected fault of a topic.
#[derive(Debug)]
enum TopicFault {
    /// These messages are sent in place of new ones.
    Frozen(Vec<Message>),
    /// Nothing is sent.
    Dropped,
}

/// Sends what is due.
#[derive(Debug)]
pub(crate) struct Publisher {
    schedule: Schedule,
    faults: BTreeMap<Topic, TopicFault>,
    /// How many of the next acknowledgements are not sent: a fault.
    pub(crate) acks_to_swallow: u32,
    /// The autopilot has not come up yet.
    silent: bool,
    /// What was sent last on the topics where a change or a repetition matters.
    last: BTreeMap<Topic, Vec<Message>>,
}

impl Publisher {
    /// Sends everything at the start, then at its rate.
    pub(crate) fn new(rates: &Rates, pace: Pace) -> Publisher {
        Publisher {
            schedule: Schedule::new(rates, pace),
            faults: BTreeMap::new(),
            acks_to_swallow: 0,
            silent: false,
            last: BTreeMap::new(),
        }
    }

    /// When the next message is due.
    pub(crate) fn deadline(&self) -> Time {
        self.schedule.deadline()
    }

    /// Sends what is due at `now` or has changed; `current` gives the values.
    pub(crate) fn publish(
        &mut self,
        now: Now,
        mut current: impl FnMut(Topic) -> Vec<Message>,
        effects: &mut Vec<Effect>,
    ) {
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
    pub(crate) fn acknowledge(&mut self, ack: CommandAck, effects: &mut Vec<Effect>) {
        if self.acks_to_swallow > 0 {
            self.acks_to_swallow -= 1;
        } else {
            self.send(Topic::VehicleCommandAck, vec![v1::VehicleCommandAck::from(ack).into()], effects);
        }
    }

    /// Whether nothing is sent at all.
    pub(crate) fn silence(&mut self, silent: bool) {
        self.silent = silent;
    }

    /// From now on `topic` repeats its present message.
    pub(crate) fn freeze(&mut self, topic: Topic, mut current: impl FnMut(Topic) -> Vec<Message>) {
        let held = match topic {
            Topic::VehicleCommandAck => self.last.get(&topic).cloned().unwrap_or_default(),
            _ => current(topic),
        };
        self.faults.insert(topic, TopicFault::Frozen(held));
    }

    /// From now on nothing is sent on `topic`.
    pub(crate) fn drop(&mut self, topic: Topic) {
        self.faults.insert(topic, TopicFault::Dropped);
    }

    /// Ends the fault of `topic`.
    pub(crate) fn thaw(&mut self, topic: Topic) {
        self.faults.remove(&topic);
    }

    /// Ends the faults of all topics and acknowledgements.
    pub(crate) fn clear(&mut self) {
        self.faults.clear();
        self.acks_to_swallow = 0;
    }

    fn send(&mut self, topic: Topic, messages: Vec<Message>, effects: &mut Vec<Effect>) {
        match self.faults.get(&topic) {
            _ if self.silent => {}
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

/// The messages without their time, since a newer time alone is not a change.
fn timeless(messages: &[Message]) -> Vec<Message> {
    let mut messages = messages.to_vec();
    for message in &mut messages {
        match message {
            Message::VehicleLandDetected(it) => it.timestamp_us = 0,
            Message::VehicleStatus(it) => it.timestamp_us = 0,
            _ => {}
        }
    }
    messages
}
