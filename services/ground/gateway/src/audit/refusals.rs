//! Requests that were refused: the newest in memory and in a file of its own, and their number for each reason and address.
//!
//! Everything here is bounded whatever strangers send: texts are cut, the file is replaced when it reaches its limit, and
//! beyond a number of addresses the rest are counted together. No request waits for the file: a thread of its own writes it,
//! and what that does not keep up with is missing there.

use std::collections::{BTreeMap, VecDeque};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};
use std::time::Duration;

use kittiwake_proto::v1::{RefusalCount, RefusalLog, RefusalRecord};
use regular_file::DiskThread;

use crate::audit::bounded_file::BoundedFile;
use crate::audit::utc;

const FILE: &str = "refusals.jsonl";
/// The most records that wait for the disk; more are in memory only.
const MAX_WAITING: usize = 256;
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
    /// To the thread that writes the file; absent where nothing is kept.
    queue: Option<DiskThread<RefusalRecord>>,
    newest_last: VecDeque<RefusalRecord>,
    /// By reason and address.
    counts: BTreeMap<(String, String), (u64, String)>,
}

impl Refusals {
    /// In memory only.
    pub(crate) fn in_memory() -> Refusals {
        Refusals(Mutex::default())
    }

    /// Appends to the file in `folder`.
    pub(crate) fn open(folder: &Path) -> Result<Refusals, (PathBuf, io::Error)> {
        let path = folder.join(FILE);
        let file = BoundedFile::open(path.clone());
        file.and_then(Refusals::writing).map_err(|cause| (path, cause))
    }

    fn writing(mut file: BoundedFile) -> io::Result<Refusals> {
        let queue = DiskThread::start("refusals", MAX_WAITING, Duration::ZERO, move |refusals| {
            for refusal in refusals {
                // A failed refusal log must not stop the gateway, nor count as a gap in the audit trail.
                let _ = file.write(&refusal);
            }
        })?;
        Ok(Refusals(Mutex::new(Log { queue: Some(queue), ..Log::default() })))
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
        if let Some(queue) = &log.queue {
            // Full while the disk hangs, or strangers are faster than it is.
            let _ = queue.hand_over(refusal.clone());
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
    use crate::audit::full_pipe::{FullPipe, wait_for};

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
    }

    #[test]
    fn a_refusal_is_written_into_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let refusals = Refusals::open(folder.path()).unwrap();
        refusals.record(refusal("Unauthorized", "10.0.0.1", "GET /".into()));
        let read = || std::fs::read_to_string(folder.path().join(FILE)).unwrap();
        wait_for("the line", || read().ends_with('\n').then_some(()));
        assert!(read().contains("10.0.0.1") && read().lines().count() == 1, "{}", read());
    }

    #[test]
    fn a_disk_that_hangs_holds_no_refusal_up() {
        let folder = tempfile::tempdir().unwrap();
        let mut pipe = FullPipe::new(folder.path());
        let refusals = Refusals::writing(BoundedFile::of(pipe.path.clone(), pipe.writer())).unwrap();
        for n in 0..2 * MAX_WAITING {
            refusals.record(refusal("Unauthorized", "10.0.0.1", n.to_string()));
        }
        assert_eq!(
            (refusals.by_reason()["Unauthorized"], refusals.newest(9).records.len()),
            (2 * MAX_WAITING as u64, 9)
        );
        // The disk takes bytes again: those that waited are there, in order. The rest are in memory only, but for as many as the writer had taken before
        // it found the disk hanging.
        for (n, line) in pipe.lines(MAX_WAITING).iter().enumerate().take(MAX_WAITING) {
            assert_eq!(line["what"], n.to_string());
        }
    }
}
