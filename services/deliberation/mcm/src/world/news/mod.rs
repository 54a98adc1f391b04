//! Messages of the monitor that the monitor leaf has not taken in yet.

use std::time::Duration;

use domain::measured::Measured;
use domain::time::Time;

use crate::vehicle::Vehicle;

mod monitor_flags;
mod told;

pub(super) use monitor_flags::{ListedFlag, MONITOR, MonitorFlags};
pub(super) use told::Told;

/// A flag was raised, or its condition no longer holds, by this source.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FlagNews {
    pub(super) name: String,
    pub(super) raised: bool,
    pub(super) source: String,
    pub(super) reason: String,
    /// The value that it was raised by.
    pub(super) measured: Option<Measured>,
}

/// What came in.
#[derive(Debug, Default)]
pub(super) struct News {
    vehicle: Option<Vehicle>,
    flags: Vec<FlagNews>,
    pub(super) of_monitor: MonitorFlags,
}

impl News {
    /// The vehicle of an introspection; it replaces an older one.
    pub(super) fn add_vehicle(&mut self, vehicle: Vehicle) {
        self.vehicle = Some(vehicle);
    }

    /// An event of a single flag.
    pub(super) fn add_flag(&mut self, flag: FlagNews, now: Time) {
        if flag.source == MONITOR {
            self.of_monitor.hear(&flag.name, flag.raised, now);
        }
        self.flags.push(flag);
    }

    /// The flags that an introspection lists: [`MonitorFlags::list`].
    pub(super) fn list(
        &mut self,
        flags: Vec<ListedFlag>,
        now: Time,
        limit: Duration,
        judged_after: impl Fn(&str) -> Option<Duration>,
    ) {
        self.flags.extend(self.of_monitor.list(flags, now, limit, judged_after));
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
