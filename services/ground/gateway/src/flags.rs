//! Which flags are up, from the events that tell of their rise and fall and from what the monitor
//! and the mission manager list.
//!
//! The monitor's list is the truth about the monitor's flags, so that an event lost with a process
//! leaves no flag standing. An injected flag has nobody who lists it but the mission manager: once
//! that has taken it up and dropped it again, it is down.

use std::collections::BTreeMap;

use domain::time::Time;
use kittiwake_proto::v1;

/// More flags than the contingency table has rows; an injector could make up any number of names.
const MOST_FLAGS: usize = 256;
/// What the monitor calls itself in the events it sends.
const MONITOR: &str = "monitor";

/// The flags of one vehicle.
#[derive(Debug, Clone, Default)]
pub struct Flags {
    listed: Vec<v1::RaisedFlag>,
    listed_at: Option<Time>,
    told: BTreeMap<String, Told>,
}

#[derive(Debug, Clone)]
struct Told {
    at: Time,
    event: v1::FlagEvent,
    /// Whether the mission manager has listed it.
    taken_up: bool,
}

/// A flag that is up.
#[derive(Debug, Clone, PartialEq)]
pub struct Flag<'a> {
    /// Its name.
    pub name: &'a str,
    /// Mission seconds since it rose.
    pub since_s: f64,
    /// The value and its threshold in words.
    pub reason: &'a str,
    /// Who says so.
    pub source: &'a str,
}

impl Flags {
    /// A flag rose or fell.
    pub fn on_event(&mut self, now: Time, event: &v1::FlagEvent) {
        if !event.raised {
            self.told.remove(&event.name);
        } else if self.told.len() < MOST_FLAGS || self.told.contains_key(&event.name) {
            self.told.insert(event.name.clone(), Told { at: now, event: event.clone(), taken_up: false });
        }
    }

    /// The monitor lists the flags that are up.
    pub fn on_listed(&mut self, now: Time, flags: &[v1::RaisedFlag]) {
        self.listed.clear();
        self.listed.extend_from_slice(flags);
        self.listed_at = Some(now);
        self.told.retain(|_, it| it.event.source != MONITOR);
    }

    /// The mission manager lists the contingencies it has taken up.
    pub fn on_contingencies(&mut self, contingencies: &[v1::ActiveContingency]) {
        self.told.retain(|name, told| {
            let listed = contingencies.iter().any(|it| it.flag == *name);
            let dropped = told.taken_up && !listed;
            told.taken_up |= listed;
            !dropped
        });
    }

    /// The flags that are up at `now`, each once.
    pub fn up(&self, now: Time) -> Vec<Flag<'_>> {
        let listed_for_s = self.listed_at.map_or(0.0, |at| (now - at).as_secs_f64());
        let listed = self.listed.iter().map(|it| Flag {
            name: &it.name,
            since_s: it.since_s + listed_for_s,
            reason: &it.reason,
            source: MONITOR,
        });
        let told = self.told.values().filter(|it| self.listed.iter().all(|listed| listed.name != it.event.name));
        let told = told.map(|it| Flag {
            name: &it.event.name,
            since_s: (now - it.at).as_secs_f64(),
            reason: &it.event.reason,
            source: &it.event.source,
        });
        listed.chain(told).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    enum News {
        /// By its source.
        Rose(&'static str),
        Fell(&'static str),
        Listed(bool),
        TakenUp(bool),
    }
    use News::{Fell, Listed, Rose, TakenUp};

    /// Plays the news of one flag and asks whether it is up.
    #[track_caller]
    fn check(news: &[News], expected: bool) {
        let mut flags = Flags::default();
        let name = || "wind".to_string();
        for it in news {
            match it {
                Rose(source) | Fell(source) => {
                    let (source, raised) = (source.to_string(), matches!(it, Rose(_)));
                    flags.on_event(Time::ZERO, &v1::FlagEvent { name: name(), raised, source, ..Default::default() });
                }
                Listed(up) => {
                    let flag = v1::RaisedFlag { name: name(), ..Default::default() };
                    flags.on_listed(Time::ZERO, if *up { std::slice::from_ref(&flag) } else { &[] });
                }
                TakenUp(up) => {
                    let contingency = v1::ActiveContingency { flag: name(), ..Default::default() };
                    flags.on_contingencies(if *up { std::slice::from_ref(&contingency) } else { &[] });
                }
            }
        }
        assert_eq!(flags.up(Time::ZERO).len(), usize::from(expected));
    }

    #[test]
    fn the_monitors_flags_follow_its_list() {
        check(&[Rose("monitor")], true);
        check(&[Rose("monitor"), Fell("monitor")], false);
        check(&[Rose("monitor"), Listed(true)], true);
        check(&[Rose("monitor"), Listed(false)], false);
        check(&[Listed(true), Listed(false)], false);
    }

    #[test]
    fn an_injected_flag_is_up_until_it_is_lowered_or_dealt_with() {
        check(&[Rose("injector"), Listed(false)], true);
        check(&[Rose("injector"), Fell("injector")], false);
        check(&[Rose("injector"), TakenUp(false)], true);
        check(&[Rose("injector"), TakenUp(true)], true);
        check(&[Rose("injector"), TakenUp(true), TakenUp(false)], false);
    }

    #[test]
    fn made_up_names_do_not_fill_the_memory() {
        let mut flags = Flags::default();
        for n in 0..2 * MOST_FLAGS {
            let event = v1::FlagEvent { name: n.to_string(), raised: true, ..Default::default() };
            flags.on_event(Time::ZERO, &event);
        }
        assert_eq!(flags.up(Time::ZERO).len(), MOST_FLAGS);
    }
}
