//! The folder of the recordings: what is in it, and what has to go.
//!
//! Whoever writes a recording holds a lock on its file, so that it can be told from one that was left
//! unfinished, by another gateway on the same folder too. Files that are not named as ours are shown
//! and never removed; whatever is no file, or cannot be read, is told and harms nothing.

use std::collections::BTreeMap;
use std::fs::{File, TryLockError};
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::SystemTime;

use serde_json::{Value, json};

use crate::recording::config::Limits;
use crate::recording::id::Id;
use crate::recording::reading::{self, Reading};

/// Recordings shown; more are in nobody's interest.
const MOST_SHOWN: usize = 1000;
/// Of a recording that is being written only the beginning is read for a list: it says whose it is.
const BEGINNING: u64 = 256 * 1024;

/// The folder, and what is known of the files in it.
#[derive(Debug)]
pub struct Shelf {
    /// Where it is.
    pub folder: PathBuf,
    known: Mutex<BTreeMap<Id, Known>>,
}

/// What was found in a file that has not changed since.
#[derive(Debug, Clone)]
struct Known {
    of: Stamp,
    card: Arc<Value>,
}

/// A file as it stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Stamp {
    bytes: u64,
    modified: Option<SystemTime>,
    is_live: bool,
}

/// A recording as far as its removal is concerned.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Held {
    /// Its name; those that began earlier have the smaller ones.
    pub id: Id,
    /// Its size.
    pub bytes: u64,
    /// Whether it is being written.
    pub is_live: bool,
}

/// The recordings that have to go, oldest first, so that the others are within the limits.
pub fn surplus(mut held: Vec<Held>, limits: Limits) -> Vec<Id> {
    held.sort_by(|a, b| a.id.cmp(&b.id));
    let (mut count, mut total) = (held.len(), held.iter().map(|it| it.bytes).sum::<u64>());
    let mut gone = Vec::new();
    for it in held.into_iter().filter(|it| !it.is_live) {
        if count <= limits.files && total <= limits.total {
            break;
        }
        (count, total) = (count - 1, total - it.bytes);
        gone.push(it.id);
    }
    gone
}

/// Removes what is too much in `folder`.
///
/// # Errors
/// If the folder cannot be read, or something in it not be removed.
pub fn make_room(folder: &Path, limits: Limits) -> io::Result<()> {
    let ours = files(folder)?.into_iter().filter(|id| id.is_ours());
    // What is gone since is nobody's concern.
    let held = ours.filter_map(|id| {
        let file = File::open(id.path_in(folder)).ok()?;
        let stamp = Stamp::of(&file).ok()?;
        Some(Held { id, bytes: stamp.bytes, is_live: stamp.is_live })
    });
    for id in surplus(held.collect(), limits) {
        std::fs::remove_file(id.path_in(folder))?;
    }
    Ok(())
}

/// The recordings in `folder`, by their names; none if there is no folder yet.
fn files(folder: &Path) -> io::Result<Vec<Id>> {
    let entries = match std::fs::read_dir(folder) {
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries?,
    };
    // Not what a link leads to: only files of this folder.
    let file = |it: io::Result<std::fs::DirEntry>| it.ok().filter(|it| it.file_type().is_ok_and(|it| it.is_file()));
    Ok(entries.filter_map(file).filter_map(|it| Id::of_file(&it.path())).collect())
}

impl Shelf {
    /// A folder that need not be there yet.
    pub fn new(folder: PathBuf) -> Shelf {
        Shelf { folder, known: Mutex::default() }
    }

    /// The recordings, newest first.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn list(&self) -> io::Result<Vec<Value>> {
        let mut ids = files(&self.folder)?;
        ids.sort_by(|a, b| b.cmp(a));
        ids.truncate(MOST_SHOWN);
        self.known().retain(|id, _| ids.binary_search_by(|it| id.cmp(it)).is_ok());
        Ok(ids.into_iter().filter_map(|id| self.card(&id)).map(|it| Value::clone(&it)).collect())
    }

    /// A line about a recording; `None` if it is gone.
    fn card(&self, id: &Id) -> Option<Arc<Value>> {
        let file = self.open(id).ok()?;
        let stamp = Stamp::of(&file).ok()?;
        let known = self.known().get(id).cloned();
        if let Some(known) = known.filter(|it| it.of == stamp) {
            return Some(known.card);
        }
        let most = if stamp.is_live { BEGINNING } else { u64::MAX };
        let reading = reading::read(BufReader::new(file.take(most)));
        let card = Arc::new(described(reading.digest.card(), id, stamp, &reading));
        self.known().insert(id.clone(), Known { of: stamp, card: card.clone() });
        Some(card)
    }

    /// Everything about a recording; `None` if there is none of this name.
    pub fn summary(&self, id: &Id) -> Option<Value> {
        let file = self.open(id).ok()?;
        let stamp = Stamp::of(&file).ok()?;
        // Not what is added meanwhile.
        let reading = reading::read(BufReader::new(file.take(stamp.bytes)));
        Some(described(reading.digest.summary(), id, stamp, &reading))
    }

    /// The file and its size now.
    ///
    /// # Errors
    /// If there is none of this name, or it cannot be read.
    pub fn file(&self, id: &Id) -> io::Result<(File, u64)> {
        let file = self.open(id)?;
        let bytes = file.metadata()?.len();
        Ok((file, bytes))
    }

    fn open(&self, id: &Id) -> io::Result<File> {
        let path = id.path_in(&self.folder);
        if !std::fs::symlink_metadata(&path)?.is_file() {
            return Err(io::Error::new(io::ErrorKind::NotFound, "not a file"));
        }
        File::open(path)
    }

    /// Plain data: a thread that panicked while it held the lock has left it whole.
    fn known(&self) -> MutexGuard<'_, BTreeMap<Id, Known>> {
        self.known.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl Stamp {
    fn of(file: &File) -> io::Result<Stamp> {
        let is_live = matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock));
        // Only tried, and in nobody's way from here on.
        let _ = file.unlock();
        let metadata = file.metadata()?;
        Ok(Stamp { bytes: metadata.len(), modified: metadata.modified().ok(), is_live })
    }
}

/// `about` the recording with what its file says of it.
fn described(mut about: Value, id: &Id, stamp: Stamp, reading: &Reading) -> Value {
    let problem = reading.problem.as_ref().filter(|_| !stamp.is_live);
    about["id"] = json!(id.to_string());
    about["bytes"] = json!(stamp.bytes);
    about["state"] = json!(match problem {
        _ if stamp.is_live => "recording",
        Some(_) => "damaged",
        None => "complete",
    });
    about["problem"] = json!(problem);
    if stamp.is_live {
        about["ended"] = Value::Null;
    }
    about
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_go_and_never_one_that_is_being_written() {
        /// Recordings as (day, bytes); a negative day is being written.
        #[track_caller]
        fn check(held: &[(i32, u64)], files: usize, total: u64, expected: &[i32]) {
            let id = |day: i32| format!("202601{:02}T000000000Z-uav1", day.abs()).parse::<Id>().unwrap();
            let held = held.iter().map(|it| Held { id: id(it.0), bytes: it.1, is_live: it.0 < 0 }).collect();
            let gone = surplus(held, Limits { files, total, each: 1 });
            assert_eq!(gone, expected.iter().map(|it| id(*it)).collect::<Vec<_>>());
        }
        check(&[], 1, 10, &[]);
        check(&[(1, 5), (2, 5)], 2, 10, &[]);
        check(&[(3, 1), (1, 1), (2, 1)], 1, 10, &[1, 2]);
        check(&[(1, 6), (2, 6), (3, 6)], 9, 12, &[1]);
        check(&[(-1, 6), (2, 6), (3, 6)], 9, 12, &[2]);
        check(&[(-1, 20), (2, 6), (3, 6)], 9, 12, &[2, 3]);
        check(&[(1, 1), (-2, 1)], 0, 9, &[1]);
    }
}
