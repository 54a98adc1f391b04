//! Recorded missions: what the gateway hears of a vehicle from the start of its mission to the report,
//! in one MCAP file.
//!
//! [`tracks`] decides what belongs to which recording, [`encoder`] makes bytes of it, [`digest`] tells
//! it in short; all of them are pure. A thread of its own, [`writer`], has the files. The node's loop
//! hands it notes through a bounded queue and never waits: what does not fit is dropped and counted.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, channel, sync_channel};
use std::time::Duration;

use domain::time::{Now, Pace};
use kittiwake_proto::topics::Message;
use node::VehicleId;

use crate::recording::config::Config;
use crate::recording::gauges::Gauges;
use crate::recording::shelf::Shelf;
use crate::recording::tracks::{Note, Tracks};
use crate::recording::writer::Desk;

pub mod config;
pub mod digest;
mod download;
pub mod encoder;
pub mod gauges;
pub mod id;
pub mod reading;
pub(crate) mod routes;
pub mod shelf;
pub mod tracks;
pub mod writer;

/// Notes on their way: several seconds' worth.
const CAPACITY: usize = 4096;
/// How long a disk that hangs may hold up the end.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// The node's end.
pub struct Recorder {
    tracks: Tracks,
    notes: Vec<Note>,
    /// Absent where nothing is recorded.
    to_writer: Option<ToWriter>,
}

struct ToWriter {
    /// Taken to end the writer.
    notes: Option<SyncSender<Note>>,
    gauges: Arc<Gauges>,
    /// Closed when everything is written.
    done: Receiver<()>,
}

/// What HTTP shows of recording.
#[derive(Debug, Clone)]
pub(crate) struct Recordings {
    /// How it fares; absent where nothing is recorded.
    pub(crate) gauges: Option<Arc<Gauges>>,
    /// Where the files are; absent where there is no folder.
    pub(crate) shelf: Option<Arc<Shelf>>,
}

impl Recorder {
    /// Records into `folder`, if there is one and the configuration wants it.
    pub(crate) fn start(config: &Config, folder: Option<PathBuf>, pace: Pace) -> (Recorder, Recordings) {
        let wanted = folder.clone().filter(|_| 0 < config.most_files);
        let to_writer = wanted.map(|folder| ToWriter::start(config, folder));
        let gauges = to_writer.as_ref().map(|it| it.gauges.clone());
        let recordings = Recordings { gauges, shelf: folder.map(|it| Arc::new(Shelf::new(it))) };
        (Recorder { tracks: Tracks::new(config, pace), notes: Vec::new(), to_writer }, recordings)
    }

    /// A vehicle said something.
    pub(crate) fn heard(&mut self, now: Now, vehicle: &VehicleId, message: &Message) {
        if let Some(writer) = &self.to_writer {
            self.tracks.heard(now, vehicle, message, &mut self.notes);
            self.notes.drain(..).for_each(|it| writer.pass(it));
        }
    }

    /// Time passes.
    pub(crate) fn tick(&mut self, now: Now) {
        if let Some(writer) = &self.to_writer {
            self.tracks.tick(now.time, &mut self.notes);
            self.notes.drain(..).for_each(|it| writer.pass(it));
        }
    }
}

impl ToWriter {
    fn start(config: &Config, folder: PathBuf) -> ToWriter {
        let gauges = Arc::new(Gauges::default());
        let (notes, to_write) = sync_channel(CAPACITY);
        let (is_done, done) = channel();
        let desk = Desk::new(folder, config.limits(), config.flush_s.seconds(), gauges.clone());
        let spawned = std::thread::Builder::new().name("recorder".into()).spawn(move || {
            writer::run(desk, &to_write);
            drop(is_done);
        });
        if let Err(cause) = spawned {
            gauges.fails(&cause.to_string());
        }
        ToWriter { notes: Some(notes), gauges, done }
    }

    fn pass(&self, note: Note) {
        let bytes = note.bytes();
        if !self.gauges.admit(bytes) {
            return self.gauges.dropped();
        }
        if self.notes.as_ref().is_none_or(|it| it.try_send(note).is_err()) {
            self.gauges.taken(bytes);
            self.gauges.dropped();
        }
    }
}

impl Drop for ToWriter {
    fn drop(&mut self) {
        drop(self.notes.take());
        // Nothing is ever sent: this returns when the writer has ended, or takes too long.
        let _ = self.done.recv_timeout(LAST_WORDS);
    }
}
