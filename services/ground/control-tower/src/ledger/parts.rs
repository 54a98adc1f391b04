//! What of a ledger is published together: parts, none of which is too large for the link.

use domain::time::Time;
use kittiwake_proto::v1;

use super::{Ledger, Line, Shown};
use crate::permission::Standing;
use crate::vehicle::Rhythm;

/// Of the lines of one part: far below the 12,000 bytes of a message that cross (`config/zenoh/link.toml`), and two of them fit into what may
/// wait for the link. (ENG: it crosses twice, over both connections: a full one takes a second of 64 kbit/s.)
const MAX_LINES_BYTES: usize = 4096;
/// Of a line without its other texts: four numbers of at most 11 bytes, the signature, the vehicle's name of at most 64 bytes, where the area
/// is, and the lengths.
const REST_OF_LINE_BYTES: usize = 240;
/// Publications of a change that do not wait for their turn: the link loses two in a row only if it is down.
const TIMES_SAID: u32 = 3;

/// The lines of these areas, and that there are no others with names after the one and through the other.
#[derive(Debug, Default)]
pub(crate) struct Part {
    after: String,
    through: String,
    areas: Vec<String>,
}

impl Ledger {
    /// All that may be published, in parts; at least one.
    pub(crate) fn parts(&self) -> Vec<Part> {
        let (mut parts, mut part, mut bytes) = (Vec::new(), Part::default(), 0);
        for (area, shown) in self.shown() {
            let line_bytes = shown.line.most_bytes(area);
            if let Some(last) = part.areas.last().filter(|_| MAX_LINES_BYTES < bytes + line_bytes) {
                let next = Part { after: last.clone(), ..Part::default() };
                part.through.clone_from(last);
                parts.push(std::mem::replace(&mut part, next));
                bytes = 0;
            }
            bytes += line_bytes;
            part.areas.push(area.clone());
        }
        parts.push(part);
        parts
    }

    /// The part whose turn it is: it has lines that were not said for longest.
    pub(crate) fn turn(&self, parts: &[Part]) -> usize {
        self.first_by(parts, |it| Some(it.said_at)).unwrap_or_default()
    }

    /// The part with the change that was said least often, and of those with the oldest.
    pub(crate) fn changed_part(&self, parts: &[Part], now: Time, rhythm: Rhythm) -> Option<usize> {
        let is_due = |it: &Shown| it.change_due(rhythm).is_some_and(|due| due <= now);
        let first = self.first_by(parts, |it| is_due(it).then_some((it.said, it.since)));
        first.or_else(|| self.has_forgotten.then(|| self.turn(parts)))
    }

    /// When a change is to be said next.
    pub(crate) fn change_due(&self, rhythm: Rhythm) -> Option<Time> {
        let forgotten = self.has_forgotten.then_some(Time::ZERO);
        self.shown().filter_map(|(_, it)| it.change_due(rhythm)).chain(forgotten).min()
    }

    /// The part as it is published at `now`.
    pub(crate) fn say(&mut self, part: &Part, now: Time) -> v1::PermissionLedger {
        self.has_forgotten = false;
        let mut permissions = Vec::new();
        for area in &part.areas {
            if let Some(shown) = self.permissions.get_mut(area).and_then(|it| it.shown.as_mut()) {
                (shown.said, shown.said_at) = (shown.said.saturating_add(1), now);
                permissions.push(shown.line.to_wire(area, now));
            }
        }
        let (after_area, through_area) = (part.after.clone(), part.through.clone());
        v1::PermissionLedger { permissions, after_area, through_area, ..Default::default() }
    }

    /// Every line is said once more without waiting for its turn, but after lines never said.
    pub(crate) fn repeat_all(&mut self) {
        let said = self.permissions.values_mut().filter_map(|it| it.shown.as_mut());
        said.for_each(|it| it.said = it.said.min(TIMES_SAID - 1));
    }

    fn shown(&self) -> impl Iterator<Item = (&String, &Shown)> {
        self.permissions.iter().filter_map(|(area, it)| Some((area, it.shown.as_ref()?)))
    }

    /// The part with the line that comes first by `key`, of those that have one.
    fn first_by<K: Ord>(&self, parts: &[Part], key: impl Fn(&Shown) -> Option<K>) -> Option<usize> {
        let of_area = |area: &String| key(self.permissions.get(area)?.shown.as_ref()?);
        let of_part = |(index, part): (usize, &Part)| Some((part.areas.iter().filter_map(of_area).min()?, index));
        parts.iter().enumerate().filter_map(of_part).min().map(|(_, index)| index)
    }
}

impl Line {
    /// More than it has on the wire.
    fn most_bytes(&self, area: &str) -> usize {
        let reason = match &self.standing {
            Standing::Denied { reason, .. }
            | Standing::Revoked { reason, .. }
            | Standing::Requested { missing: reason, .. } => reason.len(),
            Standing::Granted { .. } | Standing::Expired => 0,
        };
        REST_OF_LINE_BYTES
            + area.len()
            + reason
            + self.request_id.len()
            + self.flight.len()
            + self.entered_because.len()
    }
}

impl Shown {
    /// When it is to be said next although it is not its turn.
    fn change_due(&self, rhythm: Rhythm) -> Option<Time> {
        match self.said {
            0 => Some(Time::ZERO),
            1..TIMES_SAID => Some(self.said_at + rhythm.turn),
            _ => None,
        }
    }
}
