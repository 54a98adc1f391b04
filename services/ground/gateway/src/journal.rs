//! The bounded journal of each vehicle's events, read by any number of clients at their own speed.
//!
//! A client is only a [`Cursor`]: it costs no memory, even if it is slow. When events that it has not
//! read are gone, the next batch reports the loss. This also serves a client that comes back after a
//! break, or after a restart of the gateway.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use axum::body::Bytes;
use domain::time::Now;
use node::VehicleId;
use serde_json::Value;

use crate::fleet::occurrence::Occurrence;
use crate::http::events;
use crate::view;

/// The size limit of a journal's events in bytes, for records of any length: several times the size of thousands of
/// ordinary records.
const MAX_BYTES: usize = 8 * 1024 * 1024;

/// The journals of all vehicles.
#[derive(Debug)]
pub(crate) struct Journals {
    /// Distinguishes this start of the gateway from others: UTC milliseconds of the first record.
    epoch: Option<i64>,
    capacity: usize,
    by_vehicle: BTreeMap<VehicleId, Journal>,
}

#[derive(Debug, Default)]
struct Journal {
    /// The number of the newest record; records count from 1.
    newest: u64,
    records: VecDeque<Arc<Record>>,
    bytes: usize,
}

/// One event.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Record {
    /// The place in the journal.
    pub(crate) id: RecordId,
    /// Its server-sent event, with the message as JSON; shared by all clients that get it.
    pub(crate) frame: Bytes,
}

/// A record's place in a vehicle's journal, as text `<epoch>-<sequence>`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RecordId {
    epoch: i64,
    sequence: u64,
}

/// How far a client has read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cursor {
    /// It has not read yet: it starts with the oldest record that is left.
    Start,
    /// It has read a journal that was still empty.
    Empty,
    /// It has read everything up to a record.
    After(RecordId),
}

/// What a client reads next.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Batch {
    /// Whether records between the cursor and the first of these are gone, or the cursor belongs to another
    /// journal: the state that the client has derived from events may be wrong.
    pub(crate) lost: bool,
    /// The records, in order.
    pub(crate) records: Vec<Arc<Record>>,
    /// How far the client has read after these.
    pub(crate) cursor: Cursor,
}

impl Journals {
    /// Empty journals that keep `capacity` records for each vehicle.
    pub(crate) fn new(capacity: usize) -> Journals {
        Journals { epoch: None, capacity, by_vehicle: BTreeMap::new() }
    }

    /// Adds what happened to a vehicle's journal, with its mission time if that is known; the oldest record goes when there are too
    /// many.
    pub(crate) fn push(&mut self, now: Now, mission_time_s: Option<f64>, vehicle: &VehicleId, occurrence: &Occurrence) {
        let data = view::stamped(mission_time_s, now.utc_ms, occurrence.to_json()).to_string();
        self.push_record(now.utc_ms, vehicle, occurrence.kind(), &data);
    }

    /// Puts the records of a vehicle from before the gateway was started in front of its others. Every client hears that it has lost
    /// events, and reads all of them again.
    pub(crate) fn go_on_from(&mut self, vehicle: &VehicleId, mut before: Journals) {
        let Some(earlier) = before.by_vehicle.remove(vehicle) else { return };
        let since = self.by_vehicle.remove(vehicle).unwrap_or_default();
        let epoch = self.epoch.map_or(0, |it| it + 1);
        self.epoch = Some(epoch);
        // Those of the other vehicles get ids of the new epoch as well: it is one for all.
        for journal in self.by_vehicle.values_mut() {
            *journal = renumbered(epoch, self.capacity, std::mem::take(journal).records);
        }
        let told: BTreeSet<Bytes> = earlier.records.iter().filter_map(|it| repeated(&it.frame)).collect();
        let is_new = |it: &Arc<Record>| repeated(&it.frame).is_none_or(|it| !told.contains(&it));
        let all = earlier.records.into_iter().chain(since.records.into_iter().filter(is_new)).collect();
        self.by_vehicle.insert(vehicle.clone(), renumbered(epoch, self.capacity, all));
    }

    fn push_record(&mut self, utc_ms: i64, vehicle: &VehicleId, kind: &'static str, data: &str) {
        let epoch = *self.epoch.get_or_insert(utc_ms);
        let journal = self.by_vehicle.entry(vehicle.clone()).or_default();
        journal.push(epoch, self.capacity, |id| events::frame(Some(id), kind, data));
    }

    /// The records after the cursor, at most `count`.
    pub(crate) fn read(&self, vehicle: &str, cursor: Cursor, count: usize) -> Batch {
        let Some(journal) = self.by_vehicle.get(vehicle) else {
            let cursor = if cursor == Cursor::Start { Cursor::Empty } else { cursor };
            return Batch { lost: false, records: Vec::new(), cursor };
        };
        let oldest = journal.newest + 1 - journal.records.len() as u64;
        let (lost, first) = match cursor {
            Cursor::Start => (false, oldest),
            Cursor::Empty => (1 < oldest, oldest),
            Cursor::After(id) if Some(id.epoch) != self.epoch || journal.newest < id.sequence => (true, oldest),
            Cursor::After(id) => (id.sequence + 1 < oldest, oldest.max(id.sequence + 1)),
        };
        let skip = usize::try_from(first - oldest).unwrap_or(usize::MAX);
        let records: Vec<_> = journal.records.iter().skip(skip).take(count).cloned().collect();
        let cursor = records.last().map_or(cursor, |newest| Cursor::After(newest.id));
        Batch { lost, records, cursor }
    }
}

impl Journal {
    /// Adds a record whose frame `with_id` makes.
    fn push(&mut self, epoch: i64, capacity: usize, with_id: impl FnOnce(&str) -> Bytes) {
        self.newest += 1;
        let id = RecordId { epoch, sequence: self.newest };
        let frame = with_id(&id.to_string());
        self.bytes += frame.len();
        while capacity <= self.records.len() || MAX_BYTES < self.bytes {
            let Some(oldest) = self.records.pop_front() else { break };
            self.bytes -= oldest.frame.len();
        }
        self.records.push_back(Arc::new(Record { id, frame }));
    }
}

/// Of an event that is made of a repeated status, and so is made once more after a start: the event without when it came.
fn repeated(frame: &Bytes) -> Option<Bytes> {
    let text = std::str::from_utf8(frame).ok()?;
    let (kind, data) = text.split_once("event: ")?.1.split_once("\ndata: ")?;
    ["objective", "permission", "report"].contains(&kind).then_some(())?;
    let mut data: Value = serde_json::from_str(data).ok()?;
    for when in ["missionTimeS", "utc", "validForS"] {
        data.as_object_mut()?.remove(when);
    }
    Some(format!("{kind} {data}").into())
}

/// A journal of these records under ids of `epoch`.
fn renumbered(epoch: i64, capacity: usize, records: VecDeque<Arc<Record>>) -> Journal {
    let mut journal = Journal::default();
    for record in records {
        journal.push(epoch, capacity, |id| events::under_id(&record.frame, id));
    }
    journal
}

impl Cursor {
    /// The cursor after the record with this id, as a client sends it; the start, if the text is not an id.
    pub(crate) fn after(id: &str) -> Cursor {
        id.parse().map_or(Cursor::Start, Cursor::After)
    }
}

impl fmt::Display for RecordId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-{}", self.epoch, self.sequence)
    }
}

impl FromStr for RecordId {
    type Err = ();
    fn from_str(text: &str) -> Result<RecordId, ()> {
        let (epoch, sequence) = text.rsplit_once('-').ok_or(())?;
        let (epoch, sequence) = (epoch.parse().map_err(drop)?, sequence.parse().map_err(drop)?);
        Ok(RecordId { epoch, sequence })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A journal with room for five records to which `count` were added.
    fn journal(count: usize) -> Journals {
        let mut journals = Journals::new(5);
        (1..=count).for_each(|n| journals.push_record(1000, &"uav1".into(), "flag", &n.to_string()));
        journals
    }

    #[track_caller]
    fn check(count: usize, cursor: Cursor, at_most: usize, expected: (bool, &[&str])) {
        let batch = journal(count).read("uav1", cursor, at_most);
        let data = |it: &Arc<Record>| {
            let text = String::from_utf8_lossy(&it.frame).into_owned();
            text.split_once("\nevent: flag\ndata: ").and_then(|it| it.1.strip_suffix("\n\n").map(str::to_owned))
        };
        let data: Vec<_> = batch.records.iter().filter_map(data).collect();
        assert_eq!((batch.lost, data.iter().map(String::as_str).collect::<Vec<_>>().as_slice()), expected);
    }

    #[test]
    fn a_client_reads_on_from_where_it_was() {
        check(0, Cursor::Start, 9, (false, &[]));
        check(3, Cursor::Start, 9, (false, &["1", "2", "3"]));
        check(3, Cursor::Start, 2, (false, &["1", "2"]));
        check(3, Cursor::after("1000-2"), 9, (false, &["3"]));
        check(3, Cursor::after("1000-3"), 9, (false, &[]));
    }

    #[test]
    fn a_new_client_gets_the_records_that_are_left_and_has_lost_nothing() {
        check(7, Cursor::Start, 9, (false, &["3", "4", "5", "6", "7"]));
    }

    #[test]
    fn a_batch_says_when_records_are_gone() {
        check(5, Cursor::Empty, 2, (false, &["1", "2"]));
        check(6, Cursor::Empty, 2, (true, &["2", "3"]));
        check(7, Cursor::after("1000-2"), 9, (false, &["3", "4", "5", "6", "7"]));
        check(7, Cursor::after("1000-1"), 9, (true, &["3", "4", "5", "6", "7"]));
        check(3, Cursor::after("999-2"), 9, (true, &["1", "2", "3"]));
        check(3, Cursor::after("1000-4"), 9, (true, &["1", "2", "3"]));
    }

    #[test]
    fn records_from_before_a_start_come_first_and_every_client_reads_again() {
        let mut since = journal(2);
        since.push_record(1000, &"uav2".into(), "flag", "other");
        // The first status after the start, which tells again what was told.
        since.push_record(1000, &"uav1".into(), "report", r#"{"reason":"fog","utc":"1"}"#);
        let (read, other) = (since.read("uav1", Cursor::Start, 9).cursor, since.read("uav2", Cursor::Start, 9).cursor);
        let mut before = Journals::new(5);
        before.push_record(500, &"uav1".into(), "flag", "7");
        before.push_record(500, &"uav1".into(), "report", r#"{"reason":"fog","utc":"0"}"#);
        since.go_on_from(&"uav1".into(), before);
        let frames = |vehicle, cursor| {
            let batch = since.read(vehicle, cursor, 9);
            let texts: Vec<_> =
                batch.records.iter().map(|it| String::from_utf8_lossy(&it.frame).into_owned()).collect();
            (batch.lost, texts)
        };
        let frame = |n, data| format!("id: 1001-{n}\nevent: flag\ndata: {data}\n\n");
        let report = frame(2, r#"{"reason":"fog","utc":"0"}"#).replace("flag", "report");
        let all = vec![frame(1, "7"), report, frame(3, "1"), frame(4, "2")];
        assert_eq!(frames("uav1", read), (true, all.clone()));
        assert_eq!(frames("uav1", Cursor::Start), (false, all.clone()));
        assert_eq!(frames("uav2", other), (true, vec![frame(1, "other")]));
        since.push_record(2000, &"uav1".into(), "flag", "3");
        // The oldest goes where there are too many: there is room for five.
        assert_eq!(since.read("uav1", Cursor::after("1001-4"), 9).records.len(), 1);
    }

    #[test]
    fn long_records_take_the_place_of_several() {
        let mut journals = Journals::new(5);
        for _ in 0..5 {
            journals.push_record(1000, &"uav1".into(), "flag", &"x".repeat(MAX_BYTES / 4));
        }
        assert_eq!(journals.read("uav1", Cursor::Start, 9).records.len(), 3, "each is a little longer than its data");
    }

    #[test]
    fn a_text_that_is_not_an_id_starts_from_the_beginning() {
        for id in ["", "7", "-", "1000-", "-x", "1000-18446744073709551616"] {
            assert_eq!(Cursor::after(id), Cursor::Start, "{id}");
        }
        check(3, Cursor::after("1000-18446744073709551615"), 9, (true, &["1", "2", "3"]));
    }
}
