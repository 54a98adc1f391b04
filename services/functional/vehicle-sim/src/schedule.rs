//! When each topic is due. All are sent in step with the fastest one, so that the process wakes once
//! for several; a slower topic is late by less than one step and keeps its mean rate.

use std::time::Duration;

use domain::time::{Pace, Time};
use kittiwake_proto::topics::Topic;

use crate::config::Rates;

#[derive(Debug)]
struct Slot {
    topic: Topic,
    period: Duration,
    next: Time,
}

/// The next due time of each topic.
#[derive(Debug)]
pub(crate) struct Schedule {
    /// The fastest comes first.
    slots: [Slot; 8],
}

impl Schedule {
    /// Everything is due at the start, then at its rate in wall time.
    pub(crate) fn new(rates: &Rates, pace: Pace) -> Schedule {
        let slot = |topic, rate: domain::quantity::Positive| Slot {
            topic,
            period: pace.wall(rate.period()),
            next: Time::ZERO,
        };
        Schedule {
            slots: [
                slot(Topic::VehicleAttitude, rates.vehicle_attitude),
                slot(Topic::VehicleLocalPosition, rates.vehicle_local_position),
                slot(Topic::VehicleGlobalPosition, rates.vehicle_global_position),
                slot(Topic::BatteryStatus, rates.battery_status),
                slot(Topic::VehicleStatus, rates.vehicle_status),
                slot(Topic::VehicleLandDetected, rates.vehicle_land_detected),
                slot(Topic::TransponderReport, rates.transponder_report),
                slot(Topic::WindEstimate, rates.wind),
            ],
        }
    }

    /// The next step.
    pub(crate) fn deadline(&self) -> Time {
        self.slots[0].next
    }

    /// The topics that are due at `now`; they count as sent.
    pub(crate) fn due(&mut self, now: Time) -> Vec<Topic> {
        if now < self.deadline() {
            return Vec::new();
        }
        let due = self.slots.iter_mut().filter(|it| it.next <= now);
        due.map(|slot| {
            slot.next = slot.next + slot.period;
            // A process that was held up does not send everything that it missed in a burst.
            if slot.next + slot.period < now {
                slot.next = now + slot.period;
            }
            slot.topic
        })
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::shipped;

    #[test]
    fn a_process_that_was_held_up_sends_no_burst() {
        let mut schedule = Schedule::new(&shipped::config().rates, Pace::REAL_TIME);
        assert_eq!(schedule.due(Time::ZERO).len(), 8, "everything at first");
        assert!(schedule.due(Time::after(Duration::from_millis(1))).is_empty(), "between two steps");
        let late = Time::after(Duration::from_secs(5));
        assert_eq!(schedule.due(late).len(), 8, "everything once");
        assert!(schedule.due(late).is_empty());
        assert!(schedule.deadline() > late);
    }
}
