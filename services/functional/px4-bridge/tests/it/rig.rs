//! A bridge on its own, with a port in memory.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use domain::time::{Now, Time};
use kittiwake_proto::topics::Message;
use node::{Effect, Event, Node};
use px4_bridge::Px4Bridge;
use px4_bridge::cdr::{Definitions, Record};
use px4_bridge::config::Config;
use px4_bridge::keys;
use px4_bridge::port::{Arrival, Port};

/// Key and bytes of a sample to PX4.
type Sent = (String, Vec<u8>);

#[derive(Clone, Default)]
struct Memory {
    arrivals: Rc<RefCell<Vec<Arrival>>>,
    sent: Rc<RefCell<Vec<Sent>>>,
}

impl Port for Memory {
    fn take(&mut self, _now: Time) -> Vec<Arrival> {
        self.arrivals.take()
    }

    fn put(&mut self, _now: Time, key: &str, payload: Vec<u8>) {
        self.sent.borrow_mut().push((key.to_owned(), payload));
    }
}

/// A bridge and what it was told last.
pub(crate) struct Rig {
    bridge: Px4Bridge<Memory>,
    memory: Memory,
    definitions: Definitions,
    now: Time,
    pub(crate) refused: Vec<String>,
}

/// The shipped configuration.
pub(crate) fn config() -> Config {
    let text = include_str!("../../../../../config/kittiwake.toml");
    let table: toml::Table = text.parse().expect("the shipped file");
    table["px4_bridge"].clone().try_into().expect("the section")
}

impl Rig {
    pub(crate) fn new() -> Rig {
        let memory = Memory::default();
        let bridge = Px4Bridge::new(&config(), memory.clone());
        Rig { bridge, memory, definitions: Definitions::known(), now: Time::ZERO, refused: Vec::new() }
    }

    pub(crate) fn at_ms(&mut self, ms: u64) -> &mut Rig {
        self.now = Time::after(Duration::from_millis(ms));
        self
    }

    /// What the bridge publishes when this arrives.
    pub(crate) fn arrives(&mut self, arrival: Arrival) -> Vec<Message> {
        self.memory.arrivals.borrow_mut().push(arrival);
        let mut effects = Vec::new();
        self.bridge.act(Now { time: self.now, utc_ms: 0 }, &mut effects);
        self.published(effects)
    }

    /// A message of the table with these numbers and truths.
    pub(crate) fn sample(&mut self, topic: &str, numbers: &[(&str, f64)], truths: &[&str]) -> Vec<Message> {
        let definition = self.definitions.newest(topic).expect("a topic of the table").clone();
        let mut record = Record::zero(&definition);
        for (field, value) in numbers {
            record.set_number(field, *value).expect("a field");
        }
        for field in truths {
            record.set_flag(field, true).expect("a field");
        }
        self.arrives(Arrival::Sample {
            key: output(topic, &definition.type_name, &definition.hash),
            payload: record.encode(),
        })
    }

    /// PX4 listens to everything that is sent to it.
    pub(crate) fn listens(&mut self) {
        for topic in ["vehicle_command", "offboard_control_mode", "trajectory_setpoint"] {
            let it = self.definitions.newest(topic).expect("a topic of the table");
            let key = token(topic, &it.type_name, &it.hash);
            self.arrives(Arrival::Token { key, alive: true });
        }
    }

    /// What the bridge publishes after this message.
    pub(crate) fn told(&mut self, message: impl Into<Message>) -> Vec<Message> {
        let mut effects = Vec::new();
        let event = Event::Message { vehicle: "uav1".into(), message: message.into() };
        self.bridge.on(Now { time: self.now, utc_ms: 0 }, event, &mut effects);
        self.published(effects)
    }

    /// What went to PX4 since the last time, decoded: the topic, and these numbers.
    pub(crate) fn sent(&mut self, fields: &[&str]) -> Vec<(String, Vec<f64>)> {
        let sent = self.memory.sent.take();
        let one = |(key, payload): (String, Vec<u8>)| {
            let key = keys::read(&key, 0).expect("a key of PX4");
            let definition = self.definitions.of(key.topic, key.hash).expect("a known version");
            let record = Record::decode(definition, &payload).expect("a whole message");
            let numbers = fields.iter().filter_map(|it| record.number(it).ok()).collect();
            (key.topic.to_owned(), numbers)
        };
        sent.into_iter().map(one).collect()
    }

    fn published(&mut self, effects: Vec<Effect>) -> Vec<Message> {
        let mut messages = Vec::new();
        for effect in effects {
            match effect {
                Effect::Publish { message, .. } => messages.push(message),
                Effect::Refused { why, .. } => self.refused.push(why),
                Effect::Call { .. } | Effect::Reply { .. } => panic!("the bridge calls nobody"),
            }
        }
        messages
    }
}

pub(crate) fn output(topic: &str, type_name: &str, hash: &str) -> String {
    format!("0/fmu/out/{topic}/px4_msgs::msg::dds_::{type_name}_/RIHS01_{hash}")
}

pub(crate) fn token(topic: &str, type_name: &str, hash: &str) -> String {
    format!(
        "@ros2_lv/0/00/0/11/MS/%/%/px4_00/%fmu%in%{topic}/px4_msgs::msg::dds_::{type_name}_/RIHS01_{hash}/::,7:,:,:,,"
    )
}

impl Rig {
    /// The east parts of the setpoints that went to PX4.
    pub(crate) fn sent_east(&mut self) -> Vec<f64> {
        let sent = self.memory.sent.take();
        let one = |(key, payload): (String, Vec<u8>)| {
            let key = keys::read(&key, 0).expect("a key of PX4");
            let definition = self.definitions.of(key.topic, key.hash).expect("a known version");
            Record::decode(definition, &payload).expect("a whole message").number_at("position", 1).ok()
        };
        sent.into_iter().filter_map(one).collect()
    }
}
