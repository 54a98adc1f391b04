//! Direct links between processes of one machine, beside the router: a command, an event or a request
//! need not wake a third process on its way.
//!
//! What goes directly goes through the router as well, and the receiver takes whichever comes first: a
//! direct link that is not there yet, or breaks, costs time and never a message. So no process depends on
//! another one's socket, and the two also stand in for each other: what is linked directly keeps working
//! while the router is being restarted. Telemetry goes through the router alone, since it is for many.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use kittiwake_proto::topics::Topic;
use zenoh::Session;

use crate::session::{config, open_with, set};
use crate::{BusError, Scope};

/// The direct links of a process: Unix sockets in a folder that all of them know.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Direct {
    /// The folder of the sockets. A path of 80 characters is safe; the operating system takes 107 with the name.
    pub folder: PathBuf,
    /// The process's own socket: who calls it here.
    pub listen: Option<String>,
    /// Whom it calls, in the background and for ever: they need not be there.
    pub connect: Vec<String>,
}

/// Opens the session of the direct links. It waits for nobody.
pub(crate) fn open(direct: &Direct, scope: &Scope) -> Result<Session, BusError> {
    let socket = |name: &String| format!("\"unixsock-stream/{}/{name}.sock\"", direct.folder.display());
    let sockets = |names: &[String]| format!("[{}]", names.iter().map(socket).collect::<Vec<_>>().join(","));
    let mut config = config("peer")?;
    set(&mut config, "listen/endpoints", &sockets(direct.listen.as_slice()))?;
    set(&mut config, "connect/endpoints", &sockets(&direct.connect))?;
    set(&mut config, "connect/exit_on_failure", "false")?;
    set(&mut config, "scouting/delay", "0")?;
    open_with(config, scope).map_err(|cause| BusError::Listen { locators: direct.folder.display().to_string(), cause })
}

/// Tells the second copy of a message from the first.
#[derive(Clone, Default)]
pub(crate) struct DuplicateFilter(Arc<Mutex<HashMap<(u64, Topic), Window>>>);

/// Publishers come and go with their processes; when this many have been heard, all are forgotten, and the copy of a
/// message that is just then under way passes for a new one.
const MOST_REMEMBERED: usize = 256;

/// The last 64 messages of a publisher on a topic.
#[derive(Clone, Copy)]
struct Window {
    newest: u64,
    /// Bit n: whether the message n before the newest was seen.
    seen: u64,
}

impl DuplicateFilter {
    /// Whether this message has not been here before. A publisher without direct links has no number, and no copies.
    pub(crate) fn is_first(&self, publisher: u64, topic: Topic, sequence: u64) -> bool {
        if publisher == 0 {
            return true;
        }
        let mut heard = self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if MOST_REMEMBERED <= heard.len() && !heard.contains_key(&(publisher, topic)) {
            heard.clear();
        }
        heard.entry((publisher, topic)).or_insert(Window { newest: 0, seen: 0 }).take(sequence)
    }
}

impl Window {
    fn take(&mut self, sequence: u64) -> bool {
        if self.newest < sequence {
            self.seen = self.seen.checked_shl((sequence - self.newest).min(64) as u32).unwrap_or(0) | 1;
            self.newest = sequence;
            return true;
        }
        let before = self.newest - sequence;
        // So late that it can only be a copy.
        if 64 <= before {
            return false;
        }
        let bit = 1u64 << before;
        let first = self.seen & bit == 0;
        self.seen |= bit;
        first
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_message_counts_once_whichever_way_it_comes_first() {
        #[track_caller]
        fn check(sequences: &[u64], expected: &[bool]) {
            let duplicates = DuplicateFilter::default();
            let first: Vec<bool> = sequences.iter().map(|it| duplicates.is_first(7, Topic::FlagEvent, *it)).collect();
            assert_eq!(first, expected);
        }
        check(&[1, 1, 2, 2], &[true, false, true, false]);
        // Lost on the direct link, and overtaken by the one after it.
        check(&[1, 3, 1, 2, 3, 2], &[true, true, false, true, false, false]);
        check(&[1, 100, 1, 37, 36, 37], &[true, true, false, true, false, false]);
        check(&[200, 200], &[true, false]);
    }

    #[test]
    fn publishers_and_topics_count_for_themselves() {
        let duplicates = DuplicateFilter::default();
        assert!(duplicates.is_first(7, Topic::FlagEvent, 1));
        assert!(duplicates.is_first(8, Topic::FlagEvent, 1));
        assert!(duplicates.is_first(7, Topic::SkillEvent, 1));
        assert!(duplicates.is_first(0, Topic::FlagEvent, 1) && duplicates.is_first(0, Topic::FlagEvent, 1));
    }
}
