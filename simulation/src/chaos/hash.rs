//! The hash of what was decided and when: two runs with one hash are one run.

use std::fmt;

use domain::time::Time;
use sha2::{Digest, Sha256};

/// SHA-256 of a decision log, or of the hashes of several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct LogHash([u8; 32]);

impl LogHash {
    /// Of the decisions in their order: for each its virtual time in nanoseconds (16 bytes, most significant first), its topic and
    /// its text, each with its length before it (8 bytes). No number is rounded, and none is written as text here.
    pub fn of<'a>(decisions: impl IntoIterator<Item = (Time, &'a str, &'a str)>) -> LogHash {
        let mut hash = Sha256::new();
        for (at, topic, text) in decisions {
            hash.update(at.since_start().as_nanos().to_be_bytes());
            for part in [topic, text] {
                hash.update((part.len() as u64).to_be_bytes());
                hash.update(part.as_bytes());
            }
        }
        LogHash(hash.finalize().into())
    }

    /// Of several runs, in their order.
    pub fn of_all(runs: impl IntoIterator<Item = LogHash>) -> LogHash {
        let mut hash = Sha256::new();
        runs.into_iter().for_each(|run| hash.update(run.0));
        LogHash(hash.finalize().into())
    }
}

/// As hexadecimal digits.
impl fmt::Display for LogHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn every_time_topic_and_text_counts_and_so_does_their_order() {
        let at = |ms| Time::after(Duration::from_millis(ms));
        let log = [(at(1), "plan", "plan 1"), (at(2), "step", "step 1")];
        let hash = LogHash::of(log);
        assert_eq!(hash, LogHash::of(log));
        for other in [
            vec![],
            vec![log[0]],
            vec![log[1], log[0]],
            vec![(at(2), "plan", "plan 1"), log[1]],
            vec![(at(1), "pla", "nplan 1"), log[1]],
            vec![log[0], (at(2), "step", "step 2")],
        ] {
            assert_ne!(hash, LogHash::of(other.clone()), "{other:?}");
        }
        let empty = LogHash::of([]);
        assert_ne!(LogHash::of_all([hash, empty]), LogHash::of_all([empty, hash]));
    }

    #[test]
    fn the_hash_of_nothing_is_that_of_the_standard() {
        let expected = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
        assert_eq!(LogHash::of([]).to_string(), expected);
    }
}
