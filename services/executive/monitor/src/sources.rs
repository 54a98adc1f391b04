//! The newest sample of each source, and since when it has brought nothing new.
//!
//! A source is silent when nothing arrives, and frozen when what arrives while the vehicle is armed
//! is the very same again and again. Either way its age counts from the last sample that was new.
//! On the ground, disarmed, standing still is no fault.

use std::num::NonZeroU32;
use std::time::Duration;

use domain::contingency::rule::DataSource;
use domain::time::{Pace, Time};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;

use crate::config::Config;
use crate::telemetry::Telemetry;

/// One source.
#[derive(Debug, Clone)]
pub struct Source<T> {
    /// Repetitions after which it counts as frozen; `None` where a value may stay as it is.
    frozen_after: Option<NonZeroU32>,
    latest: Option<Sample<T>>,
}

#[derive(Debug, Clone)]
struct Sample<T> {
    value: T,
    arrived: Time,
    /// When the value was first seen, and how often in a row since then.
    new_since: Time,
    repetitions: u32,
}

/// When a source last brought something new.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heard {
    /// Its age counts from here.
    pub at: Time,
    /// Whether it still sends, but the same again and again.
    pub frozen: bool,
}

impl<T: Telemetry> Source<T> {
    fn new(frozen_after: Option<NonZeroU32>) -> Source<T> {
        Source { frozen_after, latest: None }
    }

    /// Takes in a sample that arrived while the vehicle was, or was not, `armed`.
    fn take(&mut self, now: Time, value: T, armed: bool) {
        if !value.is_sound() {
            return;
        }
        let (new_since, repetitions) = match &self.latest {
            Some(it) if armed && value.repeats(&it.value) => (it.new_since, it.repetitions.saturating_add(1)),
            _ => (now, 0),
        };
        self.latest = Some(Sample { value, arrived: now, new_since, repetitions });
    }

    /// The newest value, however old.
    pub fn latest(&self) -> Option<&T> {
        self.latest.as_ref().map(|it| &it.value)
    }

    /// When it last brought something new; `None`: it has never been heard.
    pub fn heard(&self) -> Option<Heard> {
        let it = self.latest.as_ref()?;
        let frozen = self.frozen_after.is_some_and(|limit| limit.get() <= it.repetitions);
        Some(Heard { at: if frozen { it.new_since } else { it.arrived }, frozen })
    }
}

/// All that the vehicle says.
#[derive(Debug, Clone)]
pub struct Sources {
    /// `vehicle_status`.
    pub status: Source<v1::VehicleStatus>,
    /// `vehicle_attitude`.
    pub attitude: Source<v1::VehicleAttitude>,
    /// `vehicle_local_position`.
    pub local_position: Source<v1::VehicleLocalPosition>,
    /// `vehicle_global_position`.
    pub global_position: Source<v1::VehicleGlobalPosition>,
    /// `vehicle_land_detected`.
    pub land_detected: Source<v1::VehicleLandDetected>,
    /// `battery_status`.
    pub battery: Source<v1::BatteryStatus>,
    /// When the ground and the vehicle last heard each other.
    contact: Option<Time>,
    /// When the first of the vehicle's sources was first heard.
    pub first_heard: Option<Time>,
    pace: Pace,
}

impl Sources {
    /// Nothing heard yet.
    pub fn new(config: &Config, pace: Pace) -> Sources {
        Sources {
            status: Source::new(None),
            attitude: Source::new(Some(config.attitude_frozen_samples)),
            local_position: Source::new(Some(config.position_frozen_samples)),
            global_position: Source::new(Some(config.position_frozen_samples)),
            land_detected: Source::new(None),
            battery: Source::new(Some(config.battery_frozen_samples)),
            contact: None,
            first_heard: None,
            pace,
        }
    }

    /// Takes in a sample; what is none of ours, or makes no sense, changes nothing.
    pub fn take(&mut self, now: Time, message: Message) {
        let armed = self.armed();
        match message {
            Message::VehicleStatus(it) => self.status.take(now, it, armed),
            Message::VehicleAttitude(it) => self.attitude.take(now, it, armed),
            Message::VehicleLocalPosition(it) => self.local_position.take(now, it, armed),
            Message::VehicleGlobalPosition(it) => self.global_position.take(now, it, armed),
            Message::VehicleLandDetected(it) => self.land_detected.take(now, it, armed),
            Message::BatteryStatus(it) => self.battery.take(now, it, armed),
            Message::GroundContact(it) => self.contact(now, it.heard_age_wall_s),
            _ => return,
        }
        if self.first_heard.is_none() {
            self.first_heard = ALL.iter().find_map(|&it| self.heard(it)).map(|it| it.at);
        }
    }

    /// The ground is heard, and last heard the vehicle so many wall seconds ago. Its last word counts:
    /// what it heard later than that it would have said.
    fn contact(&mut self, now: Time, heard_age_wall_s: f64) {
        if (0.0..=1e9).contains(&heard_age_wall_s) {
            let age = Duration::from_secs_f64(heard_age_wall_s);
            self.contact = Some(Time::after(now.since_start().saturating_sub(self.pace.wall(age))));
        }
    }

    /// When `source` last brought something new; `None`: it has never been heard.
    pub fn heard(&self, source: DataSource) -> Option<Heard> {
        match source {
            DataSource::Status => self.status.heard(),
            DataSource::Attitude => self.attitude.heard(),
            DataSource::LocalPosition => self.local_position.heard(),
            DataSource::GlobalPosition => self.global_position.heard(),
            DataSource::LandDetected => self.land_detected.heard(),
            DataSource::Battery => self.battery.heard(),
            DataSource::GroundLink => self.contact.map(|at| Heard { at, frozen: false }),
        }
    }

    /// Armed, by the last that its status said.
    pub fn armed(&self) -> bool {
        self.status.latest().is_some_and(|it| it.armed)
    }

    /// In the air, by the last that the land detector said.
    pub fn flying(&self) -> bool {
        self.land_detected.latest().is_some_and(|it| !it.landed)
    }
}

const ALL: [DataSource; 6] = [
    DataSource::Status,
    DataSource::Attitude,
    DataSource::LocalPosition,
    DataSource::GlobalPosition,
    DataSource::LandDetected,
    DataSource::Battery,
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Plays battery samples 0.1 s apart, frozen after three repetitions, and compares what is left 1 s after the first.
    #[track_caller]
    fn check(armed: bool, remaining: &[f64], expected: Option<(u64, bool)>) {
        let mut source = Source::new(NonZeroU32::new(3));
        for (n, &remaining) in remaining.iter().enumerate() {
            let value = v1::BatteryStatus { remaining, ..Default::default() };
            source.take(at_ms(n as u64 * 100), value, armed);
        }
        assert_eq!(source.heard(), expected.map(|(ms, frozen)| Heard { at: at_ms(ms), frozen }), "{remaining:?}");
    }

    fn at_ms(ms: u64) -> Time {
        Time::after(Duration::from_millis(ms))
    }

    #[test]
    fn the_age_counts_from_the_last_sample_that_was_new() {
        check(true, &[], None);
        check(true, &[0.5], Some((0, false)));
        check(true, &[0.5, 0.4, 0.3], Some((200, false)));
        check(true, &[0.5, f64::NAN, f64::NAN], Some((0, false)));
        check(true, &[f64::NAN], None);
    }

    #[test]
    fn the_very_same_again_and_again_is_frozen_but_only_when_armed() {
        check(true, &[0.5, 0.4, 0.4, 0.4], Some((300, false)));
        check(true, &[0.5, 0.4, 0.4, 0.4, 0.4], Some((100, true)));
        check(true, &[0.4, 0.4, 0.4, 0.4, 0.3], Some((400, false)));
        check(false, &[0.4, 0.4, 0.4, 0.4, 0.4], Some((400, false)));
    }
}
