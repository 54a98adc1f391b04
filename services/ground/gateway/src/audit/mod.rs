//! The audit trail: who ordered what, when, and what came of it; and apart from it, which requests were refused.
//!
//! An order leaves two lines in a file of its day: one before it is sent, so that no order is without a trace, and one with
//! its outcome. Each line carries the hash of the one before (`chain`); [`verify`] checks that. In memory the newest orders
//! are kept for clients. Requests that were refused go to `refusals`, so that nobody without a token can displace a record.

#![expect(clippy::disallowed_methods, reason = "audit records carry UTC")]

use std::collections::VecDeque;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::SystemTime;

use kittiwake_proto::v1::{AuditRecord, AuditStage};

use crate::audit::day_files::DayFiles;
use crate::audit::refusals::Refusals;

mod chain;
mod day_files;
pub(crate) mod refusals;
mod regular;
#[cfg(test)]
mod tests;
pub mod verify;

/// The most orders in memory.
const MAX_ORDERS: usize = 1000;

/// The audit trail and the refusals, shared by every request.
#[derive(Debug)]
pub struct Audit {
    orders: Arc<Mutex<Orders>>,
    /// Asks the thread that brings records to the disk to do so; absent where nothing is kept. It is started with the gateway:
    /// where the system gives no more threads, orders are carried out and recorded all the same.
    sync: Option<SyncSender<()>>,
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
}

impl Audit {
    /// In memory only.
    pub fn in_memory() -> Audit {
        Audit { orders: Orders::of(None), sync: None, refusals: Refusals::in_memory() }
    }

    /// Goes on with the files in `folder`, of which the newest `most_files` are kept.
    ///
    /// # Errors
    /// The path that cannot be read or written, and why.
    pub fn open(folder: &Path, most_files: usize) -> Result<Audit, (PathBuf, io::Error)> {
        let files = DayFiles::open(folder, most_files, &utc())?;
        let orders = Orders::of(Some(files));
        let refusals = Refusals::open(folder)?;
        // One that waits is enough: what is asked for meanwhile is brought to the disk with it.
        let (sync, asked) = sync_channel(1);
        let of_thread = orders.clone();
        let thread = std::thread::Builder::new().name("audit".into()).spawn(move || sync_each(&of_thread, &asked));
        thread.map_err(|cause| (folder.to_owned(), cause))?;
        Ok(Audit { orders, sync: Some(sync), refusals })
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

    /// `ok` or `failing`: also where the file is gone that the next record belongs into.
    pub(crate) fn state(&self) -> &'static str {
        let orders = self.lock();
        let is_gone = orders.files.as_ref().is_some_and(|it| !it.is_in_place());
        if orders.is_failing || is_gone { "failing" } else { "ok" }
    }

    /// What happened to the files since the gateway was started that an operator should know.
    pub(crate) fn problem(&self) -> Option<String> {
        let orders = self.lock();
        let lost = orders.files.as_ref()?.lost()?.display();
        Some(format!(
            "gateway: {lost} was removed, renamed or replaced while orders were recorded in it; its records are missing \
             there unless it was renamed, the chain goes on in a new file"
        ))
    }

    /// Has what was recorded brought to the disk soon, without waiting for it.
    pub(crate) fn sync(&self) {
        // Full: the thread does it soon anyway. It ends only with the gateway.
        let _ = self.sync.as_ref().map(|it| it.try_send(()));
    }

    fn lock(&self) -> MutexGuard<'_, Orders> {
        lock(&self.orders)
    }
}

/// The data are whole even if a thread panicked while it held the lock.
fn lock(orders: &Mutex<Orders>) -> MutexGuard<'_, Orders> {
    orders.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Brings the newest file to the disk whenever that is asked for. It may take long, and holds up nothing.
fn sync_each(orders: &Mutex<Orders>, asked: &Receiver<()>) {
    while asked.recv().is_ok() {
        let file = lock(orders).files.as_ref().map(DayFiles::newest_file);
        let synced = file.transpose().and_then(|it| it.as_ref().map_or(Ok(()), File::sync_data));
        if synced.is_err() {
            lock(orders).is_failing = true;
        }
    }
}

impl Orders {
    fn of(files: Option<DayFiles>) -> Arc<Mutex<Orders>> {
        let number = files.as_ref().map_or(0, DayFiles::newest_number);
        Arc::new(Mutex::new(Orders { files, number, newest_last: VecDeque::new(), lost: 0, is_failing: false }))
    }

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
