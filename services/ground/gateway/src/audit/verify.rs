//! Whether the audit trail's files are as they were written: every line follows the one before, across files.

use std::fmt;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use super::chain::{self, Begun, Hash, Line, Link};
use super::{day_files, regular};
use crate::access::to_hex;

/// Bytes of a line that no record reaches.
const MAX_LINE: u64 = 1 << 20;

/// A chain without a break.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Intact {
    /// Files that were read.
    pub files: usize,
    /// The numbers of the first and the last record; 0 without any.
    pub first: u64,
    /// See `first`.
    pub last: u64,
    /// Numbers in between without a record: it could not be written, because the disk was full or absent.
    pub unwritten: u64,
    /// First records of files that were begun because the file before was gone while the gateway wrote to it.
    pub lost: Vec<Place>,
    /// Lines that were cut off when the gateway ended, each followed by a record that says so.
    pub torn: Vec<Place>,
    /// The last line, if it is cut off: the gateway, when it starts again, goes on after it.
    pub unfinished: Option<Place>,
    /// The hash of the last line, in hexadecimal. Noted elsewhere, it shows later that nothing before it was changed.
    pub hash: String,
}

/// A line of a file, counted from 1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub path: PathBuf,
    /// The line.
    pub line: usize,
}

/// Why the audit trail is not intact.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// A file or the folder cannot be read, or is no regular file.
    #[error("{path}: {1}", path = .0.display())]
    Unreadable(PathBuf, io::Error),
    /// The folder has no audit trail.
    #[error("{path}: holds no audit records; expected files such as `audit-2026-01-31.jsonl`", path = .0.display())]
    Empty(PathBuf),
    /// The first line that does not follow from the one before.
    #[error("{0}: {1}")]
    Broken(Place, String),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.path.display(), self.line)
    }
}

/// Checks a file, or every file of the audit trail in a folder.
///
/// # Errors
/// What cannot be read, or the first line that breaks the chain.
pub fn verify(path: &Path) -> Result<Intact, Fault> {
    let unreadable = |cause| Fault::Unreadable(path.to_owned(), cause);
    let files = if path.is_dir() { day_files::list(path).map_err(unreadable)? } else { vec![path.to_owned()] };
    if files.is_empty() {
        return Err(Fault::Empty(path.to_owned()));
    }
    let mut reading = Reading::default();
    for file in &files {
        reading.file(file)?;
    }
    reading.end()
}

/// The lines so far.
#[derive(Default)]
struct Reading {
    found: Intact,
    hash: Option<Hash>,
    /// Whether the line that was read last ends with a line feed.
    has_feed: bool,
    /// The lines just before that are not whole: several, if the disk was full when the gateway started again.
    cut_off: Vec<Place>,
}

impl Reading {
    fn file(&mut self, path: &Path) -> Result<(), Fault> {
        let unreadable = |cause| Fault::Unreadable(path.to_owned(), cause);
        let mut reader = BufReader::new(regular::open(path).map_err(unreadable)?);
        self.found.files += 1;
        let mut bytes = Vec::new();
        for line in 1.. {
            bytes.clear();
            let place = Place { path: path.to_owned(), line };
            let read = reader.by_ref().take(MAX_LINE).read_until(b'\n', &mut bytes).map_err(unreadable)?;
            if read == 0 {
                break;
            }
            let has_feed = bytes.pop_if(|it| *it == b'\n').is_some();
            if !has_feed && bytes.len() as u64 == MAX_LINE {
                return Err(Fault::Broken(place, format!("the line has more than {MAX_LINE} bytes")));
            }
            self.has_feed = has_feed;
            self.line(place, &bytes)?;
        }
        Ok(())
    }

    fn line(&mut self, place: Place, line: &[u8]) -> Result<(), Fault> {
        let link = match chain::read(line) {
            Line::Record(link) => link,
            Line::Part => {
                self.cut_off.push(place);
                self.hash = Some(chain::hash(line));
                return Ok(());
            }
            Line::Foreign => return Err(Fault::Broken(place, "it is no record".to_owned())),
        };
        if !link.is_unchanged {
            let why = "it does not have the hash that it carries: the line was changed".to_owned();
            return Err(Fault::Broken(place, why));
        }
        if !link.after_torn {
            self.follows_whole(&place)?;
        }
        self.follows(&link).map_err(|why| Fault::Broken(place.clone(), why))?;
        if self.found.first == 0 {
            self.found.first = link.number;
        } else {
            self.found.unwritten += link.number - self.found.last - 1;
        }
        if link.begun == Some(Begun::Lost) {
            self.found.lost.push(place);
        }
        self.found.torn.append(&mut self.cut_off);
        (self.found.last, self.hash) = (link.number, Some(chain::hash(line)));
        Ok(())
    }

    /// Whether a record follows from what was read before it; if not, why.
    fn follows(&self, link: &Link) -> Result<(), String> {
        // What rotation has removed ends with a whole file.
        if self.found.first == 0 && link.begun.is_none() {
            return Err(
                "it is the first record and not the first one of a file: what was before it in the file is gone".into(),
            );
        }
        let expected = self.hash.unwrap_or(if link.number == 1 { Hash::default() } else { link.previous });
        if link.previous != expected && link.begun == Some(Begun::Lost) {
            return Err(
                "the records before it were in a file that was removed or renamed while the gateway wrote to it".into(),
            );
        }
        if link.previous != expected {
            return Err("it does not carry the hash of the line before: one of the two was changed, or lines between them are gone".into());
        }
        if self.found.first != 0 && link.number <= self.found.last {
            return Err(format!("record {} comes after record {}", link.number, self.found.last));
        }
        Ok(())
    }

    /// Only a record that says so follows a line that is not whole.
    fn follows_whole(&self, place: &Place) -> Result<(), Fault> {
        match self.cut_off.first() {
            None => Ok(()),
            Some(cut_off) => {
                let why = format!("it is no record, and {place} does not say that it was cut off");
                Err(Fault::Broken(cut_off.clone(), why))
            }
        }
    }

    fn end(mut self) -> Result<Intact, Fault> {
        // Only the last bytes of all can be a line of which the rest is not written yet.
        if let Some(place) = self.cut_off.pop_if(|_| self.has_feed) {
            let why = "it is no record, and not cut off: it ends with a line feed";
            return Err(Fault::Broken(place, why.to_owned()));
        }
        self.found.unfinished = self.cut_off.pop();
        self.found.torn.append(&mut self.cut_off);
        self.found.hash = self.hash.map(|it| to_hex(&it)).unwrap_or_default();
        Ok(self.found)
    }
}
