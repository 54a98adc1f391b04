//! Other aircraft, straight and level.

use domain::geometry::{Ned, NedVelocity};
use domain::time::Time;
use kittiwake_proto::v1;

#[derive(Debug)]
struct Intruder {
    id: String,
    seen: Time,
    from: Ned,
    velocity: NedVelocity,
}

/// Every other aircraft there is.
#[derive(Debug, Default)]
pub struct Traffic {
    intruders: Vec<Intruder>,
    appeared: u32,
}

impl Traffic {
    /// One more appears and is given an id that none had before it.
    pub fn appear(&mut self, from: Ned, velocity: NedVelocity, now: Time) -> &str {
        self.appeared += 1;
        self.intruders.push(Intruder { id: format!("intruder-{}", self.appeared), seen: now, from, velocity });
        self.intruders.last().map_or("", |it| &it.id)
    }

    /// All are gone.
    pub fn clear(&mut self) {
        self.intruders.clear();
    }

    /// What a transponder receiver hears of each.
    pub fn reports(&self, now: Time) -> impl Iterator<Item = v1::TransponderReport> {
        self.intruders.iter().map(move |it| {
            let flown_s = (now - it.seen).as_secs_f64();
            let position = Ned {
                north_m: it.from.north_m + it.velocity.north_m_s * flown_s,
                east_m: it.from.east_m + it.velocity.east_m_s * flown_s,
                ..it.from
            };
            v1::TransponderReport {
                id: it.id.clone(),
                position: Some(position.into()),
                velocity: Some(it.velocity.into()),
            }
        })
    }
}
