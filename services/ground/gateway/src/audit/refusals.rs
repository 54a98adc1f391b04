//! Requests that were refused: the newest in memory and in a file of its own, and their number for each reason and address.
//!
//! Everything here is bounded whatever strangers send: texts are cut, the file is replaced when it reaches its limit, and
//! beyond a number of addresses the rest are counted together.

use std::collections::{BTreeMap, VecDeque};
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};

use credentials::file;
use kittiwake_proto::json::to_json;
use kittiwake_proto::v1::{RefusalCount, RefusalLog, RefusalRecord};

use crate::audit::utc;
use crate::in_place::is_at;

const FILE: &str = "refusals.jsonl";
/// Bytes at which the file is renamed, in place of the one that was renamed before.
const MAX_BYTES: u64 = 1024 * 1024;
/// The most records in memory.
const MAX_RECORDS: usize = 200;
/// The most counters; more addresses are counted together.
const MAX_COUNTS: usize = 1000;
/// Characters of a text.
const MAX_TEXT: usize = 160;
/// The address of all for which there is no counter.
const OTHERS: &str = "others";

/// The refusals, shared by every request.
#[derive(Debug)]
pub(crate) struct Refusals(Mutex<Log>);

#[derive(Debug, Default)]
struct Log {
    file: Option<BoundedFile>,
    newest_last: VecDeque<RefusalRecord>,
    /// By reason and address.
    counts: BTreeMap<(String, String), (u64, String)>,
}

#[derive(Debug)]
struct BoundedFile {
    path: PathBuf,
    file: File,
    bytes: u64,
}

impl Refusals {
    /// In memory only.
    pub(crate) fn in_memory() -> Refusals {
        Refusals(Mutex::default())
    }

    /// Appends to the file in `folder`.
    pub(crate) fn open(folder: &Path) -> Result<Refusals, (PathBuf, io::Error)> {
        let path = folder.join(FILE);
        let opened = file::append(&path).and_then(|file| Ok((file.metadata()?.len(), file)));
        let (bytes, file) = opened.map_err(|cause| (path.clone(), cause))?;
        Ok(Refusals(Mutex::new(Log { file: Some(BoundedFile { path, file, bytes }), ..Log::default() })))
    }

    /// Counts a refusal and records it.
    pub(crate) fn record(&self, refusal: RefusalRecord) {
        let mut log = self.lock();
        let cut_off = |text: String| cut(&text, MAX_TEXT);
        let refusal = RefusalRecord {
            utc: utc(),
            who: refusal.who.map(cut_off),
            what: cut_off(refusal.what),
            detail: cut_off(refusal.detail),
            ..refusal
        };
        log.count(&refusal.reason, &refusal.address, &refusal.utc);
        // What strangers sent and what became of it is no reason to stop, or to report that the audit trail has a gap.
        if let Some(file) = &mut log.file {
            let _ = file.write(&refusal);
        }
        if log.newest_last.len() == MAX_RECORDS {
            log.newest_last.pop_front();
        }
        log.newest_last.push_back(refusal);
    }

    /// Counts a refusal and records nothing more.
    pub(crate) fn count(&self, reason: &str, address: &str) {
        self.lock().count(reason, address, &utc());
    }

    /// The counters, and the newest records, at most `count`.
    pub(crate) fn newest(&self, count: usize) -> RefusalLog {
        let log = self.lock();
        let counts = log.counts.iter().map(|((reason, address), (count, utc))| RefusalCount {
            reason: reason.clone(),
            address: address.clone(),
            count: *count,
            utc: utc.clone(),
        });
        let skip = log.newest_last.len().saturating_sub(count);
        RefusalLog { counts: counts.collect(), records: log.newest_last.iter().skip(skip).cloned().collect() }
    }

    /// The number of refusals for each reason.
    pub(crate) fn by_reason(&self) -> BTreeMap<String, u64> {
        let mut by_reason = BTreeMap::new();
        for ((reason, _), (count, _)) in &self.lock().counts {
            *by_reason.entry(reason.clone()).or_default() += count;
        }
        by_reason
    }

    /// The data are whole even if a thread panicked while it held the lock.
    fn lock(&self) -> MutexGuard<'_, Log> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl Log {
    fn count(&mut self, reason: &str, address: &str, utc: &str) {
        let key = (reason.to_owned(), address.to_owned());
        let has_room = self.counts.len() < MAX_COUNTS || self.counts.contains_key(&key);
        let key = if has_room { key } else { (reason.to_owned(), OTHERS.to_owned()) };
        let counter = self.counts.entry(key).or_default();
        *counter = (counter.0 + 1, utc.to_owned());
    }
}

impl BoundedFile {
    fn write(&mut self, refusal: &RefusalRecord) -> io::Result<()> {
        let line = format!("{}\n", to_json(refusal));
        if !is_at(&self.file, &self.path) {
            self.file = file::append(&self.path)?;
            self.bytes = self.file.metadata()?.len();
        }
        if MAX_BYTES < self.bytes + line.len() as u64 {
            std::fs::rename(&self.path, self.path.with_extension("1.jsonl"))?;
            (self.file, self.bytes) = (file::append(&self.path)?, 0);
        }
        self.bytes += line.len() as u64;
        self.file.write_all(line.as_bytes())
    }
}

/// A text of at most `most` characters; a longer one ends with `…`.
pub(crate) fn cut(text: &str, most: usize) -> String {
    match text.char_indices().nth(most) {
        None => text.to_owned(),
        Some((end, _)) => format!("{}…", &text[..end]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(reason: &str, address: &str, what: String) -> RefusalRecord {
        let (reason, address) = (reason.to_owned(), address.to_owned());
        RefusalRecord { reason, address, what, ..Default::default() }
    }

    #[test]
    fn what_strangers_send_is_counted_and_bounded() {
        let folder = tempfile::tempdir().unwrap();
        let refusals = Refusals::open(folder.path()).unwrap();
        let long = "x".repeat(60_000);
        for n in 0..10_000 {
            refusals.record(refusal("Unauthorized", &format!("10.0.{}.{}", n / 256, n % 256), long.clone()));
        }
        refusals.count("Too Many Requests", "10.0.0.1");
        let log = refusals.newest(usize::MAX);
        assert_eq!((log.records.len(), log.counts.len()), (MAX_RECORDS, MAX_COUNTS + 2));
        assert_eq!(log.counts.iter().map(|it| it.count).sum::<u64>(), 10_001);
        assert_eq!(
            refusals.by_reason(),
            BTreeMap::from([("Too Many Requests".into(), 1), ("Unauthorized".into(), 10_000)])
        );
        assert_eq!(log.records[0].what, "x".repeat(MAX_TEXT) + "…");
        let bytes = |name: &str| std::fs::metadata(folder.path().join(name)).unwrap().len();
        assert!(bytes(FILE) <= MAX_BYTES && bytes("refusals.1.jsonl") <= MAX_BYTES);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
    }
}
