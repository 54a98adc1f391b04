//! Records what the mission manager or the planner of a system that flies is given, for `kittiwake replay`.
//!
//! A thread writes it, so that the loop never waits for a disk. A recording that cannot keep up, or whose disk fails, ends there without its
//! end mark, and a replay says up to when it goes; the flight goes on.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;

use domain::file::{Mistakes, Source};
use simulation::recording::file::Writer;
use simulation::recording::{Entry, Header, Sink, trees};

use crate::config::Config;
use crate::output;

/// Entries that wait for the disk: some ten seconds of a flight.
const WAITING: usize = 4096;

/// Where the entries of one process go.
pub struct Inputs {
    path: PathBuf,
    /// `None` once nothing more is written.
    sender: Option<SyncSender<Entry>>,
    thread: Option<JoinHandle<()>>,
    is_whole: Arc<AtomicBool>,
}

/// What stands at the beginning of the recording of a process with this configuration, which was read from `file`.
///
/// # Errors
/// If one of the files cannot be read any more.
pub fn header(config: &Config, file: &Path, instance: u64, tower_key: String) -> Result<Header, Mistakes> {
    let mut paths = vec![
        ("kittiwake.toml".to_owned(), file.to_owned()),
        ("mission.toml".to_owned(), config.mission.clone()),
        ("contingencies.toml".to_owned(), config.contingencies.clone()),
    ];
    paths.extend(trees().map(|name| (format!("trees/{name}"), config.trees.join(name))));
    let read = |(name, path): (String, PathBuf)| Ok((name, Source::read(&path)?.text));
    Ok(Header {
        program: env!("CARGO_PKG_VERSION").to_owned(),
        vehicle: config.vehicle.as_str().to_owned(),
        instance,
        speed: config.speed.pace().speed(),
        tower_key,
        files: paths.into_iter().map(read).collect::<Result<_, Mistakes>>()?,
    })
}

impl Inputs {
    /// Begins the recording of `service` in this folder, which is made if it is missing.
    ///
    /// # Errors
    /// If the file cannot be made, or there is no thread.
    pub fn begin(folder: &Path, service: &str, header: &Header) -> io::Result<Inputs> {
        fs::create_dir_all(folder)?;
        let path = folder.join(format!("{}-{service}-{}.inputs", header.vehicle, header.instance));
        let writer = Writer::begin(BufWriter::new(File::create_new(&path)?), header)?;
        let (sender, receiver) = sync_channel(WAITING);
        let is_whole = Arc::new(AtomicBool::new(true));
        let (of_thread, named) = (is_whole.clone(), path.clone());
        let write = move || {
            if let Err(error) = write(&receiver, writer, &of_thread) {
                output::error_line(format_args!(
                    "{}: cannot be written: {error}; nothing more is recorded",
                    named.display()
                ));
            }
        };
        let thread = std::thread::Builder::new().name("inputs".into()).spawn(write)?;
        Ok(Inputs { path, sender: Some(sender), thread: Some(thread), is_whole })
    }
}

fn write(entries: &Receiver<Entry>, mut writer: Writer<BufWriter<File>>, is_whole: &AtomicBool) -> io::Result<()> {
    while let Ok(entry) = entries.recv() {
        writer.write(&entry)?;
    }
    if is_whole.load(Ordering::Acquire) {
        writer.end()?.flush()?;
    }
    Ok(())
}

impl Sink for Inputs {
    fn take(&mut self, entry: Entry) {
        let Some(sender) = &self.sender else { return };
        match sender.try_send(entry) {
            Ok(()) => {}
            Err(TrySendError::Full(_)) => {
                self.is_whole.store(false, Ordering::Release);
                self.sender = None;
                let path = self.path.display();
                output::error_line(format_args!("{path}: the disk does not keep up; nothing more is recorded"));
            }
            // The thread has said why.
            Err(TrySendError::Disconnected(_)) => self.sender = None,
        }
    }
}

/// The end mark is written before the process ends.
impl Drop for Inputs {
    fn drop(&mut self) {
        self.sender = None;
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has left a recording without its end mark.
            let _ = thread.join();
        }
    }
}
