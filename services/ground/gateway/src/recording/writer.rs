//! Writes notes into files. [`Desk`] does what each note says, [`run`] is the loop around it.
//!
//! What cannot be written is counted and told, tried again after a while, and stops nothing: a disk
//! that is full, or hangs, costs recordings only.

use std::collections::BTreeMap;
use std::fs::{DirBuilder, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use node::VehicleId;

use crate::recording::config::Limits;
use crate::recording::digest::Digest;
use crate::recording::encoder::Encoder;
use crate::recording::gauges::Gauges;
use crate::recording::id::Id;
use crate::recording::shelf;
use crate::recording::tracks::{Entry, Note, Take};

/// Wall time after a failure before the next try.
const REST: Duration = Duration::from_secs(5);
/// What is collected is written before it takes more memory than this, however little time has passed.
const MOST_COLLECTED: usize = 1024 * 1024;
/// Whether there is too much in the folder is looked at again after so much was written.
const LOOK_EVERY: u64 = 8 * 1024 * 1024;

/// The recordings that are being written.
pub struct Desk {
    folder: PathBuf,
    limits: Limits,
    flush: Duration,
    gauges: Arc<Gauges>,
    open: BTreeMap<u64, Open>,
    /// Recordings that take nothing in, and until when; `None`: for good.
    resting: BTreeMap<u64, Option<Instant>>,
    since_look: u64,
}

struct Open {
    vehicle: VehicleId,
    encoder: Encoder,
    digest: Digest,
    path: PathBuf,
    file: File,
    /// Of the file, and of it while there is no message in it.
    bytes: u64,
    head: u64,
    /// Not written yet.
    collected: usize,
    due: Instant,
}

/// Does what the notes say until there are no more to come, then ends every recording.
pub fn run(mut desk: Desk, notes: &Receiver<Note>) {
    loop {
        let wait = desk.due().map_or(REST, |it| it.saturating_duration_since(Instant::now()));
        match notes.recv_timeout(wait) {
            Ok(note) => {
                desk.gauges.taken(note.bytes());
                desk.on(note, Instant::now());
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return desk.end_all(),
        }
        desk.flush_due(Instant::now());
    }
}

impl Desk {
    /// Nothing is open yet, and the folder need not be there.
    pub fn new(folder: PathBuf, limits: Limits, flush: Duration, gauges: Arc<Gauges>) -> Desk {
        Desk { folder, limits, flush, gauges, open: BTreeMap::new(), resting: BTreeMap::new(), since_look: 0 }
    }

    /// Does what a note says.
    pub fn on(&mut self, note: Note, now: Instant) {
        match note {
            Note::Entry(take, entry) => {
                if !self.is_resting(take.number, now) && self.is_open(&take, now) {
                    self.add(take.number, &entry, now);
                } else {
                    self.gauges.dropped();
                }
            }
            Note::End(take) => {
                self.end(take.number, now);
                self.resting.remove(&take.number);
            }
        }
    }

    /// Writes what has been collected for long enough.
    pub fn flush_due(&mut self, now: Instant) {
        let due: Vec<u64> = self.open.iter().filter(|(_, it)| it.due <= now).map(|(number, _)| *number).collect();
        due.into_iter().for_each(|it| self.flush(it, now));
    }

    /// When [`Desk::flush_due`] has something to do.
    fn due(&self) -> Option<Instant> {
        self.open.values().map(|it| it.due).min()
    }

    fn is_resting(&self, number: u64, now: Instant) -> bool {
        self.resting.get(&number).is_some_and(|until| until.is_none_or(|it| now < it))
    }

    /// Opens the recording if it is not open; false if that fails.
    fn is_open(&mut self, take: &Take, now: Instant) -> bool {
        if self.open.contains_key(&take.number) {
            return true;
        }
        // One whose end was lost on the way.
        let before = self.open.iter().filter(|(_, it)| it.vehicle == take.vehicle).map(|(number, _)| *number);
        before.collect::<Vec<_>>().into_iter().for_each(|it| self.end(it, now));
        match self.begin(take, now) {
            Ok(open) => {
                self.open.insert(take.number, open);
                self.look();
                true
            }
            Err(cause) => {
                self.fail(take.number, &cause, now);
                false
            }
        }
    }

    fn begin(&self, take: &Take, now: Instant) -> io::Result<Open> {
        DirBuilder::new().recursive(true).mode(0o700).create(&self.folder)?;
        let (path, mut file) = self.create(take)?;
        let digest = Digest::of(&take.vehicle);
        let mut known = digest.known();
        // To make mission time of the time at which a message came.
        known.insert("speed".into(), take.speed.to_string());
        known.insert("missionTimeS".into(), take.began.time.as_secs_f64().to_string());
        known.insert("utc".into(), crate::view::utc(take.began.utc_ms));
        let mut encoder = Encoder::new(known).map_err(io::Error::other)?;
        let head = encoder.take_bytes().map_err(io::Error::other)?;
        // Held while the file is open: says that it is being written. On a file system without locks it
        // is shown as damaged until it is complete.
        let _ = file.lock();
        if let Err(cause) = file.write_all(&head) {
            // Of no use to anybody; what cannot be removed is shown as damaged.
            let _ = std::fs::remove_file(&path);
            return Err(cause);
        }
        let (vehicle, head) = (take.vehicle.clone(), head.len() as u64);
        let due = now + self.flush;
        Ok(Open { vehicle, encoder, digest, path, file, bytes: head, head, collected: 0, due })
    }

    /// A file that was not there before.
    fn create(&self, take: &Take) -> io::Result<(PathBuf, File)> {
        let mut attempt = 1;
        loop {
            let path = Id::of(take, attempt).path_in(&self.folder);
            match OpenOptions::new().write(true).create_new(true).mode(0o600).open(&path) {
                Err(cause) if cause.kind() == io::ErrorKind::AlreadyExists && attempt < 100 => attempt += 1,
                opened => return Ok((path, opened?)),
            }
        }
    }

    fn add(&mut self, number: u64, entry: &Entry, now: Instant) {
        let Some(open) = self.open.get_mut(&number) else { return };
        open.digest.on(entry.topic, entry.utc_ms, &entry.bytes);
        if let Err(cause) = open.encoder.add(entry) {
            return self.fail(number, &io::Error::other(cause), now);
        }
        open.collected += entry.bytes.len() + 1;
        if MOST_COLLECTED <= open.collected {
            self.flush(number, now);
        }
    }

    fn flush(&mut self, number: u64, now: Instant) {
        let Some(open) = self.open.get_mut(&number) else { return };
        open.due = now + self.flush;
        if std::mem::take(&mut open.collected) == 0 {
            return;
        }
        let bytes = open.encoder.take_bytes().map_err(io::Error::other);
        let before = open.bytes;
        if let Err(cause) = bytes.and_then(|it| write(&mut open.file, &mut open.bytes, &it)) {
            return self.fail(number, &cause, now);
        }
        self.gauges.works();
        self.since_look += open.bytes - before;
        if self.limits.each <= open.bytes {
            self.end(number, now);
            self.resting.insert(number, None);
        }
        if LOOK_EVERY <= self.since_look {
            self.look();
        }
    }

    /// Completes a recording.
    fn end(&mut self, number: u64, now: Instant) {
        let Some(mut open) = self.open.remove(&number) else { return };
        let known = open.digest.known();
        let last = open.encoder.finish(known).map_err(io::Error::other);
        if let Err(cause) = last.and_then(|it| write(&mut open.file, &mut open.bytes, &it)) {
            self.fail(number, &cause, now);
        }
    }

    fn end_all(&mut self) {
        let all: Vec<u64> = self.open.keys().copied().collect();
        all.into_iter().for_each(|it| self.end(it, Instant::now()));
    }

    /// Leaves a recording as it is for now.
    fn fail(&mut self, number: u64, cause: &io::Error, now: Instant) {
        if let Some(open) = self.open.remove(&number)
            && open.bytes == open.head
        {
            // Without a message: one left by each try would push out the recordings that have some.
            let _ = std::fs::remove_file(open.path);
        }
        self.resting.insert(number, Some(now + REST));
        if self.gauges.fails(&cause.to_string()) {
            tracing::error!(folder = %self.folder.display(), %cause, "missions cannot be recorded");
        }
    }

    fn look(&mut self) {
        self.since_look = 0;
        if let Err(cause) = shelf::make_room(&self.folder, self.limits)
            && self.gauges.fails(&cause.to_string())
        {
            tracing::error!(folder = %self.folder.display(), %cause, "old recordings cannot be removed");
        }
    }
}

/// All of it or nothing: what is half written is taken back, so that the file can be read to its end.
fn write(file: &mut File, written: &mut u64, bytes: &[u8]) -> io::Result<()> {
    if let Err(cause) = file.write_all(bytes) {
        // Fails only where the file is lost anyway.
        let _ = file.set_len(*written);
        return Err(cause);
    }
    *written += bytes.len() as u64;
    Ok(())
}
