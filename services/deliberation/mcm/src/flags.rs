//! Which flags are up. Events raise them; only their contingency row takes them down again.

use std::collections::{BTreeMap, BTreeSet};
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
    /// Who says that it still holds.
    sources: BTreeSet<String>,
    /// Who has seen it.
    pub(crate) acknowledged_by: Option<String>,
}

impl Flag {
    /// Whether anybody who raised it says that it still holds.
    pub(crate) fn holds(&self) -> bool {
        !self.sources.is_empty()
    }

    /// Who says that it still holds.
    pub(crate) fn sources(&self) -> impl Iterator<Item = &str> {
        self.sources.iter().map(String::as_str)
    }
}

impl Flags {
    /// Raises a flag; true if it was down.
    pub(crate) fn raise(&mut self, now: Time, name: &str, source: &str, reason: &str) -> bool {
        let rose = !self.up.contains_key(name);
        let fresh = || Flag { since: now, reason: reason.to_owned(), sources: BTreeSet::new(), acknowledged_by: None };
        self.up.entry(name.to_owned()).or_insert_with(fresh).sources.insert(source.to_owned());
        rose
    }

    /// What raised the flag is gone, says `source`; the flag itself stays up until its row says otherwise.
    pub(crate) fn condition_gone(&mut self, name: &str, source: &str) {
        if let Some(flag) = self.up.get_mut(name) {
            flag.sources.remove(source);
        }
    }

    /// Somebody has seen the flag.
    pub(crate) fn acknowledge(&mut self, name: &str, by: &str) {
        if let Some(flag) = self.up.get_mut(name) {
            flag.acknowledged_by = Some(by.to_owned());
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
