//! What is heard of PX4: which topics, how recently, in which versions, and which it listens to.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::time::Time;

use crate::cdr::{Definition, Definitions};
use crate::keys::{self, Px4Key};

/// Without these nothing flies.
pub(crate) const NEEDED: [&str; 6] = [
    "vehicle_status",
    "vehicle_local_position",
    "vehicle_attitude",
    "vehicle_land_detected",
    "battery_status",
    "failsafe_flags",
];
/// What PX4 must listen to.
pub(crate) const INPUTS: [&str; 3] = ["vehicle_command", "offboard_control_mode", "trajectory_setpoint"];

/// Where the target of a landing is.
const TARGET: &str = "landing_target_pose";

/// What was heard, and what PX4 listens to.
#[derive(Debug)]
pub(crate) struct Watch {
    definitions: Definitions,
    domain: u8,
    silent_after: Duration,
    heard: BTreeMap<&'static str, Time>,
    /// Versions that are not known, by topic.
    unknown: BTreeMap<String, String>,
    /// What PX4 listens to: topic to type and hash, from its tokens.
    inputs: BTreeMap<String, (String, String)>,
    /// It sends where the target of a landing is, once there is one: by default it does not.
    pub(crate) sends_target: bool,
}

impl Watch {
    /// Nothing is heard yet.
    pub(crate) fn new(definitions: Definitions, domain: u8, silent_after: Duration) -> Watch {
        let (heard, unknown, inputs) = Default::default();
        Watch { definitions, domain, silent_after, heard, unknown, inputs, sends_target: false }
    }

    /// The definition for a sample.
    ///
    /// # Errors
    /// If its version is not known: why, the first time; for a topic that nobody here reads, nothing.
    pub(crate) fn definition(&mut self, key: &Px4Key<'_>) -> Result<Definition, Option<String>> {
        match self.definitions.of(key.topic, key.hash).cloned() {
            Some(definition) => {
                self.unknown.remove(key.topic);
                Ok(definition)
            }
            None if self.definitions.newest(key.topic).is_none() => Err(None),
            None => Err(self.unknown_version(key)),
        }
    }

    /// A sample of this topic was understood.
    pub(crate) fn heard(&mut self, topic: &str, now: Time) {
        if let Some(topic) = NEEDED.into_iter().find(|it| *it == topic) {
            self.heard.insert(topic, now);
        }
    }

    /// A token of PX4 appeared or vanished; says, once, that a version is not known.
    pub(crate) fn token(&mut self, key: &Px4Key<'_>, alive: bool) -> Option<String> {
        if key.is_output && key.topic == TARGET {
            self.sends_target = alive;
        }
        if key.is_output || !INPUTS.contains(&key.topic) {
            return None;
        }
        if !alive {
            self.inputs.remove(key.topic);
            return None;
        }
        self.inputs.insert(key.topic.to_owned(), (key.type_name.to_owned(), key.hash.to_owned()));
        match self.definitions.of(key.topic, key.hash) {
            Some(_) => {
                self.unknown.remove(key.topic);
                None
            }
            None => self.unknown_version(key),
        }
    }

    /// PX4 was started again: what was heard before says nothing.
    pub(crate) fn restarted(&mut self) {
        self.heard.clear();
    }

    /// Whether anything is heard of PX4.
    pub(crate) fn is_there(&self, now: Time) -> bool {
        self.heard.get("vehicle_status").is_some_and(|at| now - *at <= self.silent_after)
    }

    /// Key and definition of an input.
    ///
    /// # Errors
    /// Why PX4 cannot be told, in words.
    pub(crate) fn input(&self, topic: &str) -> Result<(String, &Definition), String> {
        if let Some(why) = self.unknown.get(topic) {
            return Err(why.clone());
        }
        let (type_name, hash) = self.inputs.get(topic).ok_or_else(|| format!("PX4 does not listen to `{topic}`"))?;
        let definition = self
            .definitions
            .of(topic, hash)
            .ok_or_else(|| format!("PX4 listens to `{topic}` in an unknown version"))?;
        Ok((keys::input(self.domain, topic, type_name, hash), definition))
    }

    /// What is missing that a flight needs, in words; `None`: nothing.
    pub(crate) fn lack(&self, now: Time) -> Option<String> {
        for topic in NEEDED {
            if let Some(why) = self.unknown.get(topic) {
                return Some(why.clone());
            }
            match self.heard.get(topic) {
                None => return Some(format!("PX4 sends no `{topic}`")),
                Some(at) if self.silent_after < now - *at => {
                    return Some(format!("PX4 has not sent `{topic}` for {:.1} s", (now - *at).as_secs_f64()));
                }
                Some(_) => {}
            }
        }
        INPUTS.into_iter().find_map(|it| self.input(it).err())
    }

    fn unknown_version(&mut self, key: &Px4Key<'_>) -> Option<String> {
        let expected = self.definitions.newest(key.topic)?;
        let why = if key.hash.len() == expected.hash.len() {
            format!(
                "PX4 speaks a version of `{}` that is not known: {} with hash {}, expected {}; docs/px4.md lists the versions",
                key.topic,
                key.type_name,
                short(key.hash),
                short(&expected.hash)
            )
        } else {
            format!(
                "PX4 says no version of `{}`: found `{}`; build it with CONFIG_ZENOH_KEY_TYPE_HASH=y",
                key.topic, key.hash
            )
        };
        let before = self.unknown.insert(key.topic.to_owned(), why.clone());
        (before.as_ref() != Some(&why)).then_some(why)
    }
}

/// Enough of a hash to tell versions apart.
fn short(hash: &str) -> &str {
    hash.get(..12).unwrap_or(hash)
}
