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
use crate::audit::given::{Given, GivenNumber};
use crate::audit::in_use::InUse;
use crate::audit::refusals::Refusals;

mod chain;
mod day_files;
pub mod found;
mod given;
pub mod in_use;
pub(crate) mod refusals;
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
    /// Keeps other gateways away from the files.
    _lock: Option<File>,
}

/// Why there is no audit trail.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// Another gateway writes it.
    #[error(transparent)]
    InUse(#[from] InUse),
    /// This path cannot be read or written.
    #[error("{path}: {1}", path = .0.display())]
    Unusable(PathBuf, io::Error),
}

impl From<(PathBuf, io::Error)> for OpenError {
    fn from((path, cause): (PathBuf, io::Error)) -> OpenError {
        OpenError::Unusable(path, cause)
    }
}

#[derive(Debug)]
struct Orders {
    /// Absent where nothing is kept.
    files: Option<DayFiles>,
    /// The number of the newest record, and where it outlives the gateway.
    number: u64,
    given: Option<GivenNumber>,
    newest_last: VecDeque<AuditRecord>,
    /// Records that could not be written.
    lost: u64,
    /// Why the last record could not be written, or not be brought to the disk.
    failing: Option<String>,
}

impl Audit {
    /// In memory only.
    pub fn in_memory() -> Audit {
        Audit { orders: Orders::of(None, None), sync: None, refusals: Refusals::in_memory(), _lock: None }
    }

    /// In memory only, because the files cannot be used: that is told, and every record counts as lost.
    pub fn failing(path: &Path, cause: &io::Error) -> Audit {
        let audit = Audit::in_memory();
        audit.lock().failing = Some(format!("{}: {cause}", path.display()));
        audit
    }

    /// Goes on with the files in `folder`, of which the newest `most_files` are kept. No other process can, for as long as the value lives.
    ///
    /// # Errors
    /// That another process does already; or the path that cannot be read or written, and why.
    pub fn open(folder: &Path, most_files: usize) -> Result<Audit, OpenError> {
        let lock = in_use::lock(folder)?;
        // If it cannot be read, `GivenNumber::open` says so.
        let given = if let Ok(Given::Number(number)) = given::in_folder(folder) { number } else { 0 };
        let files = DayFiles::open(folder, most_files, &utc(), given)?;
        let orders = Orders::of(Some(files), Some(GivenNumber::open(folder)?));
        let refusals = Refusals::open(folder)?;
        // One that waits is enough: what is asked for meanwhile is brought to the disk with it.
        let (sync, asked) = sync_channel(1);
        let of_thread = orders.clone();
        let thread = std::thread::Builder::new().name("audit".into()).spawn(move || sync_each(&of_thread, &asked));
        thread.map_err(|cause| (folder.to_owned(), cause))?;
        // Only now: in a folder that cannot be written, the lock is not what matters.
        let lock = lock.inspect_err(|why| {
            let folder = folder.display();
            tracing::warn!("{folder}: a second gateway could write here too, for it cannot be locked: {why}");
        });
        Ok(Audit { orders, sync: Some(sync), refusals, _lock: lock.ok() })
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
        if orders.failing.is_some() || is_gone { "failing" } else { "ok" }
    }

    /// What an operator should know of the files: that nothing can be written to them now, and what happened to them since the
    /// gateway was started.
    pub fn problems(&self) -> Vec<String> {
        let orders = self.lock();
        let failing = orders.failing.as_ref().map(|cause| {
            let lost = orders.lost;
            format!("gateway: orders are carried out without a record: {cause} (audit records lost so far: {lost})")
        });
        let Some(files) = &orders.files else { return failing.into_iter().collect() };
        let is_gone = failing.is_none() && !files.is_in_place();
        let gone = is_gone.then(|| {
            format!("gateway: {} is gone, which the next order is to be recorded in", files.newest_path().display())
        });
        let lost = files.lost().map(|lost| {
            let lost = lost.display();
            format!(
                "gateway: {lost} was removed, renamed or replaced while orders were recorded in it; its records are \
                 missing there unless it was renamed, the chain goes on in a new file"
            )
        });
        failing.into_iter().chain(gone).chain(lost).collect()
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
        if let Err(cause) = synced {
            lock(orders).failing = Some(cause.to_string());
        }
    }
}

impl Orders {
    fn of(files: Option<DayFiles>, given: Option<(GivenNumber, u64)>) -> Arc<Mutex<Orders>> {
        let written = files.as_ref().map_or(0, DayFiles::newest_number);
        let (given, number) = given.map_or((None, written), |(mut file, given)| {
            if 0 < given && given < written {
                // The record of a line that was cut off has just been written. A number that is missing or garbled stays so until the
                // next order, for `verify` to find.
                let _ = file.set(written);
            }
            (Some(file), given.max(written))
        });
        Arc::new(Mutex::new(Orders { files, number, given, newest_last: VecDeque::new(), lost: 0, failing: None }))
    }

    fn add(&mut self, record: AuditRecord) -> u64 {
        self.number += 1;
        let record = AuditRecord { utc: utc(), number: self.number, ..record };
        // Where that fails the record below fails as well, or says the number itself.
        let _ = self.given.as_mut().map(|it| it.set(self.number));
        if let Some(files) = &mut self.files {
            let written = files.append(&record);
            if let Err(cause) = &written
                && self.failing.is_none()
            {
                tracing::error!("audit records cannot be written: {cause}; orders are carried out all the same");
            }
            self.lost += u64::from(written.is_err());
            self.failing = written.err().map(|cause| cause.to_string());
        } else if self.failing.is_some() {
            self.lost += 1;
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
