//! Records what the mission manager or the planner of a system that flies is given, for `kittiwake replay`.
//!
//! A thread makes the file and writes it, so that neither the start nor the loop waits for a disk. A recording that cannot be begun, cannot
//! keep up, or whose disk fails, ends there without its end mark, and a replay says up to when it goes; the flight goes on.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SendError, sync_channel};
use std::time::Duration;

use domain::file::{Mistakes, Source};
use regular_file::{DiskThread, NotTaken};
use simulation::recording::file::Writer;
use simulation::recording::{Entry, Header, Sink, skills, trees};

use crate::config::Config;
use crate::output;

/// Entries that wait for the disk: some ten seconds of a flight.
const WAITING: usize = 4096;
/// A disk that has not answered for this long has refused nothing, and is awaited no longer.
const OPEN_LIMIT: Duration = Duration::from_secs(2);
/// The last entries are awaited this long when the process ends.
const END_LIMIT: Duration = Duration::from_secs(1);

/// A file that has its header.
type Recording = Writer<BufWriter<fs::File>>;

/// Where the entries of one process go.
pub struct Inputs {
    path: PathBuf,
    thread: DiskThread<Entry>,
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
    let mut files = paths.into_iter().map(read).collect::<Result<Vec<_>, Mistakes>>()?;
    files.extend(skills(&config.skills)?);
    Ok(Header {
        program: env!("CARGO_PKG_VERSION").to_owned(),
        vehicle: config.vehicle.as_str().to_owned(),
        instance,
        speed: config.speed.pace().speed(),
        tower_key,
        files,
    })
}

impl Inputs {
    /// Begins the recording of `service` in this folder, which is made if it is missing. Unless that `is_awaited`, and the disk answers
    /// in time, it is not known here whether there will be one: the thread says if not.
    ///
    /// # Errors
    /// If there is no thread, or if it is awaited and the file is known not to be possible.
    pub fn begin(folder: &Path, service: &str, header: Header, is_awaited: bool) -> io::Result<Inputs> {
        let path = folder.join(format!("{}-{service}-{}.inputs", header.vehicle, header.instance));
        let file = path.clone();
        let open = move || {
            if let Some(folder) = file.parent() {
                fs::create_dir_all(folder)?;
            }
            Writer::begin(BufWriter::new(fs::File::create_new(&file)?), &header)
        };
        Inputs::start(path, open, is_awaited)
    }

    fn start(
        path: PathBuf,
        open: impl FnOnce() -> io::Result<Recording> + Send + 'static,
        is_awaited: bool,
    ) -> io::Result<Inputs> {
        // Without room: what is not received any more is not lost in it.
        let (opened, is_open) = sync_channel(0);
        let is_open = is_awaited.then_some(is_open);
        let is_whole = Arc::new(AtomicBool::new(true));
        let (of_thread, named) = (is_whole.clone(), path.clone());
        let record = move |entries: Receiver<Entry>| {
            let written = match open() {
                Ok(file) => {
                    // Fails if nobody awaits it.
                    let _ = opened.send(Ok(()));
                    write(&entries, file, &of_thread)
                }
                Err(cause) => match opened.send(Err(cause)) {
                    Err(SendError(unheard)) => unheard,
                    Ok(()) => Ok(()),
                },
            };
            if let Err(cause) = written {
                let path = named.display();
                output::error_line(format_args!("{path}: cannot be written: {cause}; nothing more is recorded"));
            }
        };
        let thread = DiskThread::start("inputs", WAITING, END_LIMIT, record)?;
        match is_open.map(|it| it.recv_timeout(OPEN_LIMIT)) {
            None | Some(Ok(Ok(()))) => {}
            Some(Ok(Err(cause))) => return Err(cause),
            Some(Err(RecvTimeoutError::Timeout)) => {
                let path = path.display();
                output::error_line(format_args!(
                    "{path}: the disk has not answered for {OPEN_LIMIT:?}: it is recorded once it does, if it takes everything since the start"
                ));
            }
            Some(Err(RecvTimeoutError::Disconnected)) => return Err(io::Error::other("its thread has ended")),
        }
        Ok(Inputs { path, thread, is_whole })
    }
}

fn write(entries: &Receiver<Entry>, mut file: Recording, is_whole: &AtomicBool) -> io::Result<()> {
    while let Ok(entry) = entries.recv() {
        file.write(&entry)?;
    }
    if is_whole.load(Ordering::Acquire) {
        file.end()?.flush()?;
    }
    Ok(())
}

impl Sink for Inputs {
    fn take(&mut self, entry: Entry) {
        // A thread that has ended has said why.
        if self.thread.hand_over(entry) == Err(NotTaken::Full) {
            self.is_whole.store(false, Ordering::Release);
            self.thread.close();
            let path = self.path.display();
            output::error_line(format_args!("{path}: the disk does not keep up; nothing more is recorded"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::SyncSender;

    /// Longer than any disk of a test takes.
    const LONG: Duration = Duration::from_secs(60);

    fn takes_more(inputs: &Inputs) -> bool {
        inputs.thread.hand_over(entry()).is_ok()
    }

    fn header() -> Header {
        Header {
            program: "1".into(),
            vehicle: "uav1".into(),
            instance: 7,
            speed: 1.0,
            tower_key: String::new(),
            files: Vec::new(),
        }
    }

    fn entry() -> Entry {
        Entry::Did { node: 0, what: "hold".into() }
    }

    #[test]
    fn what_was_taken_is_in_the_file_when_it_ends() {
        let folder = tempfile::tempdir().unwrap();
        let into = folder.path().join("made");
        for is_awaited in [true, false] {
            let mut inputs = Inputs::begin(&into, "mcm", header(), is_awaited).unwrap();
            inputs.take(entry());
            drop(inputs);
            let file = into.join("uav1-mcm-7.inputs");
            assert_eq!(simulation::recording::file::read(&file).unwrap(), (header(), vec![entry()]));
            fs::remove_file(file).unwrap();
        }
    }

    #[test]
    fn a_file_that_cannot_be_made_is_an_error_only_where_it_is_awaited() {
        let file = tempfile::NamedTempFile::new().unwrap();
        assert!(Inputs::begin(file.path(), "mcm", header(), true).is_err());
        let mut inputs = Inputs::begin(file.path(), "mcm", header(), false).unwrap();
        inputs.take(entry());
        assert!(inputs.thread.end_within(LONG), "it waits for nothing");
    }

    /// A disk that does not answer until the sender is dropped.
    fn hanging() -> (SyncSender<()>, impl FnOnce() -> io::Result<Recording> + Send) {
        let (disk, answers) = sync_channel::<()>(0);
        let open = move || {
            let _ = answers.recv();
            Err(io::Error::other("it was removed"))
        };
        (disk, open)
    }

    #[test]
    fn a_disk_that_hangs_holds_neither_the_start_nor_the_flight_nor_the_end_up() {
        let (_disk, open) = hanging();
        let mut inputs = Inputs::start("uav1-mcm-7.inputs".into(), open, false).unwrap();
        for _ in 0..=WAITING {
            inputs.take(entry());
        }
        assert!(!takes_more(&inputs), "it does not wait for more than there is room for");
        drop(inputs);
        let (_disk, open) = hanging();
        assert!(Inputs::start("uav1-mcm-7.inputs".into(), open, true).is_ok(), "it has refused nothing");
    }

    #[test]
    fn a_disk_that_answers_late_is_recorded_to_with_an_end_mark_only_if_it_takes_everything() {
        for (entries, is_whole) in [(3, true), (WAITING + 1, false)] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("uav1-mcm-7.inputs");
            let (disk, answers) = sync_channel::<()>(0);
            let file = path.clone();
            let open = move || {
                let _ = answers.recv();
                Writer::begin(BufWriter::new(fs::File::create_new(file)?), &header())
            };
            let mut inputs = Inputs::start(path.clone(), open, true).unwrap();
            for _ in 0..entries {
                inputs.take(entry());
            }
            drop(disk);
            assert!(inputs.thread.end_within(LONG));
            let read = simulation::recording::file::read(&path).map_err(|it| it.to_string());
            match is_whole {
                true => assert_eq!(read, Ok((header(), vec![entry(); entries]))),
                false => assert!(read.unwrap_err().contains(&format!("cut off after entry {WAITING}"))),
            }
        }
    }
}
