//! The record of every command: who, what, when, and what became of it.
//!
//! Lines of JSON in a file that never grows beyond a bound (the one before is kept beside it), and
//! the newest ones in memory for whoever asks.

use std::collections::VecDeque;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};

use serde_json::Value;

/// A file's size: some ten thousand commands.
const MOST_BYTES: u64 = 4 * 1024 * 1024;
/// Records in memory.
const MOST_RECORDS: usize = 1000;

/// The record, shared by all who write to it.
#[derive(Debug)]
pub struct Audit(Mutex<Inner>);

#[derive(Debug)]
struct Inner {
    file: Option<Written>,
    newest_last: VecDeque<Value>,
    /// Records that could not be written.
    lost: u64,
}

#[derive(Debug)]
struct Written {
    path: PathBuf,
    file: File,
    bytes: u64,
    most_bytes: u64,
}

impl Audit {
    /// In memory only.
    pub fn in_memory() -> Audit {
        Audit(Mutex::new(Inner { file: None, newest_last: VecDeque::new(), lost: 0 }))
    }

    /// Goes on with the file at `path`.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn open(path: &Path) -> io::Result<Audit> {
        Audit::open_bounded(path, MOST_BYTES)
    }

    fn open_bounded(path: &Path, most_bytes: u64) -> io::Result<Audit> {
        let file = append(path)?;
        let bytes = file.metadata()?.len();
        let file = Some(Written { path: path.to_owned(), file, bytes, most_bytes });
        Ok(Audit(Mutex::new(Inner { file, newest_last: VecDeque::new(), lost: 0 })))
    }

    /// Adds a record.
    pub fn record(&self, record: Value) {
        let mut inner = self.lock();
        if inner.file.as_mut().is_some_and(|it| it.write(&record).is_err()) {
            inner.lost += 1;
        }
        if inner.newest_last.len() == MOST_RECORDS {
            inner.newest_last.pop_front();
        }
        inner.newest_last.push_back(record);
    }

    /// The newest `most` records, newest last.
    pub fn newest(&self, most: usize) -> Vec<Value> {
        let inner = self.lock();
        let skip = inner.newest_last.len().saturating_sub(most);
        inner.newest_last.iter().skip(skip).cloned().collect()
    }

    /// Records that could not be written to the file.
    pub fn lost(&self) -> u64 {
        self.lock().lost
    }

    /// Plain data: a thread that panicked while it held the lock has left it whole.
    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl Written {
    fn write(&mut self, record: &Value) -> io::Result<()> {
        let line = format!("{record}\n");
        if self.most_bytes < self.bytes + line.len() as u64 {
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
    use serde_json::json;

    #[test]
    fn the_newest_records_are_kept_in_memory() {
        let audit = Audit::in_memory();
        (0..MOST_RECORDS + 5).for_each(|n| audit.record(json!(n)));
        assert_eq!(audit.newest(2), [json!(MOST_RECORDS + 3), json!(MOST_RECORDS + 4)]);
        assert_eq!(audit.newest(usize::MAX).len(), MOST_RECORDS);
    }

    #[test]
    fn the_file_goes_on_where_it_was_and_never_outgrows_its_bound() {
        let path = std::env::temp_dir().join(format!("kittiwake-audit-{}", std::process::id()));
        let before = std::env::temp_dir().join(format!("kittiwake-audit-{}.1", std::process::id()));
        let audit = Audit::open_bounded(&path, 40).unwrap();
        (10..20).for_each(|n| audit.record(json!({ "n": n })));
        drop(audit);
        Audit::open_bounded(&path, 40).unwrap().record(json!({ "n": 20 }));
        let (old, new) = (std::fs::read_to_string(&before), std::fs::read_to_string(&path));
        std::fs::remove_file(&path).unwrap();
        std::fs::remove_file(&before).unwrap();
        assert_eq!(old.unwrap(), "{\"n\":14}\n{\"n\":15}\n{\"n\":16}\n{\"n\":17}\n");
        assert_eq!(new.unwrap(), "{\"n\":18}\n{\"n\":19}\n{\"n\":20}\n");
    }
}
