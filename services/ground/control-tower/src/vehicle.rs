//! When which part of a vehicle's ledger is published.
//!
//! A part is due once a second, each in its turn. A change does not wait for its turn, and is said twice more, a second apart, since
//! the link may lose one. Where the ledger has several parts, changes in them follow one another so slowly that the link takes them, the
//! oldest first.

use std::time::Duration;

use domain::time::{Now, Pace, Time};
use kittiwake_proto::v1;

use crate::config::Config;
use crate::ledger::Ledger;
use crate::numbers::Numbers;

/// A vehicle's ledger, and when it is published.
pub(crate) struct Vehicle {
    pub(crate) ledger: Ledger,
    pub(crate) numbers: Numbers,
    /// When the part whose turn it is is published, even if nothing changes.
    publish_at: Time,
    /// No change is published before this time.
    change_at: Time,
}

/// The time between publications, in mission time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rhythm {
    /// From a turn to the next; and from a part with a change to the next one. So no more than two parts are published in that time, and
    /// one more where [`Vehicle::repeat_all`] brings the turn forward.
    pub(crate) turn: Duration,
}

impl Rhythm {
    pub(crate) fn new(config: &Config, pace: Pace) -> Rhythm {
        Rhythm { turn: pace.wall(config.ledger_rate_hz.period()) }
    }
}

impl Vehicle {
    /// Its first ledger is due now.
    pub(crate) fn new(now: Now, ledger: Ledger, numbers: Numbers) -> Vehicle {
        Vehicle { ledger, numbers, publish_at: now.time, change_at: now.time }
    }

    /// Its mission manager was started, and would wait for the turn of the last part; one part comes within a second anyway.
    pub(crate) fn repeat_parts(&mut self, now: Now) {
        if 1 < self.ledger.parts().len() {
            self.repeat_all(now);
        }
    }

    /// All is published once more, without waiting for its turn.
    pub(crate) fn repeat_all(&mut self, now: Now) {
        self.ledger.repeat_all();
        self.publish_at = now.time;
    }

    /// The next part that is due, without signatures.
    pub(crate) fn next_part(&mut self, now: Now, rhythm: Rhythm) -> Option<v1::PermissionLedger> {
        let parts = self.ledger.parts();
        let turn = self.ledger.turn(&parts);
        let changed = self.ledger.changed_part(&parts, now.time, rhythm).filter(|_| self.change_at <= now.time);
        let is_due = self.publish_at <= now.time;
        let index = changed.or(is_due.then_some(turn))?;
        // The only part has its turn with each change.
        if changed.is_none() || parts.len() == 1 {
            self.publish_at = now.time + rhythm.turn;
        }
        if changed.is_some() && 1 < parts.len() {
            self.change_at = now.time + rhythm.turn;
        }
        Some(self.ledger.say(&parts[index], now.time))
    }

    /// When something is due next.
    pub(crate) fn deadline(&self, rhythm: Rhythm) -> Time {
        let change = self.ledger.change_due(rhythm).map(|it| it.max(self.change_at));
        [change, self.ledger.deadline()].into_iter().flatten().fold(self.publish_at, Time::min)
    }
}

#[cfg(test)]
mod tests;
