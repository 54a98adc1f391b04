//! How missions are recorded.

use std::collections::BTreeMap;
use std::num::NonZeroU32;
use std::path::PathBuf;

use domain::quantity::Positive;
use kittiwake_proto::topics::Topic;
use serde::Deserialize;

/// The section `[gateway.recording]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// The folder of the recordings, relative to the configuration file's. Absent: the folder that the
    /// command line names, or none.
    pub folder: Option<PathBuf>,
    /// Recordings kept; the oldest is removed when there are more. Zero records nothing.
    pub most_files: u32,
    /// Megabytes of all recordings together; the oldest is removed when they take more.
    pub most_total_mb: NonZeroU32,
    /// Megabytes of one recording; messages beyond that are dropped.
    pub most_each_mb: NonZeroU32,
    /// Wall seconds for which messages are collected before they are written together; a gateway that is killed loses
    /// the messages of that time.
    pub flush_s: Positive,
    /// Messages recorded per second of wall time, by topic key; of a topic that is not named, all.
    pub most_hz: BTreeMap<TopicKey, Positive>,
    /// Files that each recording holds, name and text: what was flown, as the gateway has it.
    #[serde(skip)]
    pub attached: Vec<(String, String)>,
}

/// A topic, written as its key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(try_from = "String")]
pub struct TopicKey(pub Topic);

impl TryFrom<String> for TopicKey {
    type Error = String;
    fn try_from(key: String) -> Result<TopicKey, String> {
        Topic::ALL.iter().find(|it| it.key() == key).map(|it| TopicKey(*it)).ok_or_else(|| {
            format!("found topic `{key}`, expected one that is published, such as `{}`", Topic::Introspection.key())
        })
    }
}

/// How much may be recorded, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Limits {
    /// Number of recordings.
    pub(crate) files: usize,
    /// All of them together.
    pub(crate) total: u64,
    /// One of them.
    pub(crate) each: u64,
}

impl Config {
    /// The limits in bytes.
    pub(crate) fn limits(&self) -> Limits {
        let bytes = |mb: NonZeroU32| u64::from(mb.get()) * 1024 * 1024;
        Limits {
            files: usize::try_from(self.most_files).unwrap_or(usize::MAX),
            total: bytes(self.most_total_mb),
            each: bytes(self.most_each_mb),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_topic_that_is_not_published_is_a_mistake() {
        let text = |key: &str| {
            format!("most_files = 1\nmost_total_mb = 2\nmost_each_mb = 1\nflush_s = 1.0\n[most_hz]\n\"{key}\" = 5.0")
        };
        let config: Config = toml::from_str(&text("monitor/introspection")).unwrap();
        assert_eq!(config.most_hz[&TopicKey(Topic::Introspection)].get(), 5.0);
        assert_eq!(config.limits(), Limits { files: 1, total: 2 << 20, each: 1 << 20 });
        let error = toml::from_str::<Config>(&text("monitor/introspecton")).unwrap_err().to_string();
        assert!(error.contains("found topic `monitor/introspecton`"), "{error}");
    }
}
