//! Pictures that were taken, each once, however many report it.
//!
//! A camera on the link, PX4 by one message when it triggers and by another when it has the place, ArduPilot by one of its own: each
//! counts for itself, so that numbers do not tell which reports are of the same picture. So a report waits a little, and is left out
//! if somebody who knows better was heard about then.

use std::collections::BTreeMap;
use std::time::Duration;

use autopilot::picture::utc_ms;
use domain::time::{Now, Time};
use kittiwake_proto::v1;
use node::Effect;

use crate::heard::{Picture, PictureReport};
use crate::telemetry::global_position;
use crate::vehicle::{FRESH, Vehicle};

/// As long a report waits for a better one. (ENG: a camera that stores a picture before it reports takes up to two seconds.)
const WAITS: Duration = Duration::from_secs(3);

/// Who reports pictures, the one who knows best first: a camera knows what it has taken, an autopilot what it has triggered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Reporter {
    /// The autopilot, and not a camera on the link.
    pub(crate) is_autopilot: bool,
    /// By which message.
    pub(crate) report: PictureReport,
    /// Its component.
    pub(crate) component: u8,
    /// Which of its cameras.
    pub(crate) camera: u8,
}

impl Reporter {
    /// Two cameras know the same: each has pictures of its own.
    fn knows_better_than(self, other: Reporter) -> bool {
        (self.is_autopilot, self.report) < (other.is_autopilot, other.report)
    }
}

/// Reports of the last seconds.
#[derive(Debug, Default)]
pub(crate) struct Pictures {
    /// When each reporter was heard last, and with which number.
    heard: BTreeMap<Reporter, (Time, u32)>,
    /// In the order in which they were heard.
    waiting: Vec<(Time, Reporter, v1::Picture)>,
}

impl Pictures {
    /// A picture is reported. One that comes twice counts once.
    pub(crate) fn take_in(&mut self, by: Reporter, said: &Picture, vehicle: &Vehicle, now: Now) {
        let before = self.heard.insert(by, (now.time, said.number));
        if before.is_none_or(|(at, number)| number != said.number || WAITS < now.time - at) {
            self.waiting.push((now.time, by, picture(said, vehicle, now)));
        }
    }

    /// Publishes those that nobody knows better.
    pub(crate) fn act(&mut self, now: Time, effects: &mut Vec<Effect>) {
        let due = self.waiting.partition_point(|(at, ..)| *at + WAITS <= now);
        for (at, by, picture) in self.waiting.drain(..due) {
            let better =
                |(other, (heard, _)): (&Reporter, &(Time, u32))| other.knows_better_than(by) && at <= *heard + WAITS;
            if !self.heard.iter().any(better) {
                effects.push(Effect::publish(picture));
            }
        }
    }

    /// When the next one has waited long enough.
    pub(crate) fn deadline(&self) -> Option<Time> {
        self.waiting.first().map(|(at, ..)| *at + WAITS)
    }
}

fn picture(said: &Picture, vehicle: &Vehicle, now: Now) -> v1::Picture {
    let utc_ms = utc_ms(said.time_us, now.utc_ms);
    let of_vehicle = || {
        let (_, said) = vehicle.global.filter(|(at, _)| now.time - *at <= FRESH)?;
        let it = global_position(&said, vehicle, now.time)?;
        Some([it.latitude_deg, it.longitude_deg, it.altitude_amsl_m])
    };
    let place = said.place.or_else(of_vehicle);
    v1::Picture {
        number: said.number,
        utc_ms,
        place: place.map(|[latitude_deg, longitude_deg, altitude_amsl_m]| v1::PicturePlace {
            latitude_deg,
            longitude_deg,
            altitude_amsl_m,
        }),
        attitude: said.attitude_rad.map(|[roll_rad, pitch_rad, yaw_rad]| v1::PictureAttitude {
            roll_rad,
            pitch_rad,
            yaw_rad,
        }),
    }
}

#[cfg(test)]
mod tests;
