//! The audit trail's files: one for each UTC day on which something was recorded, `audit-2026-01-31.jsonl`.
//!
//! The oldest is removed when there are more than the configured number; how much is written in a day removes nothing.
//! Records are appended to the newest file, also when the clock was set back, so that the order of the names is the order of
//! the records. A file that is removed, renamed or replaced while it is written to is begun again, and the chain goes on from
//! memory.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use kittiwake_proto::v1::{AuditRecord, AuditStage};

use super::chain::{self, Begun, Line, Tip};
use crate::in_place::is_at;

const PREFIX: &str = "audit-";
const SUFFIX: &str = ".jsonl";
/// A day in a name, such as `2026-01-31`.
pub(crate) const DAY: usize = 10;

/// The newest file, open, and the end of the chain.
#[derive(Debug)]
pub(crate) struct DayFiles {
    folder: PathBuf,
    /// The most files.
    most: usize,
    day: String,
    path: PathBuf,
    file: File,
    tip: Tip,
    /// Why the file was begun, until its first record says so.
    begun: Option<Begun>,
    /// The newest file that was gone while it was written to.
    lost: Option<PathBuf>,
    /// A write failed, and what the file ends with is not known.
    is_unsure: bool,
    /// Those of former days that nobody has been asked to bring to the disk since they were written to.
    former: Vec<File>,
}

impl DayFiles {
    /// Goes on where the newest file ends; a line that was cut off there is closed, and followed by a record that says so.
    /// `utc` is now, in RFC 3339; `given` is the number that was given last, which may be that of a record that is not there.
    ///
    /// # Errors
    /// The path of what cannot be read or written, and why.
    pub(crate) fn open(folder: &Path, most: usize, utc: &str, given: u64) -> Result<DayFiles, (PathBuf, io::Error)> {
        DayFiles::open_after(folder, most, utc, CutOffAt::Start { given })
    }

    fn open_after(folder: &Path, most: usize, utc: &str, lost_of: CutOffAt) -> Result<DayFiles, (PathBuf, io::Error)> {
        let existing = list(folder).map_err(|cause| (folder.to_owned(), cause))?;
        let newest = existing.last().and_then(|it| day_of(it)).unwrap_or_else(|| utc[..DAY].to_owned());
        let (mut tip, mut last, mut begun) = (Tip::default(), Last::default(), Some(Begun::Day));
        // A file may be empty, or hold only a part of a line: the gateway ended before its first record was whole.
        for (age, path) in existing.iter().rev().enumerate() {
            let end = End::read(path).map_err(|cause| (path.clone(), cause))?;
            if tip.hash == chain::Hash::default() {
                tip.hash = end.hash;
                // What follows goes into the newest file: a line in an older one needs no line feed.
                last = Last { has_feed: end.last.has_feed || 0 < age, ..end.last };
            }
            if let Some(number) = end.number {
                tip.number = number;
                begun = begun.filter(|_| 0 < age);
                break;
            }
        }
        let path = path_of(folder, &newest);
        let file = regular_file::append(&path).map_err(|cause| (path.clone(), cause))?;
        let (folder, lost) = (folder.to_owned(), None);
        let (is_unsure, former) = (false, Vec::new());
        let mut files = DayFiles { folder, most, day: newest, path, file, tip, begun, lost, is_unsure, former };
        files.close(utc, last, lost_of).map_err(|cause| (files.path.clone(), cause))?;
        Ok(files)
    }

    /// The number of the newest record.
    pub(crate) fn newest_number(&self) -> u64 {
        self.tip.number
    }

    /// The newest file that was removed, renamed or replaced while it was written to.
    pub(crate) fn lost(&self) -> Option<&Path> {
        self.lost.as_deref()
    }

    /// Where the newest file was opened.
    pub(crate) fn newest_path(&self) -> &Path {
        &self.path
    }

    /// Whether the newest file is where it was opened.
    pub(crate) fn is_in_place(&self) -> bool {
        is_at(&self.file, &self.path)
    }

    /// Appends a record that has its number and its `utc`.
    ///
    /// # Errors
    /// When it cannot be written as a whole.
    pub(crate) fn append(&mut self, record: &AuditRecord) -> io::Result<()> {
        if !self.is_in_place() {
            self.begin_again()?;
        } else if self.is_unsure {
            // What was written of the last line counts as cut off, as after a restart.
            let at = CutOffAt::Write { next: record.number };
            let opened = DayFiles::open_after(&self.folder, self.most, &record.utc, at).map_err(|(_, cause)| cause)?;
            *self = DayFiles { lost: self.lost.take(), former: std::mem::take(&mut self.former), ..opened };
        }
        let day = record.utc.get(..DAY).unwrap_or_default();
        if self.day.as_str() < day {
            let path = path_of(&self.folder, day);
            let next = regular_file::append(&path)?;
            self.former.push(std::mem::replace(&mut self.file, next));
            (self.path, self.day) = (path, day.to_owned());
            self.begun = Some(self.begun.unwrap_or(Begun::Day));
            self.remove_oldest();
        }
        self.write("", record)
    }

    /// The newest file and those of former days that were not taken before, oldest first, to wait until the disk has them.
    ///
    /// # Errors
    /// When the system has no more file descriptors.
    pub(crate) fn unsynced(&self) -> io::Result<Vec<File>> {
        self.former.iter().chain([&self.file]).map(File::try_clone).collect()
    }

    /// The disk is asked for those of former days, and they are not needed here any more.
    pub(crate) fn close_former(&mut self) {
        self.former.clear();
    }

    /// Begins the file again that is not at its path any more, or goes on with the one that is there now. What comes before
    /// is known from memory, so that the chain has no break.
    fn begin_again(&mut self) -> io::Result<()> {
        let file = regular_file::append(&self.path)?;
        let end = End::read(&self.path)?;
        if !end.last.has_feed {
            (&file).write_all(b"\n")?;
        }
        tracing::error!("{}: was removed or replaced while it was written to; it is begun again", self.path.display());
        self.begun = end.number.is_none().then_some(Begun::Lost);
        (self.file, self.is_unsure, self.lost) = (file, false, Some(self.path.clone()));
        Ok(())
    }

    /// Closes the last line, if it was cut off.
    fn close(&mut self, utc: &str, last: Last, at: CutOffAt) -> io::Result<()> {
        let feed = if last.has_feed { "" } else { "\n" };
        let Some(bytes) = last.part else { return self.file.write_all(feed.as_bytes()) };
        let (number, asked) = match at {
            CutOffAt::Start { given } => (self.tip.number.max(given) + 1, None),
            CutOffAt::Write { next } => (next - 1, Some(next - 1)),
        };
        let record = AuditRecord {
            utc: utc.to_owned(),
            number,
            stage: AuditStage::Torn.into(),
            asked,
            outcome: format!("the line before was cut off after {bytes} bytes"),
            ..Default::default()
        };
        self.write(feed, &record)
    }

    fn write(&mut self, before: &str, record: &AuditRecord) -> io::Result<()> {
        let line = chain::line(record, &self.tip.hash, self.begun);
        let whole = self.file.metadata()?.len();
        let written = self.file.write_all(format!("{before}{line}\n").as_bytes());
        match written {
            Ok(()) => {
                self.tip = Tip { number: record.number, hash: chain::hash(line.as_bytes()) };
                self.begun = None;
            }
            // A disk that is full has taken a part.
            Err(_) => self.is_unsure = self.file.set_len(whole).is_err(),
        }
        written
    }

    fn remove_oldest(&self) {
        let all = list(&self.folder).unwrap_or_default();
        for old in &all[..all.len().saturating_sub(self.most.max(1))] {
            if let Err(cause) = std::fs::remove_file(old) {
                tracing::warn!("{}: cannot be removed: {cause}", old.display());
            }
        }
    }
}

/// Waits until the disk has a file.
///
/// # Errors
/// When it cannot take it.
pub(crate) fn sync(file: &File) -> io::Result<()> {
    // EINVAL: there is no disk beneath it.
    file.sync_data().or_else(|it| if it.kind() == io::ErrorKind::InvalidInput { Ok(()) } else { Err(it) })
}

/// When a line was found to be cut off, by which its record gets a number.
#[derive(Debug, Clone, Copy)]
enum CutOffAt {
    /// The gateway starts: a new number after the one that was given last.
    Start {
        /// It.
        given: u64,
    },
    /// It could not write a record, nor take back the part that it had written: all numbers since are given, so it
    /// takes that of the last record that was lost, and says so.
    Write {
        /// The number of the record that is written now.
        next: u64,
    },
}

/// The last line of a file.
#[derive(Debug)]
struct Last {
    /// The bytes of a line that was cut off. Only a line without a line feed counts: any other invalid line was
    /// changed, and stays as it is, for `verify` to find.
    part: Option<usize>,
    has_feed: bool,
}

impl Default for Last {
    /// That of an empty file.
    fn default() -> Last {
        Last { part: None, has_feed: true }
    }
}

/// The end of a file.
struct End {
    /// The number of its last record.
    number: Option<u64>,
    /// The hash of its last line; zeros without one.
    hash: chain::Hash,
    last: Last,
}

impl End {
    /// Reads a file to its end.
    fn read(path: &Path) -> io::Result<End> {
        let mut reader = BufReader::new(regular_file::open(path)?);
        let mut end = End { number: None, hash: chain::Hash::default(), last: Last::default() };
        let mut line = Vec::new();
        loop {
            line.clear();
            if reader.read_until(b'\n', &mut line)? == 0 {
                return Ok(end);
            }
            let has_feed = line.pop_if(|it| *it == b'\n').is_some();
            let part = match chain::read(&line) {
                Line::Record(link) => {
                    end.number = Some(link.number);
                    None
                }
                Line::Part => Some(line.len()).filter(|_| !has_feed),
                Line::Foreign => None,
            };
            (end.hash, end.last) = (chain::hash(&line), Last { part, has_feed });
        }
    }
}

/// The files of the audit trail in a folder, oldest first.
pub(crate) fn list(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        found.extend(day_of(&path).map(|_| path));
    }
    found.sort();
    Ok(found)
}

/// The day of a file of the audit trail; `None` for any other file.
pub(crate) fn day_of(path: &Path) -> Option<String> {
    let day = path.file_name()?.to_str()?.strip_prefix(PREFIX)?.strip_suffix(SUFFIX)?;
    let is_day = day.len() == DAY && day.bytes().all(|it| it.is_ascii_digit() || it == b'-');
    is_day.then(|| day.to_owned())
}

fn path_of(folder: &Path, day: &str) -> PathBuf {
    folder.join(format!("{PREFIX}{day}{SUFFIX}"))
}

#[cfg(test)]
impl DayFiles {
    /// As after a record of which the disk took only this part, and did not let it be taken back.
    pub(crate) fn leave_part(&mut self, part: &str) {
        self.file.write_all(part.as_bytes()).expect("it can be written");
        self.is_unsure = true;
    }

    /// From now on it writes to another file.
    pub(crate) fn write_to(&mut self, path: &str) {
        self.path = path.into();
        self.file = File::options().write(true).open(path).expect("it can be opened");
    }

    /// From now on it has the newest file open in this way.
    pub(crate) fn hold(&mut self, newest: File) {
        self.file = newest;
    }
}
