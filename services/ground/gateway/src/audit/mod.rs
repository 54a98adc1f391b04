//! The audit trail: who ordered what, when, and the outcome; and separately, which requests were refused.
//!
//! An order leaves two lines in a file of its day: one before it is sent, so that no order is without a trace, and one with
//! its outcome. Each line carries the hash of the one before (`chain`); [`verify`] checks that. In memory the newest orders
//! are kept for clients. Requests that were refused go to `refusals`, so that nobody without a token can displace a record.
//!
//! No request accesses a disk here, for one that hangs would hold up every order: records are queued (`orders`), and a
//! thread writes them (`writer`). An order waits for its line, but not for long.

#![expect(clippy::disallowed_methods, reason = "audit records carry UTC, and a disk is waited for on the wall clock")]

use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant, SystemTime};

use kittiwake_proto::json::{to_json, try_to_json};
use kittiwake_proto::v1::{AuditRecord, AuditStage};
use serde_json::Value;
use tokio::time::timeout_at;

use crate::audit::bounds::bounded;
use crate::audit::day_files::DayFiles;
use crate::audit::given::{Given, GivenNumber};
use crate::audit::in_use::InUse;
use crate::audit::orders::{Orders, Writing};
use crate::audit::refusals::Refusals;

mod bounded_file;
mod bounds;
mod chain;
mod day_files;
pub mod found;
#[cfg(test)]
mod full_pipe;
mod given;
pub mod in_use;
mod on_disk;
mod orders;
pub(crate) mod refusals;
#[cfg(test)]
mod tests;
pub mod verify;
mod writer;

/// How long the end of the gateway waits for records that are not written yet: a disk that works takes milliseconds, and one
/// that hangs may do so for ever. The recorder waits after it, and the whole must end within two seconds (`run/end.rs`).
const END_LIMIT: Duration = Duration::from_millis(500);

/// The audit trail and the refusals, shared by every request. Its threads are started with the gateway: where the system gives no more,
/// orders are carried out and recorded all the same.
#[derive(Debug)]
pub struct Audit {
    orders: Arc<Mutex<Orders>>,
    /// Requests that are not orders.
    pub(crate) refusals: Refusals,
}

/// Why there is no audit trail.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// Another gateway writes it.
    #[error(transparent)]
    InUse(#[from] InUse),
    /// This path cannot be read or written, or the system gives no thread that would write there.
    #[error("{path}: {1}", path = .0.display())]
    Unusable(PathBuf, io::Error),
}

impl From<(PathBuf, io::Error)> for OpenError {
    fn from((path, cause): (PathBuf, io::Error)) -> OpenError {
        OpenError::Unusable(path, cause)
    }
}

impl Audit {
    /// In memory only.
    pub fn in_memory() -> Audit {
        Audit { orders: Arc::default(), refusals: Refusals::in_memory() }
    }

    /// In memory only, because the files cannot be used: the gateway says so, and every record counts as lost.
    pub fn failing(path: &Path, cause: &io::Error) -> Audit {
        let audit = Audit::in_memory();
        audit.lock().failing = Some(format!("{}: {cause}", path.display()));
        audit
    }

    /// Goes on with the files in `folder`, of which the newest `most_files` are kept. No other process can, for as long as the value lives.
    ///
    /// # Errors
    /// That another process does already; or the path that cannot be read or written, and why; or that there are no threads for it.
    pub fn open(folder: &Path, most_files: usize) -> Result<Audit, OpenError> {
        let lock = in_use::lock(folder)?;
        // If it cannot be read, `GivenNumber::open` says so.
        let given = if let Ok(Given::Number(number)) = given::in_folder(folder) { number } else { 0 };
        let files = DayFiles::open(folder, most_files, &utc(), given)?;
        let given = GivenNumber::open(folder)?;
        let refusals = Refusals::open(folder)?;
        // Only now: in a folder that cannot be written, the lock is not what matters.
        let lock = lock.inspect_err(|why| {
            let folder = folder.display();
            tracing::warn!("{folder}: a second gateway could write here too, for it cannot be locked: {why}");
        });
        let started = writer::start(files, given, lock.ok());
        let orders = started.map_err(|cause| (folder.to_owned(), cause))?;
        Ok(Audit { orders, refusals })
    }

    /// As [`Audit::open`], but not for longer than `limit`: a disk that takes nothing at the start keeps no gateway from its clients. What
    /// is opened later than that is closed again.
    ///
    /// # Errors
    /// As there; and after `limit`.
    pub fn open_within(folder: &Path, most_files: usize, limit: Duration) -> Result<Audit, OpenError> {
        let path = folder.to_owned();
        within(limit, folder, move || Audit::open(&path, most_files))
    }

    /// Records that an order is about to be carried out, and returns the record's number. A record that cannot be written,
    /// or not soon, does not stop the order: an aircraft is not left without orders because a disk is full or hangs.
    pub(crate) async fn asked(&self, order: &AuditRecord) -> u64 {
        let stage = AuditStage::Asked.into();
        self.add(AuditRecord { stage, ..order.clone() }).await.number
    }

    /// Records what came of the order whose first record has the number `asked`, and returns the record. Who has waited for
    /// it finds it in its file, unless the disk hangs or takes nothing; it is brought to the disk soon.
    pub(crate) async fn ended(&self, asked: u64, order: AuditRecord) -> AuditRecord {
        self.add(AuditRecord { stage: AuditStage::Ended.into(), asked: Some(asked), ..order }).await
    }

    async fn add(&self, record: AuditRecord) -> AuditRecord {
        let record = bounded(record);
        let (record, writing) = self.lock().add(record, Instant::now());
        if let Some(Writing { done, until }) = writing
            && timeout_at(until.into(), done).await.is_err()
        {
            self.lock().gave_up();
        }
        record
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

    /// `ok` or `failing`: also where the file is gone that the next record belongs into, the disk does not answer, or it has failed and not yet
    /// taken a later record.
    pub(crate) fn state(&self) -> &'static str {
        if self.lock().is_failing(Instant::now()) { "failing" } else { "ok" }
    }

    /// What an operator should know of the files: that nothing can be written to them now, and what happened to them since the
    /// gateway was started.
    pub fn problems(&self) -> Vec<String> {
        self.lock().problems(Instant::now())
    }

    /// Has the records written that wait, and waits [`END_LIMIT`] for that. What is recorded afterwards is in memory only.
    pub(crate) fn close(&self) {
        let queue = self.lock().queue.take();
        if queue.is_some_and(|mut it| !it.end_within(END_LIMIT)) {
            let waiting = self.lock().waiting.len();
            tracing::error!("the disk of the audit trail does not answer: {waiting} audit records may not be written");
        }
    }

    fn lock(&self) -> MutexGuard<'_, Orders> {
        lock(&self.orders)
    }
}

impl Drop for Audit {
    fn drop(&mut self) {
        self.close();
    }
}

/// What `open` returns, which may wait for the disk of `folder` for ever.
fn within(
    limit: Duration,
    folder: &Path,
    open: impl FnOnce() -> Result<Audit, OpenError> + Send + 'static,
) -> Result<Audit, OpenError> {
    let unusable = |cause| OpenError::Unusable(folder.to_owned(), cause);
    let (opened, result) = sync_channel(0);
    let opening = std::thread::Builder::new().name("audit-open".into());
    opening.spawn(move || opened.send(open()).is_ok()).map_err(unusable)?;
    result.recv_timeout(limit).unwrap_or_else(|why| {
        Err(unusable(match why {
            RecvTimeoutError::Timeout => io::Error::new(io::ErrorKind::TimedOut, "the disk does not answer"),
            RecvTimeoutError::Disconnected => io::Error::other("opening the audit trail has failed"),
        }))
    })
}

/// The data are whole even if a thread panicked while it held the lock.
fn lock(orders: &Mutex<Orders>) -> MutexGuard<'_, Orders> {
    orders.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// A record as JSON. If its arguments cannot be told, the record is without them: it would not be there at all, nor any after it, if
/// the thread that writes ended.
pub(crate) fn json_of(record: &AuditRecord) -> Value {
    try_to_json(record).unwrap_or_else(|_| to_json(&AuditRecord { arguments: None, ..record.clone() }))
}

/// Now, in RFC 3339 with milliseconds.
pub(crate) fn utc() -> String {
    humantime::format_rfc3339_millis(SystemTime::now()).to_string()
}
