//! The audit trail's files: one for each UTC day on which something was recorded, `audit-2026-01-31.jsonl`.
//!
//! The oldest is removed when there are more than the configured number; how much is written in a day removes nothing.
//! Records are appended to the newest file, also when the clock was set back, so that the order of the names is the order of
//! the records.

use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use kittiwake_proto::v1::{AuditRecord, AuditStage};

use super::chain::{self, Tip};

const PREFIX: &str = "audit-";
const SUFFIX: &str = ".jsonl";
/// A day in a name, such as `2026-01-31`.
const DAY: usize = 10;

/// The newest file, open, and the end of the chain.
#[derive(Debug)]
pub(crate) struct DayFiles {
    folder: PathBuf,
    /// The most files.
    most: usize,
    day: String,
    file: File,
    tip: Tip,
    /// A write failed, and what the file ends with is not known.
    is_unsure: bool,
}

impl DayFiles {
    /// Goes on where the newest file ends; a line that was cut off there is closed, and followed by a record that says so.
    /// `utc` is now, in RFC 3339.
    ///
    /// # Errors
    /// The path of what cannot be read or written, and why.
    pub(crate) fn open(folder: &Path, most: usize, utc: &str) -> Result<DayFiles, (PathBuf, io::Error)> {
        let existing = list(folder).map_err(|cause| (folder.to_owned(), cause))?;
        let newest = existing.last().and_then(|it| day_of(it)).unwrap_or_else(|| utc[..DAY].to_owned());
        let mut tip = Tip::default();
        let mut torn = None;
        // A file may be empty: the gateway ended before its first line.
        for (age, path) in existing.iter().rev().enumerate() {
            let end = End::read(path).map_err(|cause| (path.clone(), cause))?;
            if let Some(end) = end {
                // What follows goes into the newest file: a line in an older one needs no line feed.
                torn = end.torn.map(|it| Torn { has_feed: it.has_feed || 0 < age, ..it });
                tip = end.tip;
                break;
            }
        }
        let path = folder.join(format!("{PREFIX}{newest}{SUFFIX}"));
        let file = append(&path).map_err(|cause| (path.clone(), cause))?;
        let mut files = DayFiles { folder: folder.to_owned(), most, day: newest, file, tip, is_unsure: false };
        if let Some(torn) = torn {
            files.close_torn(utc, torn).map_err(|cause| (path, cause))?;
        }
        Ok(files)
    }

    /// The number of the newest record.
    pub(crate) fn newest_number(&self) -> u64 {
        self.tip.number
    }

    /// Appends a record that has its number and its `utc`.
    ///
    /// # Errors
    /// When it cannot be written as a whole.
    pub(crate) fn append(&mut self, record: &AuditRecord) -> io::Result<()> {
        if self.is_unsure {
            // What was written of the last line counts as cut off, as after a restart.
            *self = DayFiles::open(&self.folder, self.most, &record.utc).map_err(|(_, cause)| cause)?;
        }
        let day = record.utc.get(..DAY).unwrap_or_default();
        if self.day.as_str() < day {
            self.file = append(&self.folder.join(format!("{PREFIX}{day}{SUFFIX}")))?;
            self.day = day.to_owned();
            self.remove_oldest();
        }
        self.write("", record)
    }

    /// The newest file, to wait until the disk has it.
    ///
    /// # Errors
    /// When the system has no more file descriptors.
    pub(crate) fn newest_file(&self) -> io::Result<File> {
        self.file.try_clone()
    }

    fn close_torn(&mut self, utc: &str, torn: Torn) -> io::Result<()> {
        let feed = if torn.has_feed { "" } else { "\n" };
        if torn.bytes == 0 {
            return self.file.write_all(feed.as_bytes());
        }
        let record = AuditRecord {
            utc: utc.to_owned(),
            number: self.tip.number + 1,
            stage: AuditStage::Torn.into(),
            outcome: format!("the line before was cut off after {} bytes", torn.bytes),
            ..Default::default()
        };
        self.write(feed, &record)
    }

    fn write(&mut self, before: &str, record: &AuditRecord) -> io::Result<()> {
        let line = chain::line(record, &self.tip.hash);
        let whole = self.file.metadata()?.len();
        let written = self.file.write_all(format!("{before}{line}\n").as_bytes());
        match written {
            Ok(()) => self.tip = Tip { number: record.number, hash: chain::hash(line.as_bytes()) },
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

/// A line that was cut off, at the end of a file.
#[derive(Debug)]
struct Torn {
    /// 0 where only the line feed of a whole line is missing.
    bytes: usize,
    has_feed: bool,
}

/// The end of a file.
struct End {
    tip: Tip,
    torn: Option<Torn>,
}

impl End {
    /// Reads a file to its end; `None` if it is empty.
    fn read(path: &Path) -> io::Result<Option<End>> {
        let mut reader = BufReader::new(File::open(path)?);
        let (mut number, mut line, mut last) = (0, Vec::new(), None);
        loop {
            line.clear();
            if reader.read_until(b'\n', &mut line)? == 0 {
                return Ok(last);
            }
            let has_feed = line.pop_if(|it| *it == b'\n').is_some();
            let link = chain::link(&line);
            number = link.as_ref().map_or(number, |it| it.number);
            let bytes = if link.is_some() { 0 } else { line.len() };
            let torn = (link.is_none() || !has_feed).then_some(Torn { bytes, has_feed });
            last = Some(End { tip: Tip { number, hash: chain::hash(&line) }, torn });
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
fn day_of(path: &Path) -> Option<String> {
    let day = path.file_name()?.to_str()?.strip_prefix(PREFIX)?.strip_suffix(SUFFIX)?;
    let is_day = day.len() == DAY && day.bytes().all(|it| it.is_ascii_digit() || it == b'-');
    is_day.then(|| day.to_owned())
}

fn append(path: &Path) -> io::Result<File> {
    OpenOptions::new().create(true).append(true).mode(0o600).open(path)
}

#[cfg(test)]
impl DayFiles {
    /// From now on it writes to another file.
    pub(crate) fn write_to(&mut self, path: &str) {
        self.file = OpenOptions::new().write(true).open(path).expect("it can be opened");
    }
}
