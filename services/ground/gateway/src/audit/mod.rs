//! The audit trail: who ordered what, when, and what came of it; and apart from it, which requests were refused.
//!
//! An order leaves two lines in a file of its day: one before it is sent, so that no order is without a trace, and one with
//! its outcome. Each line carries the hash of the one before (`chain`); [`verify`] checks that. In memory the newest orders
//! are kept for clients. Requests that were refused go to `refusals`, so that nobody without a token can displace a record.

#![expect(clippy::disallowed_methods, reason = "audit records carry UTC")]

use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};
use std::time::SystemTime;

use kittiwake_proto::v1::{AuditRecord, AuditStage};

use crate::audit::day_files::DayFiles;
use crate::audit::refusals::Refusals;

mod chain;
mod day_files;
pub(crate) mod refusals;
#[cfg(test)]
mod tests;
pub mod verify;

/// The most orders in memory.
const MAX_ORDERS: usize = 1000;

/// The audit trail and the refusals, shared by every request.
#[derive(Debug)]
pub struct Audit {
    orders: Mutex<Orders>,
    /// Requests that are no orders.
    pub(crate) refusals: Refusals,
}

#[derive(Debug)]
struct Orders {
    /// Absent where nothing is kept.
    files: Option<DayFiles>,
    /// The number of the newest record.
    number: u64,
    newest_last: VecDeque<AuditRecord>,
    /// Records that could not be written.
    lost: u64,
    /// Whether the last record could not be written.
    is_failing: bool,
    /// Whether the newest file is being brought to the disk.
    is_syncing: bool,
}

impl Audit {
    /// In memory only.
    pub fn in_memory() -> Audit {
        Audit::with(None, Refusals::in_memory())
    }

    /// Goes on with the files in `folder`, of which the newest `most_files` are kept.
    ///
    /// # Errors
    /// The path that cannot be read or written, and why.
    pub fn open(folder: &Path, most_files: usize) -> Result<Audit, (PathBuf, io::Error)> {
        let files = DayFiles::open(folder, most_files, &utc())?;
        Ok(Audit::with(Some(files), Refusals::open(folder)?))
    }

    fn with(files: Option<DayFiles>, refusals: Refusals) -> Audit {
        let number = files.as_ref().map_or(0, DayFiles::newest_number);
        let newest_last = VecDeque::new();
        let orders = Orders { files, number, newest_last, lost: 0, is_failing: false, is_syncing: false };
        Audit { orders: Mutex::new(orders), refusals }
    }

    /// Records that an order is about to be carried out, and returns the record's number. A record that cannot be written
    /// does not stop the order: an aircraft is not left without orders because a disk is full.
    pub(crate) fn asked(&self, order: &AuditRecord) -> u64 {
        let stage = AuditStage::Asked.into();
        self.lock().add(AuditRecord { stage, ..order.clone() })
    }

    /// Records what came of the order whose first record has the number `asked`, and returns the record.
    pub(crate) fn ended(&self, asked: u64, order: AuditRecord) -> AuditRecord {
        let mut orders = self.lock();
        let record = AuditRecord { stage: AuditStage::Ended.into(), asked: Some(asked), ..order };
        orders.add(record);
        orders.newest_last.back().cloned().unwrap_or_default()
    }

    /// One record for each of the newest orders, at most `count`, newest last.
    pub(crate) fn newest(&self, count: usize) -> Vec<AuditRecord> {
        let orders = self.lock();
        let skip = orders.newest_last.len().saturating_sub(count);
        orders.newest_last.iter().skip(skip).cloned().collect()
    }

    /// Records that could not be written to a file.
    pub(crate) fn lost(&self) -> u64 {
        self.lock().lost
    }

    /// `ok` or `failing`.
    pub(crate) fn state(&self) -> &'static str {
        if self.lock().is_failing { "failing" } else { "ok" }
    }

    /// Brings what was recorded to the disk. It may take long; if another thread does it already, it returns at once.
    pub(crate) fn sync(&self) {
        let file = {
            let mut orders = self.lock();
            let file = orders.files.as_ref().filter(|_| !orders.is_syncing).and_then(|it| it.newest_file().ok());
            orders.is_syncing |= file.is_some();
            file
        };
        let Some(file) = file else { return };
        let synced = file.sync_data();
        let mut orders = self.lock();
        orders.is_syncing = false;
        orders.is_failing |= synced.is_err();
    }

    /// The data are whole even if a thread panicked while it held the lock.
    fn lock(&self) -> MutexGuard<'_, Orders> {
        self.orders.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl Orders {
    fn add(&mut self, record: AuditRecord) -> u64 {
        self.number += 1;
        let record = AuditRecord { utc: utc(), number: self.number, ..record };
        if let Some(files) = &mut self.files {
            let written = files.append(&record);
            if let Err(cause) = &written
                && !self.is_failing
            {
                tracing::error!("audit records cannot be written: {cause}; orders are carried out all the same");
            }
            self.is_failing = written.is_err();
            self.lost += u64::from(written.is_err());
        }
        // Of an order that has ended, only its end.
        let asked = self.newest_last.iter().rposition(|it| Some(it.number) == record.asked);
        asked.map(|at| self.newest_last.remove(at));
        if self.newest_last.len() == MAX_ORDERS {
            self.newest_last.pop_front();
        }
        self.newest_last.push_back(record);
        self.number
    }
}

/// Now, in RFC 3339 with milliseconds.
pub(crate) fn utc() -> String {
    humantime::format_rfc3339_millis(SystemTime::now()).to_string()
}
