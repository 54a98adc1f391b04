//! The thread that writes the audit trail: the only one that accesses its files once the gateway runs, but for the one that
//! has them brought to the disk.
//!
//! Either may stand still for as long as a disk does. What is recorded meanwhile waits in memory, in order.

use std::fs::File;
use std::io;
#[cfg(test)]
use std::sync::mpsc::SyncSender;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use kittiwake_proto::v1::AuditRecord;
use regular_file::DiskThread;
use tokio::sync::oneshot;

use super::day_files::{DayFiles, sync};
use super::given::GivenNumber;
use super::lock;
use super::on_disk::OnDisk;
use super::orders::{MAX_WAITING, Orders, Seen};

/// Where there is nothing to write, the files are looked at this often: whether they are gone is known before the next order.
pub(super) const LOOK_PERIOD: Duration = Duration::from_secs(1);

/// What the writer has to do.
pub(super) enum Job {
    /// Write a record, and say when that is done.
    Write(AuditRecord, oneshot::Sender<()>),
    /// Do something with the files, and say when that is done.
    #[cfg(test)]
    Change(Box<dyn FnOnce(&mut DayFiles) + Send>, SyncSender<()>),
}

/// What the disk is asked to take.
pub(super) struct Unsynced {
    /// The number of the newest record in the files.
    pub(super) number: u64,
    /// The file of the number that was given last, and those of the records, oldest first.
    pub(super) files: Vec<File>,
}

/// The files of the audit trail.
pub(super) struct Writer {
    orders: Arc<Mutex<Orders>>,
    files: DayFiles,
    given: GivenNumber,
    /// The number that `given` has. After the start it is the newest one, also if `given` has none: that stays so until the next
    /// record.
    given_number: u64,
    /// What is to be brought to the disk goes here.
    to_sync: DiskThread<Unsynced>,
    /// A record was written since. So is what there is at the start: the gateway before may have been killed.
    is_unsynced: bool,
    /// Keeps other gateways away: also from files that a writer hangs in whose gateway has ended.
    _lock_file: Option<File>,
}

/// Starts the threads for files that were opened. Returns what requests use.
///
/// # Errors
/// When the system gives no threads.
pub(super) fn start(
    files: DayFiles,
    (mut given, given_number): (GivenNumber, u64),
    lock_file: Option<File>,
) -> io::Result<Arc<Mutex<Orders>>> {
    let written = files.newest_number();
    if 0 < given_number && given_number < written {
        // The record of a line that was cut off has just been written. A number that is missing or garbled stays so until the
        // next order, for `verify` to find.
        let _ = given.set(written);
    }
    let number = given_number.max(written);
    let on_disk = OnDisk::after(written);
    let orders = Arc::new(Mutex::new(Orders { number, on_disk, ..Orders::default() }));
    // One that waits is enough: what is written meanwhile is brought to the disk with it.
    let of_sync = orders.clone();
    let to_sync = DiskThread::start("audit-sync", 1, Duration::ZERO, move |it| sync_each(&of_sync, &it))?;
    let writer = Writer {
        orders: orders.clone(),
        files,
        given,
        given_number: number,
        to_sync,
        is_unsynced: true,
        _lock_file: lock_file,
    };
    let queue = DiskThread::start("audit", MAX_WAITING, Duration::ZERO, move |jobs| writer.run(&jobs))?;
    lock(&orders).queue = Some(queue);
    Ok(orders)
}

impl Writer {
    /// Writes until there are no more records to come.
    fn run(mut self, jobs: &Receiver<Job>) {
        loop {
            match jobs.recv_timeout(LOOK_PERIOD) {
                Ok(Job::Write(record, written)) => {
                    self.write(&record);
                    // Its order may have gone on.
                    let _ = written.send(());
                    self.is_unsynced = true;
                    self.sync();
                }
                #[cfg(test)]
                Ok(Job::Change(change, done)) => {
                    change(&mut self.files);
                    self.look();
                    let _ = done.send(());
                }
                Err(RecvTimeoutError::Timeout) => {
                    self.look();
                    self.sync();
                }
                Err(RecvTimeoutError::Disconnected) => {
                    self.look();
                    return self.sync();
                }
            }
        }
    }

    fn write(&mut self, record: &AuditRecord) {
        // Where that fails the record below fails as well, or says the number itself; or a later look tries again.
        if self.given.set(record.number).is_ok() {
            self.given_number = record.number;
        }
        let written = self.files.append(record).map_err(|cause| cause.to_string());
        let seen = self.seen();
        lock(&self.orders).written(record.number, written, seen);
    }

    fn look(&mut self) {
        let number = {
            let mut orders = lock(&self.orders);
            orders.looking_since = Some(Instant::now());
            orders.number
        };
        // Those in between had no room in the queue, or the disk did not take them. After the end of the trail, nothing else would say that they
        // are missing.
        if self.given_number < number && self.given.set(number).is_ok() {
            self.given_number = number;
        }
        let seen = self.seen();
        let mut orders = lock(&self.orders);
        (orders.looking_since, orders.seen) = (None, seen);
    }

    fn seen(&self) -> Seen {
        let gone = (!self.files.is_in_place()).then(|| self.files.newest_path().to_owned());
        Seen { gone, replaced: self.files.lost().map(ToOwned::to_owned) }
    }

    /// Has what was recorded brought to the disk soon, without waiting for it.
    fn sync(&mut self) {
        if self.is_unsynced {
            // Without descriptors for them the disk has not failed: the next look tries again.
            let asked = self.unsynced().map(|it| self.is_unsynced = self.to_sync.hand_over(it).is_err());
            if !self.is_unsynced {
                self.files.close_former();
            }
            lock(&self.orders).on_disk.asked(asked.map_err(|cause| cause.to_string()));
        }
    }

    /// What there is in the files now.
    fn unsynced(&self) -> io::Result<Unsynced> {
        // The number first: of a record that a loss of power takes it says that it is missing.
        let given = self.given.file()?;
        let files = std::iter::once(given).chain(self.files.unsynced()?).collect();
        Ok(Unsynced { number: self.files.newest_number(), files })
    }
}

/// Brings the files to the disk. It may take long, and holds up nothing.
pub(super) fn sync_each(orders: &Mutex<Orders>, unsynced: &Receiver<Unsynced>) {
    for Unsynced { number, files } in unsynced {
        // All of them, whatever becomes of the first.
        let synced = files.iter().map(sync).fold(Ok(()), Result::and);
        let mut orders = lock(orders);
        match synced {
            Ok(()) => orders.on_disk.taken(number),
            Err(cause) => orders.on_disk.failed(cause.to_string()),
        }
    }
}
