//! Flags that have no row in the contingency table. Anybody on the bus can send any number of them, so each name is recorded
//! once and no more than a few names are: a flood must not push the decisions out of the journal and the recording.

use std::collections::BTreeSet;

/// Names that are recorded one by one: a table and a monitor that do not belong together differ by fewer.
const MOST_NAMES: usize = 16;
/// Characters of a name that are recorded.
const MOST_CHARACTERS: usize = 64;

/// The names that were recorded since the start of the process.
#[derive(Debug, Default)]
pub(super) struct UnknownFlags {
    names: BTreeSet<String>,
    /// There were more names than are recorded.
    overflowed: bool,
}

impl UnknownFlags {
    /// A flag of this name was raised; returns what is to be recorded about it, if anything.
    pub(super) fn meet(&mut self, name: &str) -> Option<String> {
        let name = shortened(name);
        if self.names.contains(&name) {
            return None;
        }
        if self.names.len() < MOST_NAMES {
            let text = format!("flag `{name}` has no row in the table: not acted on");
            self.names.insert(name);
            return Some(text);
        }
        let is_first = !std::mem::replace(&mut self.overflowed, true);
        is_first
            .then(|| format!("more than {MOST_NAMES} flags have no row in the table: further ones are only counted"))
    }
}

/// The beginning of a name, which may be as long as a message.
pub(super) fn shortened(name: &str) -> String {
    name.chars().take(MOST_CHARACTERS).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_name_is_recorded_once_and_a_flood_of_names_ends_in_one_more_record() {
        let mut unknown = UnknownFlags::default();
        let flood = (0..10_000).map(|it| format!("unheard_of_{}", it % 1000));
        let recorded: Vec<String> = flood.filter_map(|name| unknown.meet(&name)).collect();
        assert_eq!(recorded.len(), MOST_NAMES + 1, "{recorded:?}");
        assert!(recorded[0].contains("`unheard_of_0` has no row"), "{}", recorded[0]);
        assert!(recorded[MOST_NAMES].contains("only counted"), "{}", recorded[MOST_NAMES]);
    }

    #[test]
    fn a_name_as_long_as_a_message_is_cut() {
        let text = UnknownFlags::default().meet(&"ä".repeat(100_000)).expect("it is new");
        assert!(text.len() < 4 * MOST_CHARACTERS, "{} bytes", text.len());
    }
}
