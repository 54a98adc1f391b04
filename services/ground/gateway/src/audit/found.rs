//! What [`verify`](super::verify::verify) finds in an audit trail.

use std::fmt;
use std::io;
use std::path::PathBuf;

/// A chain without a break. Records may be missing all the same: see [`Trail::is_intact`].
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Trail {
    /// Files that were read.
    pub files: usize,
    /// The numbers of the first and the last record; 0 without any.
    pub first: u64,
    /// See `first`.
    pub last: u64,
    /// Numbers in between or after the last without a record. Either it could not be written, because the disk was full or absent or the gateway
    /// was killed just then, or it was removed from the end: a gateway that is started again goes on after both in the same way.
    pub missing: u64,
    /// First records of files that were begun because the file before was gone while the gateway wrote to it.
    pub lost: Vec<Place>,
    /// Lines that were cut off when the gateway ended, or when the disk took only a part of them, each followed by a record that says so.
    pub torn: Vec<CutOff>,
    /// The last line, if it is cut off: the gateway, when it starts again, goes on after it.
    pub unfinished: Option<CutOff>,
    /// For each file whose name is of another day than a record in it: the first such record.
    pub misdated: Vec<Misdated>,
    /// Why records that are missing after the last one could not be noticed.
    pub open_end: Option<String>,
    /// The hash of the last line, in hexadecimal. Noted elsewhere, it shows later that nothing before it was changed.
    pub hash: String,
}

impl Trail {
    /// Whether every record is there whose number was given, as far as the files tell.
    pub fn is_intact(&self) -> bool {
        self.missing == 0
    }
}

/// A line of a file, counted from 1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub path: PathBuf,
    /// The line.
    pub line: usize,
}

/// A line that is not a whole record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CutOff {
    /// Where it is.
    pub place: Place,
    /// Whether it is the beginning of a record and nothing else. A gateway that is killed leaves such a line; after a power loss a file
    /// system may leave zeros or anything.
    pub is_beginning: bool,
}

/// A record whose day is not that of its file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Misdated {
    /// The record.
    pub place: Place,
    /// Its day.
    pub day: String,
}

/// Why the audit trail is not intact.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// A file or the folder cannot be read, or is not a regular file.
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
