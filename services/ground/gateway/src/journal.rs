//! The bounded history of each vehicle, read by any number of clients at their own speed.
//!
//! A client is nothing but a [`Cursor`]: it costs no memory however slow it is. When it is so slow
//! that what it has not read is gone, it is told how much it lost. A client that comes back after
//! a break, and one that comes back to a restarted gateway, is the same case.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use node::VehicleId;

/// A history's JSON takes no more memory than this, however long its records are: several times
/// what thousands of ordinary records take.
const MOST_BYTES: usize = 8 * 1024 * 1024;

/// The histories of all vehicles.
#[derive(Debug)]
pub struct Journals {
    /// Tells this start of the gateway from others: UTC milliseconds of the first record.
    epoch: Option<i64>,
    capacity: usize,
    by_vehicle: BTreeMap<VehicleId, Journal>,
}

#[derive(Debug, Default)]
struct Journal {
    /// Of the newest record; they count from 1.
    newest: u64,
    records: VecDeque<Arc<Record>>,
    bytes: usize,
}

/// One line of history.
#[derive(Debug, PartialEq, Eq)]
pub struct Record {
    /// Its place.
    pub id: RecordId,
    /// The type of its server-sent event.
    pub kind: &'static str,
    /// JSON.
    pub data: String,
}

/// A record's place in a vehicle's history, as text `<epoch>-<sequence>`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordId {
    epoch: i64,
    sequence: u64,
}

/// How far a client has read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cursor {
    /// It has not read yet: it starts with the oldest record there is, whatever went before.
    Start,
    /// It has read a history that was still empty.
    Empty,
    /// Everything up to a record.
    After(RecordId),
}

/// What a client reads next.
#[derive(Debug, PartialEq, Eq)]
pub struct Batch {
    /// True if records between the cursor and the first of these are gone for good, or the cursor
    /// belongs to another history: what the client has pieced together may be wrong.
    pub lost: bool,
    /// In order.
    pub records: Vec<Arc<Record>>,
    /// How far the client has read then.
    pub cursor: Cursor,
}

impl Journals {
    /// Empty histories that keep `capacity` records for each vehicle.
    pub fn new(capacity: usize) -> Journals {
        Journals { epoch: None, capacity, by_vehicle: BTreeMap::new() }
    }

    /// Adds a record to a vehicle's history; the oldest goes when there are too many.
    pub fn push(&mut self, utc_ms: i64, vehicle: &VehicleId, kind: &'static str, data: String) {
        let epoch = *self.epoch.get_or_insert(utc_ms);
        let journal = self.by_vehicle.entry(vehicle.clone()).or_default();
        journal.newest += 1;
        journal.bytes += data.len();
        while self.capacity <= journal.records.len() || MOST_BYTES < journal.bytes {
            let Some(oldest) = journal.records.pop_front() else { break };
            journal.bytes -= oldest.data.len();
        }
        let id = RecordId { epoch, sequence: journal.newest };
        journal.records.push_back(Arc::new(Record { id, kind, data }));
    }

    /// At most `most` records after the cursor.
    pub fn read(&self, vehicle: &str, cursor: Cursor, most: usize) -> Batch {
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
        let records: Vec<_> = journal.records.iter().skip(skip).take(most).cloned().collect();
        let cursor = records.last().map_or(cursor, |it| Cursor::After(it.id));
        Batch { lost, records, cursor }
    }
}

impl Cursor {
    /// After the record with this id, as a client gives it; the start, if it is no id of ours.
    pub fn after(id: &str) -> Cursor {
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

    /// A journal that keeps five and was given `count` records.
    fn journal(count: usize) -> Journals {
        let mut journals = Journals::new(5);
        (1..=count).for_each(|n| journals.push(1000, &"uav1".into(), "flag", n.to_string()));
        journals
    }

    #[track_caller]
    fn check(count: usize, cursor: Cursor, most: usize, expected: (bool, &[&str])) {
        let batch = journal(count).read("uav1", cursor, most);
        let data: Vec<_> = batch.records.iter().map(|it| it.data.as_str()).collect();
        assert_eq!((batch.lost, data.as_slice()), expected);
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
    fn a_new_client_gets_what_is_kept_and_has_lost_nothing() {
        check(7, Cursor::Start, 9, (false, &["3", "4", "5", "6", "7"]));
    }

    #[test]
    fn what_is_gone_is_told() {
        check(5, Cursor::Empty, 2, (false, &["1", "2"]));
        check(6, Cursor::Empty, 2, (true, &["2", "3"]));
        check(7, Cursor::after("1000-2"), 9, (false, &["3", "4", "5", "6", "7"]));
        check(7, Cursor::after("1000-1"), 9, (true, &["3", "4", "5", "6", "7"]));
        check(3, Cursor::after("999-2"), 9, (true, &["1", "2", "3"]));
        check(3, Cursor::after("1000-4"), 9, (true, &["1", "2", "3"]));
    }

    #[test]
    fn long_records_take_the_place_of_several() {
        let mut journals = Journals::new(5);
        for _ in 0..5 {
            journals.push(1000, &"uav1".into(), "flag", "x".repeat(MOST_BYTES / 3));
        }
        assert_eq!(journals.read("uav1", Cursor::Start, 9).records.len(), 3);
    }

    #[test]
    fn what_is_no_id_starts_anew() {
        for id in ["", "7", "-", "1000-", "-x", "1000-18446744073709551616"] {
            assert_eq!(Cursor::after(id), Cursor::Start, "{id}");
        }
        check(3, Cursor::after("1000-18446744073709551615"), 9, (true, &["1", "2", "3"]));
    }
}
