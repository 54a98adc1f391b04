//! Which flags are up, from the events that raise and clear them and from the lists of the monitor and the
//! mission manager.
//!
//! The monitor's list decides about the monitor's flags, so that an event lost with a process leaves no flag up. An
//! injected flag is listed by the mission manager only: it is down when the manager has listed it before and does not
//! list it any more.

use std::collections::BTreeMap;

use domain::time::Time;
use kittiwake_proto::v1;
use kittiwake_proto::v1::vehicle::Flag;

/// More flags than the contingency table has rows; an injector could make up any number of names.
const MAX_FLAGS: usize = 256;
/// The monitor as the source of an event.
const MONITOR: &str = "monitor";

/// The flags of one vehicle.
#[derive(Debug, Clone, Default)]
pub(crate) struct Flags {
    /// The flags that the monitor lists.
    listed: Vec<v1::RaisedFlag>,
    listed_at: Option<Time>,
    /// Flags raised by an event, about which no list has decided yet.
    raised: BTreeMap<String, Raised>,
}

#[derive(Debug, Clone)]
struct Raised {
    at: Time,
    event: v1::FlagEvent,
    /// Whether the mission manager has listed it.
    taken_up: bool,
}

impl Flags {
    /// A flag was raised or cleared.
    pub(crate) fn on_event(&mut self, now: Time, event: &v1::FlagEvent) {
        if !event.raised {
            self.raised.remove(&event.name);
        } else if self.raised.len() < MAX_FLAGS || self.raised.contains_key(&event.name) {
            self.raised.insert(event.name.clone(), Raised { at: now, event: event.clone(), taken_up: false });
        }
    }

    /// The monitor lists the flags that are up.
    pub(crate) fn on_listed(&mut self, now: Time, flags: &[v1::RaisedFlag]) {
        self.listed.clear();
        self.listed.extend_from_slice(flags);
        self.listed_at = Some(now);
        self.raised.retain(|_, flag| flag.event.source != MONITOR);
    }

    /// The mission manager lists its active contingencies.
    pub(crate) fn on_contingencies(&mut self, contingencies: &[v1::ActiveContingency]) {
        self.raised.retain(|name, flag| {
            let listed = contingencies.iter().any(|contingency| contingency.flag == *name);
            let dropped = flag.taken_up && !listed;
            flag.taken_up |= listed;
            !dropped
        });
    }

    /// The flags that are up at `now`, each once.
    pub(crate) fn up(&self, now: Time) -> Vec<Flag> {
        let listed_for_s = self.listed_at.map_or(0.0, |at| (now - at).as_secs_f64());
        let listed = self.listed.iter().map(|flag| Flag {
            name: flag.name.clone(),
            since_s: flag.since_s + listed_for_s,
            reason: flag.reason.clone(),
            source: MONITOR.to_owned(),
        });
        let is_listed = |name: &str| self.listed.iter().any(|flag| flag.name == name);
        let raised = self.raised.values().filter(|flag| !is_listed(&flag.event.name)).map(|flag| Flag {
            name: flag.event.name.clone(),
            since_s: (now - flag.at).as_secs_f64(),
            reason: flag.event.reason.clone(),
            source: flag.event.source.clone(),
        });
        listed.chain(raised).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    enum Sign {
        /// Raised by this source.
        Raised(&'static str),
        Cleared(&'static str),
        /// Whether the monitor lists it.
        Listed(bool),
        /// Whether the mission manager lists it.
        TakenUp(bool),
    }
    use Sign::{Cleared, Listed, Raised, TakenUp};

    /// Applies events and lists about one flag, and compares whether it is up afterwards.
    #[track_caller]
    fn check(signs: &[Sign], expected: bool) {
        let mut flags = Flags::default();
        let name = || "wind".to_string();
        for sign in signs {
            match sign {
                Raised(source) | Cleared(source) => {
                    let (source, raised) = (source.to_string(), matches!(sign, Raised(_)));
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
        check(&[Raised("monitor")], true);
        check(&[Raised("monitor"), Cleared("monitor")], false);
        check(&[Raised("monitor"), Listed(true)], true);
        check(&[Raised("monitor"), Listed(false)], false);
        check(&[Listed(true), Listed(false)], false);
    }

    #[test]
    fn an_injected_flag_is_up_until_it_is_cleared_or_dealt_with() {
        check(&[Raised("injector"), Listed(false)], true);
        check(&[Raised("injector"), Cleared("injector")], false);
        check(&[Raised("injector"), TakenUp(false)], true);
        check(&[Raised("injector"), TakenUp(true)], true);
        check(&[Raised("injector"), TakenUp(true), TakenUp(false)], false);
    }

    #[test]
    fn names_from_the_network_do_not_fill_the_memory() {
        let mut flags = Flags::default();
        for n in 0..2 * MAX_FLAGS {
            let event = v1::FlagEvent { name: n.to_string(), raised: true, ..Default::default() };
            flags.on_event(Time::ZERO, &event);
        }
        assert_eq!(flags.up(Time::ZERO).len(), MAX_FLAGS);
    }
}
