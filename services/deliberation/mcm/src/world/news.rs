//! Messages of the monitor that the monitor leaf has not taken in yet.

use std::collections::BTreeSet;

use crate::vehicle::Vehicle;

/// The source of the introspection's flags.
pub(super) const MONITOR: &str = "monitor";

/// A flag was raised, or its condition no longer holds, by this source.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FlagNews {
    pub(super) name: String,
    pub(super) raised: bool,
    pub(super) source: String,
    pub(super) reason: String,
}

/// What came in.
#[derive(Debug, Default)]
pub(super) struct News {
    vehicle: Option<Vehicle>,
    flags: Vec<FlagNews>,
    /// The flags that the last introspection listed.
    listed: BTreeSet<String>,
}

impl News {
    /// The vehicle of an introspection; it replaces an older one.
    pub(super) fn add_vehicle(&mut self, vehicle: Vehicle) {
        self.vehicle = Some(vehicle);
    }

    /// An event of a single flag.
    pub(super) fn add_flag(&mut self, flag: FlagNews) {
        self.flags.push(flag);
    }

    /// Counts a flag as one that the last introspection listed.
    pub(super) fn expect(&mut self, name: &str) {
        self.listed.insert(name.to_owned());
    }

    /// Takes in the flags that an introspection lists, each with its reason. A difference to the list before counts as
    /// an event: the event itself may have been lost, or sent while this process or the monitor was down.
    pub(super) fn list(&mut self, flags: Vec<(String, String)>) {
        let listed: BTreeSet<String> = flags.iter().map(|(name, _)| name.clone()).collect();
        let news = |name: String, raised, reason| FlagNews { name, raised, source: MONITOR.to_owned(), reason };
        let risen = flags.into_iter().filter(|(name, _)| !self.listed.contains(name));
        self.flags.extend(risen.map(|(name, reason)| news(name, true, reason)));
        self.flags.extend(self.listed.difference(&listed).map(|name| news(name.clone(), false, String::new())));
        self.listed = listed;
    }

    /// The newest vehicle since the last call.
    pub(super) fn take_vehicle(&mut self) -> Option<Vehicle> {
        self.vehicle.take()
    }

    /// The flags since the last call, in order.
    pub(super) fn take_flags(&mut self) -> Vec<FlagNews> {
        std::mem::take(&mut self.flags)
    }
}
