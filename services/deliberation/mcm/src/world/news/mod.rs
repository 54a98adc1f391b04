//! Messages of the monitor that the monitor leaf has not taken in yet.

use domain::measured::Measured;

use crate::vehicle::Vehicle;

mod monitor_flags;
mod told;

pub(super) use monitor_flags::{Level, ListedFlag, MONITOR, MonitorFlags};
pub(super) use told::Told;

/// The monitor has raised a flag, or the flag's condition no longer holds.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FlagNews {
    pub(super) name: String,
    pub(super) raised: bool,
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

    /// How the monitor's flags stand.
    pub(super) fn compare(&mut self, level: Level) {
        self.flags.extend(self.of_monitor.compare(level));
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
