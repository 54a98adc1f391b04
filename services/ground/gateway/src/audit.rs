//! The audit log: who ordered what, when, and the outcome.
//!
//! The log is a file of JSON lines. When it reaches its size limit it is renamed, in place of the file
//! that was renamed before, and a new file begins. The newest records also stay in memory for clients.

use std::collections::VecDeque;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};

use kittiwake_proto::json::to_json;
use kittiwake_proto::v1::AuditRecord;

/// The size limit of a file, in bytes: about ten thousand orders.
const MAX_BYTES: u64 = 4 * 1024 * 1024;
/// The most records in memory.
const MAX_RECORDS: usize = 1000;

/// The log, shared by every request.
#[derive(Debug)]
pub struct Audit(Mutex<Log>);

#[derive(Debug)]
struct Log {
    file: Option<BoundedFile>,
    newest_last: VecDeque<AuditRecord>,
    /// Records that could not be written.
    lost: u64,
}

#[derive(Debug)]
struct BoundedFile {
    path: PathBuf,
    file: File,
    bytes: u64,
    max_bytes: u64,
}

impl Audit {
    /// A log in memory only.
    pub fn in_memory() -> Audit {
        Audit(Mutex::new(Log { file: None, newest_last: VecDeque::new(), lost: 0 }))
    }

    /// Appends to the file at `path`.
    ///
    /// # Errors
    /// If the file cannot be opened.
    pub fn open(path: &Path) -> io::Result<Audit> {
        Audit::open_bounded(path, MAX_BYTES)
    }

    fn open_bounded(path: &Path, max_bytes: u64) -> io::Result<Audit> {
        let file = append(path)?;
        let bytes = file.metadata()?.len();
        let file = Some(BoundedFile { path: path.to_owned(), file, bytes, max_bytes });
        Ok(Audit(Mutex::new(Log { file, newest_last: VecDeque::new(), lost: 0 })))
    }

    /// Adds a record.
    pub(crate) fn record(&self, record: AuditRecord) {
        let mut log = self.lock();
        if log.file.as_mut().is_some_and(|file| file.write(&record).is_err()) {
            log.lost += 1;
        }
        if log.newest_last.len() == MAX_RECORDS {
            log.newest_last.pop_front();
        }
        log.newest_last.push_back(record);
    }

    /// The newest records, at most `count`, newest last.
    pub(crate) fn newest(&self, count: usize) -> Vec<AuditRecord> {
        let log = self.lock();
        let skip = log.newest_last.len().saturating_sub(count);
        log.newest_last.iter().skip(skip).cloned().collect()
    }

    /// Records that could not be written to the file.
    pub(crate) fn lost(&self) -> u64 {
        self.lock().lost
    }

    /// The data are whole even if a thread panicked while it held the lock.
    fn lock(&self) -> MutexGuard<'_, Log> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl BoundedFile {
    fn write(&mut self, record: &AuditRecord) -> io::Result<()> {
        let line = format!("{}\n", to_json(record));
        if self.max_bytes < self.bytes + line.len() as u64 {
            let mut before = self.path.clone().into_os_string();
            before.push(".1");
            std::fs::rename(&self.path, before)?;
            (self.file, self.bytes) = (append(&self.path)?, 0);
        }
        self.bytes += line.len() as u64;
        self.file.write_all(line.as_bytes())
    }
}

fn append(path: &Path) -> io::Result<File> {
    OpenOptions::new().create(true).append(true).mode(0o600).open(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    /// A record that differs from others by its status.
    fn record(status: u32) -> AuditRecord {
        AuditRecord { status, ..Default::default() }
    }

    #[test]
    fn the_newest_records_stay_in_memory() {
        let audit = Audit::in_memory();
        let count = MAX_RECORDS as u32 + 5;
        (0..count).for_each(|n| audit.record(record(n)));
        assert_eq!(audit.newest(2), [record(count - 2), record(count - 1)]);
        assert_eq!(audit.newest(usize::MAX).len(), MAX_RECORDS);
    }

    #[test]
    fn the_file_is_appended_to_and_never_outgrows_its_bound() {
        let path = std::env::temp_dir().join(format!("kittiwake-audit-{}", std::process::id()));
        let before = std::env::temp_dir().join(format!("kittiwake-audit-{}.1", std::process::id()));
        let line = to_json(&record(10)).to_string().len() as u64 + 1;
        let audit = Audit::open_bounded(&path, 4 * line).unwrap();
        (10..20).for_each(|n| audit.record(record(n)));
        drop(audit);
        Audit::open_bounded(&path, 4 * line).unwrap().record(record(20));
        let statuses = |path: &Path| -> Vec<u64> {
            let text = std::fs::read_to_string(path).unwrap();
            let status = |line| serde_json::from_str::<Value>(line).unwrap()["status"].as_u64().unwrap();
            text.lines().map(status).collect()
        };
        let (old, new) = (statuses(&before), statuses(&path));
        std::fs::remove_file(&path).unwrap();
        std::fs::remove_file(&before).unwrap();
        assert_eq!(old, [14, 15, 16, 17]);
        assert_eq!(new, [18, 19, 20]);
    }
}
