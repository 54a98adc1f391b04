//! Writes recordings into files. [`Writer`] does one job, [`run`] is the loop around it.
//!
//! What cannot be written is counted, reported and tried again after a while. Nobody waits for this thread: a disk that is full, or
//! hangs, costs recordings, and delays the end of the process by a second. What else lies on that disk, such as the audit trail, has to
//! deal with it by itself.

#![expect(clippy::disallowed_methods, reason = "the disk is written to on the wall clock")]

use std::collections::BTreeMap;
use std::fs::{DirBuilder, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use node::VehicleId;

use crate::in_place::is_at;
use crate::recording::capture::{RecordedMessage, RecordingHeader, WriteJob};
use crate::recording::config::Limits;
use crate::recording::encoder::Encoder;
use crate::recording::id::RecordingId;
use crate::recording::index;
use crate::recording::status::WriterStatus;
use crate::recording::summary::Summary;

#[cfg(test)]
mod tests;

/// Wall time after a failure before the next attempt.
const BACK_OFF: Duration = Duration::from_secs(5);
/// Bytes collected in memory after which they are written, even if little time has passed.
const MAX_COLLECTED: usize = 1024 * 1024;
/// Bytes written after which the folder's limits are checked again.
const CHECK_EVERY: u64 = 8 * 1024 * 1024;

/// The recordings that are being written.
pub(crate) struct Writer {
    folder: PathBuf,
    limits: Limits,
    attached: Vec<(String, String)>,
    flush_period: Duration,
    status: Arc<WriterStatus>,
    open: BTreeMap<u64, OpenRecording>,
    /// The recordings in the folder that were begun since the start, in this order.
    begun: Vec<RecordingId>,
    /// Recordings that take no messages, and until when; `None`: for good.
    suspended: BTreeMap<u64, Option<Instant>>,
    /// Bytes written since the folder's limits were checked.
    unchecked: u64,
}

struct OpenRecording {
    vehicle: VehicleId,
    encoder: Encoder,
    summary: Summary,
    path: PathBuf,
    file: File,
    /// Bytes of the file.
    bytes: u64,
    /// Bytes of the file before its first message.
    head_bytes: u64,
    /// Bytes in memory that are not written yet.
    collected: usize,
    flush_due: Instant,
}

/// Does jobs until there are no more to come, then completes every recording.
pub(crate) fn run(mut writer: Writer, jobs: &Receiver<WriteJob>) {
    loop {
        let wait = writer.due().map_or(BACK_OFF, |due| due.saturating_duration_since(Instant::now()));
        match jobs.recv_timeout(wait) {
            Ok(job) => {
                writer.status.taken(job.bytes());
                writer.on(job, Instant::now());
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return writer.end_all(),
        }
        writer.flush_due(Instant::now());
    }
}

impl Writer {
    /// No recording is open yet, and the folder need not exist.
    pub(crate) fn new(folder: PathBuf, limits: Limits, flush_period: Duration, status: Arc<WriterStatus>) -> Writer {
        let (open, begun, suspended) = (BTreeMap::new(), Vec::new(), BTreeMap::new());
        Writer { folder, limits, attached: Vec::new(), flush_period, status, open, begun, suspended, unchecked: 0 }
    }

    /// Puts these files, name and text, into each recording.
    pub(crate) fn attaching(self, files: &[(String, String)]) -> Writer {
        Writer { attached: files.to_vec(), ..self }
    }

    /// Does a job.
    fn on(&mut self, job: WriteJob, now: Instant) {
        match job {
            WriteJob::Message(header, message) => {
                if !self.is_suspended(header.number, now) && self.is_open(&header, now) {
                    self.add(header.number, &message, now);
                } else {
                    self.status.count_dropped();
                }
            }
            WriteJob::End(header) => {
                self.end(header.number, now);
                self.suspended.remove(&header.number);
            }
        }
    }

    /// Writes what has been collected for long enough.
    fn flush_due(&mut self, now: Instant) {
        let due = self.open.iter().filter(|(_, recording)| recording.flush_due <= now);
        let due: Vec<u64> = due.map(|(number, _)| *number).collect();
        due.into_iter().for_each(|number| self.flush(number, now));
    }

    /// When [`Writer::flush_due`] has something to do.
    fn due(&self) -> Option<Instant> {
        self.open.values().map(|recording| recording.flush_due).min()
    }

    fn is_suspended(&self, number: u64, now: Instant) -> bool {
        self.suspended.get(&number).is_some_and(|until| until.is_none_or(|until| now < until))
    }

    /// Opens the recording if it is not open; false if that fails.
    fn is_open(&mut self, header: &RecordingHeader, now: Instant) -> bool {
        if self.open.contains_key(&header.number) {
            return true;
        }
        // Recordings of the vehicle whose end was lost on the way.
        let earlier = self.open.iter().filter(|(_, recording)| recording.vehicle == header.vehicle);
        let earlier: Vec<u64> = earlier.map(|(number, _)| *number).collect();
        earlier.into_iter().for_each(|number| self.end(number, now));
        match self.begin(header, now) {
            Ok(open) => {
                let begun = RecordingId::of_file(&open.path);
                // A name is given again after its file was removed.
                self.begun.retain(|id| Some(id) != begun.as_ref());
                self.begun.extend(begun);
                self.open.insert(header.number, open);
                self.check_limits();
                true
            }
            Err(cause) => {
                self.fail(header.number, &cause, now);
                false
            }
        }
    }

    fn begin(&self, header: &RecordingHeader, now: Instant) -> io::Result<OpenRecording> {
        DirBuilder::new().recursive(true).mode(0o700).create(&self.folder)?;
        let (path, mut file) = self.create(header)?;
        let summary = Summary::of(&header.vehicle);
        let mut metadata = summary.metadata();
        // With these a reader converts the time at which a message arrived into mission time.
        metadata.insert("speed".into(), header.speed.to_string());
        metadata.insert("missionTimeS".into(), header.began.time.as_secs_f64().to_string());
        metadata.insert("utc".into(), crate::view::utc(header.began.utc_ms));
        let mut encoder = Encoder::new(metadata).map_err(io::Error::other)?;
        for (name, text) in &self.attached {
            encoder.attach(name, text, header.began.utc_ms).map_err(io::Error::other)?;
        }
        let head = encoder.take_bytes().map_err(io::Error::other)?;
        // Held while the file is open: it says that the file is being written. On a file system without locks the
        // recording is shown as damaged until it is complete.
        let _ = file.lock();
        if let Err(cause) = file.write_all(&head) {
            // A file without messages is of no use; one that cannot be removed is shown as damaged.
            let _ = std::fs::remove_file(&path);
            return Err(cause);
        }
        let (vehicle, bytes, flush_due) = (header.vehicle.clone(), head.len() as u64, now + self.flush_period);
        Ok(OpenRecording { vehicle, encoder, summary, path, file, bytes, head_bytes: bytes, collected: 0, flush_due })
    }

    /// A file that did not exist before.
    fn create(&self, header: &RecordingHeader) -> io::Result<(PathBuf, File)> {
        let mut attempt = 1;
        loop {
            let path = RecordingId::of(header, attempt).path_in(&self.folder);
            match OpenOptions::new().write(true).create_new(true).mode(0o600).open(&path) {
                Err(cause) if cause.kind() == io::ErrorKind::AlreadyExists && attempt < 100 => attempt += 1,
                opened => return Ok((path, opened?)),
            }
        }
    }

    fn add(&mut self, number: u64, message: &RecordedMessage, now: Instant) {
        let Some(open) = self.open.get_mut(&number) else { return };
        open.summary.on_message(message.topic, message.utc_ms, &message.bytes);
        if let Err(cause) = open.encoder.add(message) {
            return self.fail(number, &io::Error::other(cause), now);
        }
        open.collected += message.bytes.len() + 1;
        if MAX_COLLECTED <= open.collected {
            self.flush(number, now);
        }
    }

    fn flush(&mut self, number: u64, now: Instant) {
        let Some(open) = self.open.get_mut(&number) else { return };
        open.flush_due = now + self.flush_period;
        if std::mem::take(&mut open.collected) == 0 {
            return;
        }
        if !is_at(&open.file, &open.path) {
            return self.begin_again(number);
        }
        let bytes = open.encoder.take_bytes().map_err(io::Error::other);
        let before = open.bytes;
        if let Err(cause) = bytes.and_then(|bytes| write(&mut open.file, &mut open.bytes, &bytes)) {
            return self.fail(number, &cause, now);
        }
        self.status.recovered();
        self.unchecked += open.bytes - before;
        if self.limits.each <= open.bytes {
            self.end(number, now);
            self.suspended.insert(number, None);
        }
        if CHECK_EVERY <= self.unchecked {
            self.check_limits();
        }
    }

    /// Completes a recording.
    fn end(&mut self, number: u64, now: Instant) {
        let Some(mut open) = self.open.remove(&number) else { return };
        if !is_at(&open.file, &open.path) {
            return self.lost(&open);
        }
        let metadata = open.summary.metadata();
        let last = open.encoder.finish(metadata).map_err(io::Error::other);
        if let Err(cause) = last.and_then(|bytes| write(&mut open.file, &mut open.bytes, &bytes)) {
            self.fail(number, &cause, now);
        }
    }

    fn end_all(&mut self) {
        let all: Vec<u64> = self.open.keys().copied().collect();
        all.into_iter().for_each(|number| self.end(number, Instant::now()));
    }

    /// Gives up a recording whose file was removed, renamed or replaced: its next message begins another one.
    fn begin_again(&mut self, number: u64) {
        if let Some(open) = self.open.remove(&number) {
            self.lost(&open);
        }
    }

    fn lost(&self, open: &OpenRecording) {
        let why = format!("{}: was removed, renamed or replaced while it was written to", open.path.display());
        if self.status.failed(&why) {
            tracing::error!("{why}; the rest of the mission is recorded in a new file");
        }
    }

    /// Leaves a recording as it is for now.
    fn fail(&mut self, number: u64, cause: &io::Error, now: Instant) {
        if let Some(open) = self.open.remove(&number)
            && open.bytes == open.head_bytes
            && is_at(&open.file, &open.path)
        {
            // Files without messages, one from each attempt, would displace recordings that have some.
            let _ = std::fs::remove_file(open.path);
        }
        self.suspended.insert(number, Some(now + BACK_OFF));
        if self.status.failed(&cause.to_string()) {
            tracing::error!(folder = %self.folder.display(), %cause, "missions cannot be recorded");
        }
    }

    fn check_limits(&mut self) {
        self.unchecked = 0;
        if let Err(cause) = index::make_room(&self.folder, self.limits, &self.begun)
            && self.status.failed(&cause.to_string())
        {
            tracing::error!(folder = %self.folder.display(), %cause, "old recordings cannot be removed");
        }
        self.begun.retain(|id| id.path_in(&self.folder).exists());
    }
}

/// All of the bytes or none: a part that was written is taken back, so that the file can be read to its end.
fn write(file: &mut File, written: &mut u64, bytes: &[u8]) -> io::Result<()> {
    if let Err(cause) = file.write_all(bytes) {
        // Fails only where the file is lost anyway.
        let _ = file.set_len(*written);
        return Err(cause);
    }
    *written += bytes.len() as u64;
    Ok(())
}
