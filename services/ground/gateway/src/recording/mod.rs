//! Recorded missions: the messages of a vehicle that the gateway receives from the start of its mission to the report,
//! in one MCAP file.
//!
//! [`capture`] decides which message belongs to which recording, [`encoder`] encodes it, [`summary`] summarises a
//! mission; all three are pure. A thread of its own, [`writer`], owns the files. The node's loop passes it jobs through
//! a bounded queue and never waits: a message that does not fit is dropped and counted.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use domain::time::{Now, Pace};
use kittiwake_proto::topics::Message;
use node::VehicleId;
use regular_file::DiskThread;

use crate::recording::capture::{Captures, WriteJob};
use crate::recording::config::Config;
use crate::recording::index::RecordingIndex;
use crate::recording::status::WriterStatus;
use crate::recording::writer::Writer;

pub(crate) mod capture;
pub(crate) mod config;
pub(crate) mod download;
pub(crate) mod encoder;
mod foxglove;
mod id;
pub(crate) mod index;
pub(crate) mod reading;
pub(crate) mod refill;
pub(crate) mod routes;
pub(crate) mod status;
mod summary;
mod writer;

/// The most jobs that wait for the writer: those of several seconds.
const CAPACITY: usize = 4096;
/// A disk that hangs delays the end of the process by no more than this.
const END_LIMIT: Duration = Duration::from_secs(1);

/// The node's end.
pub(crate) struct Recorder {
    captures: Captures,
    jobs: Vec<WriteJob>,
    /// Absent where nothing is recorded.
    writer: Option<WriterThread>,
}

struct WriterThread {
    /// Absent where the system gives no thread; the status says so.
    thread: Option<DiskThread<WriteJob>>,
    status: Arc<WriterStatus>,
}

/// What HTTP shows of recordings.
#[derive(Debug, Clone)]
pub(crate) struct Recordings {
    /// Absent where nothing is recorded.
    pub(crate) writer: Option<Arc<WriterStatus>>,
    /// Absent where there is no folder.
    pub(crate) index: Option<Arc<RecordingIndex>>,
}

impl Recorder {
    /// Records into the configured folder, if there is one and recordings are wanted.
    pub(crate) fn start(config: &Config, pace: Pace) -> (Recorder, Recordings) {
        let wanted = config.folder.clone().filter(|_| 0 < config.most_files);
        let writer = wanted.map(|folder| WriterThread::start(config, folder));
        let recordings = Recordings {
            writer: writer.as_ref().map(|writer| writer.status.clone()),
            index: config.folder.clone().map(|folder| Arc::new(RecordingIndex::new(folder))),
        };
        (Recorder { captures: Captures::new(config, pace), jobs: Vec::new(), writer }, recordings)
    }

    /// A message of a vehicle arrived.
    pub(crate) fn on_message(&mut self, now: Now, vehicle: &VehicleId, message: &Message) {
        if let Some(writer) = &self.writer {
            self.captures.on_message(now, vehicle, message, &mut self.jobs);
            self.jobs.drain(..).for_each(|job| writer.pass(job));
        }
    }

    /// Why nothing is recorded now although it is to; `None` while it is, or where nothing is to be recorded.
    pub(crate) fn trouble(&self) -> Option<String> {
        self.writer.as_ref().and_then(|writer| writer.status.problem())
    }

    /// Time passes.
    pub(crate) fn tick(&mut self, now: Now) {
        if let Some(writer) = &self.writer {
            self.captures.tick(now.time, &mut self.jobs);
            self.jobs.drain(..).for_each(|job| writer.pass(job));
        }
    }
}

impl WriterThread {
    fn start(config: &Config, folder: PathBuf) -> WriterThread {
        let status = Arc::new(WriterStatus::default());
        let writer =
            Writer::new(folder, config.limits(), config.flush_s.seconds(), status.clone()).attaching(&config.attached);
        let started = DiskThread::start("recorder", CAPACITY, END_LIMIT, move |jobs| writer::run(writer, &jobs));
        let thread = started.inspect_err(|cause| {
            status.failed(&cause.to_string());
        });
        WriterThread { thread: thread.ok(), status }
    }

    fn pass(&self, job: WriteJob) {
        let bytes = job.bytes();
        if !self.status.admit(bytes) {
            return self.status.count_dropped();
        }
        if self.thread.as_ref().is_none_or(|it| it.hand_over(job).is_err()) {
            self.status.taken(bytes);
            self.status.count_dropped();
        }
    }
}
