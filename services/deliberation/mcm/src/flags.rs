//! Which flags are up. Events raise them; only their contingency row takes them down again.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::time::Time;

/// The flags by name.
#[derive(Debug, Default)]
pub(crate) struct Flags {
    up: BTreeMap<String, Flag>,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Flag {
    pub(crate) since: Time,
    pub(crate) reason: String,
    /// Whether whoever raised it says that it still holds.
    pub(crate) holds: bool,
}

impl Flags {
    /// Raises a flag; true if it was down.
    pub(crate) fn raise(&mut self, now: Time, name: &str, reason: &str) -> bool {
        if let Some(flag) = self.up.get_mut(name) {
            flag.holds = true;
            return false;
        }
        self.up.insert(name.to_owned(), Flag { since: now, reason: reason.to_owned(), holds: true });
        true
    }

    /// What raised the flag is gone; the flag itself stays up until its row says otherwise.
    pub(crate) fn condition_gone(&mut self, name: &str) {
        if let Some(flag) = self.up.get_mut(name) {
            flag.holds = false;
        }
    }

    /// Takes a flag down.
    pub(crate) fn lower(&mut self, name: &str) {
        self.up.remove(name);
    }

    pub(crate) fn get(&self, name: &str) -> Option<&Flag> {
        self.up.get(name)
    }

    pub(crate) fn is_up(&self, name: &str) -> bool {
        self.up.contains_key(name)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (&str, &Flag)> {
        self.up.iter().map(|(name, flag)| (name.as_str(), flag))
    }
}

/// How long the flag has been up, in seconds.
pub(crate) fn age_s(flag: &Flag, now: Time) -> f64 {
    let age: Duration = now - flag.since;
    age.as_secs_f64()
}
