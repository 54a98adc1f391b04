//! Tells the second copy of a message from the first, where messages come both directly and by the router.
//!
//! The rule: a copy is the same in everything that a sender decides (key, publisher, number, content) as one of the last
//! [`REMEMBERED`] messages with that key. Nothing else is a copy, so that nobody can silence a sender by speaking in its name:
//! a number that jumps ahead proves nothing about the age of the numbers before it, and a message that claims the number of
//! another does not take its place. An impostor can at most flood: then a copy under way is forgotten and handled as a
//! new message. Who may speak with a key is for the folder of the sockets, and on the link for certificates.
//!
//! A sender never repeats itself: each start of a process is another publisher, and counts from one.

use std::collections::{HashMap, VecDeque};
use std::hash::{BuildHasher, RandomState};
use std::sync::{Arc, Mutex};

use kittiwake_proto::v1::Attachment;

/// Messages of a key that are remembered: minutes of events, while a copy is late by seconds at most.
const REMEMBERED: usize = 256;

/// Keys that are remembered: those of some fifty vehicles. With more, the one that was silent for longest is forgotten.
const MOST_KEYS: usize = 1024;

/// The filter of a process, shared by its subscriptions.
#[derive(Clone, Default)]
pub(crate) struct DuplicateFilter(Arc<Mutex<Heard>>);

#[derive(Default)]
struct Heard {
    /// Its seeds differ at each start, so that nobody can make two messages that look the same.
    hasher: RandomState,
    keys: HashMap<String, Recent>,
    /// Counts messages.
    now: u64,
}

/// The last messages of a key, as hashes, the oldest first.
#[derive(Default)]
struct Recent {
    messages: VecDeque<u64>,
    last: u64,
}

impl DuplicateFilter {
    /// Whether this message has not been here before. A publisher without direct links has no number, and no copies.
    pub(crate) fn is_first(&self, key: &str, attachment: &Attachment, payload: &[u8]) -> bool {
        if attachment.publisher == 0 {
            return true;
        }
        let mut heard = self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let message = heard.hasher.hash_one((key, attachment.publisher, attachment.sequence, payload));
        heard.now += 1;
        let now = heard.now;
        if !heard.keys.contains_key(key) {
            heard.make_room();
            heard.keys.insert(key.to_owned(), Recent::default());
        }
        heard.keys.get_mut(key).is_none_or(|it| it.take(message, now))
    }
}

impl Heard {
    fn make_room(&mut self) {
        if self.keys.len() < MOST_KEYS {
            return;
        }
        let oldest = self.keys.iter().min_by_key(|(_, it)| it.last).map(|(key, _)| key.clone());
        if let Some(key) = oldest {
            self.keys.remove(&key);
        }
    }
}

impl Recent {
    fn take(&mut self, message: u64, now: u64) -> bool {
        self.last = now;
        // Mostly the one that came last.
        if self.messages.iter().rev().any(|it| *it == message) {
            return false;
        }
        if self.messages.len() == REMEMBERED {
            self.messages.pop_front();
        }
        self.messages.push_back(message);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const KEY: &str = "kw/uav1/monitor/flag";

    fn stamp(publisher: u64, sequence: u64) -> Attachment {
        Attachment { publisher, sequence, ..Attachment::default() }
    }

    #[test]
    fn each_message_counts_once_whichever_way_it_comes_first() {
        #[track_caller]
        fn check(sequences: &[u64], expected: &[bool]) {
            let filter = DuplicateFilter::default();
            let first: Vec<bool> = sequences.iter().map(|it| filter.is_first(KEY, &stamp(7, *it), b"it")).collect();
            assert_eq!(first, expected);
        }
        check(&[1, 1, 2, 2], &[true, false, true, false]);
        // Lost on the direct link, and overtaken by the one after it.
        check(&[1, 3, 1, 2, 3, 2], &[true, true, false, true, false, false]);
        // A jump proves nothing about age.
        check(&[1, u64::MAX, 2, 1, 3, 2], &[true, true, true, false, true, false]);
    }

    #[test]
    fn what_differs_in_anything_is_no_copy() {
        let filter = DuplicateFilter::default();
        for (key, publisher, sequence, payload) in [
            (KEY, 7, 1, "a"),
            (KEY, 8, 1, "a"),
            (KEY, 7, 2, "a"),
            (KEY, 7, 1, "b"),
            ("kw/uav2/monitor/flag", 7, 1, "a"),
        ] {
            assert!(filter.is_first(key, &stamp(publisher, sequence), payload.as_bytes()));
            assert!(!filter.is_first(key, &stamp(publisher, sequence), payload.as_bytes()));
        }
        assert!(filter.is_first(KEY, &stamp(0, 1), b"a") && filter.is_first(KEY, &stamp(0, 1), b"a"));
    }

    #[test]
    fn the_memory_has_a_bound_and_loses_the_most_silent_key_first() {
        let filter = DuplicateFilter::default();
        assert!(filter.is_first(KEY, &stamp(7, 1), b"it"));
        for number in 0..2 * MOST_KEYS as u64 {
            assert!(filter.is_first(&format!("kw/other{number}/monitor/flag"), &stamp(7, 1), b"it"));
            assert!(!filter.is_first(KEY, &stamp(7, 1), b"it"), "it was heard just now");
        }
        assert_eq!(filter.0.lock().unwrap().keys.len(), MOST_KEYS);
    }

    /// What comes in between two messages of the true sender: anything in its name.
    fn forged() -> impl Strategy<Value = Vec<(u64, u64, u8)>> {
        prop::collection::vec((6..9u64, prop_oneof![0..60u64, any::<u64>()], any::<u8>()), 0..400)
    }

    proptest! {
        /// However much is forged, nothing of the true sender is lost.
        #[test]
        fn nobody_is_silenced(forged in prop::collection::vec(forged(), 1..20)) {
            let filter = DuplicateFilter::default();
            for (number, forged) in forged.iter().enumerate() {
                for (publisher, sequence, content) in forged {
                    filter.is_first(KEY, &stamp(*publisher, *sequence), &[*content]);
                }
                prop_assert!(filter.is_first(KEY, &stamp(7, number as u64), b"true"));
            }
        }

        /// Copies are known in any order, and beside anything that leaves them room in the memory.
        #[test]
        fn every_copy_is_known(order in Just((0..100u64).collect::<Vec<_>>()).prop_shuffle(), noise in any::<[u64; 100]>()) {
            let filter = DuplicateFilter::default();
            for number in 0..100 {
                prop_assert!(filter.is_first(KEY, &stamp(7, number), b"it"));
            }
            for (number, noise) in order.into_iter().zip(noise) {
                filter.is_first(KEY, &stamp(8, noise), b"noise");
                prop_assert!(!filter.is_first(KEY, &stamp(7, number), b"it"));
            }
        }
    }
}
