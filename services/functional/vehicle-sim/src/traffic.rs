//! Other aircraft, which fly straight and level.

use domain::fmu::{TrafficKind, TransponderReport};
use domain::geometry::{Ned, NedVelocity};
use domain::time::Time;

#[derive(Debug)]
struct Intruder {
    id: String,
    appeared: Time,
    from: Ned,
    velocity: NedVelocity,
    kind: TrafficKind,
}

/// All other aircraft.
#[derive(Debug, Default)]
pub(crate) struct Traffic {
    intruders: Vec<Intruder>,
    count: u32,
}

impl Traffic {
    /// Another aircraft appears; returns its id, which no other had before.
    pub(crate) fn appear(&mut self, from: Ned, velocity: NedVelocity, kind: TrafficKind, now: Time) -> &str {
        self.count += 1;
        self.intruders.push(Intruder { id: format!("intruder-{}", self.count), appeared: now, from, velocity, kind });
        self.intruders.last().map_or("", |it| &it.id)
    }

    /// All of them disappear.
    pub(crate) fn clear(&mut self) {
        self.intruders.clear();
    }

    /// What a transponder receiver reports about each.
    pub(crate) fn reports(&self, now: Time) -> impl Iterator<Item = TransponderReport> {
        self.intruders.iter().map(move |intruder| {
            let Intruder { id, appeared, from, velocity, kind } = intruder;
            let flown_s = (now - *appeared).as_secs_f64();
            let position = Ned {
                north_m: from.north_m + velocity.north_m_s * flown_s,
                east_m: from.east_m + velocity.east_m_s * flown_s,
                ..*from
            };
            TransponderReport { id: id.clone(), position, velocity: *velocity, kind: *kind }
        })
    }
}
