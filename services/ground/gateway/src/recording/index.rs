//! The folder of the recordings: what is in it, and what has to be removed.
//!
//! The writer of a recording holds a lock on its file. A file without a lock was completed or left unfinished, also by
//! another gateway with the same folder. Files that are not named by a gateway are shown and never removed; an entry
//! that is not a file, or cannot be read, does no harm.

use std::collections::BTreeMap;
use std::fs::{File, TryLockError};
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};
use std::time::SystemTime;

use kittiwake_proto::v1;

use crate::recording::config::Limits;
use crate::recording::id::RecordingId;
use crate::recording::reading::{self, Reading};

/// The most recordings in a list: nobody reads more.
const MAX_SHOWN: usize = 1000;
/// Bytes at the beginning of a recording, which name its vehicle. A list reads no more of a
/// recording that is being written.
const BEGINNING: u64 = 256 * 1024;

/// The folder, and what is known of the files in it.
#[derive(Debug)]
pub(crate) struct RecordingIndex {
    pub(crate) folder: PathBuf,
    cache: Mutex<BTreeMap<RecordingId, Cached>>,
}

/// What was read of a file that has not changed since.
#[derive(Debug, Clone)]
struct Cached {
    of: FileState,
    overview: v1::RecordingSummary,
}

/// A file as it stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct FileState {
    bytes: u64,
    modified: Option<SystemTime>,
    /// Whether it is being written.
    is_live: bool,
}

/// The data of a recording that decide about its removal.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Stored {
    /// Its place among those that this gateway has begun since its start; `None`: it was there before, or is another gateway's.
    begun: Option<usize>,
    /// Earlier recordings have smaller ids, as far as the clock was right.
    id: RecordingId,
    bytes: u64,
    is_live: bool,
}

/// The recordings to remove, oldest first, so that the others are within the limits.
///
/// What this gateway has begun itself is newer than all else, whatever its name says: a machine without a clock that runs on while it is
/// switched off names its flights by a time long past, and each would be removed as the oldest when the next one begins.
fn surplus(mut stored: Vec<Stored>, limits: Limits) -> Vec<RecordingId> {
    stored.sort_by(|a, b| (a.begun, &a.id).cmp(&(b.begun, &b.id)));
    let (mut count, mut total) = (stored.len(), stored.iter().map(|recording| recording.bytes).sum::<u64>());
    let mut surplus = Vec::new();
    for recording in stored.into_iter().filter(|recording| !recording.is_live) {
        if count <= limits.files && total <= limits.total {
            break;
        }
        (count, total) = (count - 1, total - recording.bytes);
        surplus.push(recording.id);
    }
    surplus
}

/// Removes what is beyond the limits in `folder`; `begun` are the recordings that this gateway has begun, in this order.
///
/// # Errors
/// If the folder cannot be read, or a file in it not be removed; then all others are removed nevertheless.
pub(crate) fn make_room(folder: &Path, limits: Limits, begun: &[RecordingId]) -> io::Result<()> {
    let ours = files(folder)?.into_iter().filter(|id| id.is_ours());
    // A file that has gone in the meantime needs no removal.
    let stored = ours.filter_map(|id| {
        let file = File::open(id.path_in(folder)).ok()?;
        let FileState { bytes, is_live, .. } = FileState::of(&file).ok()?;
        Some(Stored { begun: begun.iter().position(|own| *own == id), id, bytes, is_live })
    });
    remove_each(surplus(stored.collect(), limits), |id| std::fs::remove_file(id.path_in(folder)))
}

/// Removes all that can be removed: one that cannot (`chattr +i`, another user's) must not let the others fill the disk.
///
/// # Errors
/// The first.
fn remove_each(ids: Vec<RecordingId>, mut remove: impl FnMut(&RecordingId) -> io::Result<()>) -> io::Result<()> {
    let mut first = Ok(());
    for id in ids {
        match remove(&id) {
            // Another gateway with the same folder was quicker.
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => {}
            Err(cause) => first = first.and(Err(io::Error::new(cause.kind(), format!("{}: {cause}", id.file_name())))),
            Ok(()) => {}
        }
    }
    first
}

/// The recordings in `folder`, by their names; none if there is no folder yet.
fn files(folder: &Path) -> io::Result<Vec<RecordingId>> {
    let entries = match std::fs::read_dir(folder) {
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries?,
    };
    // Links are not followed: only files of this folder.
    let is_file = |entry: &std::fs::DirEntry| entry.file_type().is_ok_and(|it| it.is_file());
    let files = entries.filter_map(Result::ok).filter(is_file);
    Ok(files.filter_map(|entry| RecordingId::of_file(&entry.path())).collect())
}

/// The recordings in `folder` that gateways began, newest first.
///
/// # Errors
/// If the folder cannot be read.
pub(crate) fn newest_first(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut ids: Vec<RecordingId> = files(folder)?.into_iter().filter(RecordingId::is_ours).collect();
    // Their names begin with the time.
    ids.sort_by(|a, b| b.cmp(a));
    Ok(ids.into_iter().map(|id| id.path_in(folder)).collect())
}

/// The recordings of `vehicle` that no gateway writes any more, newest first.
///
/// # Errors
/// If the folder cannot be read.
pub(crate) fn left_of(folder: &Path, vehicle: &str) -> io::Result<Vec<File>> {
    let mut ids: Vec<RecordingId> = files(folder)?.into_iter().filter(|id| id.is_of(vehicle)).collect();
    ids.sort_by(|a, b| b.cmp(a));
    let open = ids.into_iter().filter_map(|id| File::open(id.path_in(folder)).ok());
    Ok(open.filter(|file| FileState::of(file).is_ok_and(|state| !state.is_live)).collect())
}

impl RecordingIndex {
    /// A folder that may be made later.
    pub(crate) fn new(folder: PathBuf) -> RecordingIndex {
        RecordingIndex { folder, cache: Mutex::default() }
    }

    /// The recordings, newest first.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub(crate) fn list(&self) -> io::Result<Vec<v1::RecordingSummary>> {
        let mut ids = files(&self.folder)?;
        ids.sort_by(|a, b| b.cmp(a));
        ids.truncate(MAX_SHOWN);
        self.cache().retain(|id, _| ids.binary_search_by(|it| id.cmp(it)).is_ok());
        Ok(ids.into_iter().filter_map(|id| self.overview(&id)).collect())
    }

    /// A line of the list; `None` if the recording has gone.
    fn overview(&self, id: &RecordingId) -> Option<v1::RecordingSummary> {
        let file = self.open(id).ok()?;
        let state = FileState::of(&file).ok()?;
        let cached = self.cache().get(id).cloned();
        if let Some(cached) = cached.filter(|cached| cached.of == state) {
            return Some(cached.overview);
        }
        let limit = if state.is_live { BEGINNING } else { u64::MAX };
        let reading = reading::read(BufReader::new(file.take(limit)));
        let overview = overview(id, state, &reading);
        self.cache().insert(id.clone(), Cached { of: state, overview: overview.clone() });
        Some(overview)
    }

    /// Everything about a recording; `None` if there is none of this name.
    pub(crate) fn recording(&self, id: &RecordingId) -> Option<v1::Recording> {
        let file = self.open(id).ok()?;
        let state = FileState::of(&file).ok()?;
        // The bytes that are added meanwhile are left out.
        let reading = reading::read(BufReader::new(file.take(state.bytes)));
        Some(reading.summary.recording(overview(id, state, &reading)))
    }

    /// The file and its size now.
    ///
    /// # Errors
    /// If there is none of this name, or it cannot be read.
    pub(crate) fn file(&self, id: &RecordingId) -> io::Result<(File, u64)> {
        let file = self.open(id)?;
        let bytes = file.metadata()?.len();
        Ok((file, bytes))
    }

    fn open(&self, id: &RecordingId) -> io::Result<File> {
        let path = id.path_in(&self.folder);
        if !std::fs::symlink_metadata(&path)?.is_file() {
            return Err(io::Error::new(io::ErrorKind::NotFound, "not a file"));
        }
        File::open(path)
    }

    /// The data are whole even if a thread panicked while it held the lock.
    fn cache(&self) -> MutexGuard<'_, BTreeMap<RecordingId, Cached>> {
        self.cache.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl FileState {
    fn of(file: &File) -> io::Result<FileState> {
        let is_live = matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock));
        // Released at once, so that it does not block a writer.
        let _ = file.unlock();
        let metadata = file.metadata()?;
        Ok(FileState { bytes: metadata.len(), modified: metadata.modified().ok(), is_live })
    }
}

/// What a list shows of a recording.
fn overview(id: &RecordingId, file: FileState, reading: &Reading) -> v1::RecordingSummary {
    let of_mission = reading.summary.overview();
    // A recording that is being written has no end yet, and is not damaged by that.
    let problem = reading.problem.clone().filter(|_| !file.is_live);
    let state = match problem {
        _ if file.is_live => "recording",
        Some(_) => "damaged",
        None => "complete",
    };
    v1::RecordingSummary {
        id: id.to_string(),
        bytes: file.bytes,
        state: state.to_owned(),
        problem,
        ended: of_mission.ended.clone().filter(|_| !file.is_live),
        ..of_mission
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn id(day: i32) -> RecordingId {
        format!("202601{:02}T000000000Z-uav1", day.abs()).parse().unwrap()
    }

    #[test]
    fn the_oldest_are_removed_and_never_one_that_is_being_written() {
        /// Recordings as (day, bytes); a negative day is being written.
        #[track_caller]
        fn check(stored: &[(i32, u64)], files: usize, total: u64, expected: &[i32]) {
            let stored =
                stored.iter().map(|&(day, bytes)| Stored { begun: None, id: id(day), bytes, is_live: day < 0 });
            let removed = surplus(stored.collect(), Limits { files, total, each: 1 });
            assert_eq!(removed, expected.iter().map(|day| id(*day)).collect::<Vec<_>>());
        }
        check(&[], 1, 10, &[]);
        check(&[(1, 5), (2, 5)], 2, 10, &[]);
        check(&[(3, 1), (1, 1), (2, 1)], 1, 10, &[1, 2]);
        check(&[(1, 6), (2, 6), (3, 6)], 9, 12, &[1]);
        check(&[(-1, 6), (2, 6), (3, 6)], 9, 12, &[2]);
        check(&[(-1, 20), (2, 6), (3, 6)], 9, 12, &[2, 3]);
        check(&[(1, 1), (-2, 1)], 0, 9, &[1]);
    }

    #[test]
    fn what_this_gateway_began_is_newest_whatever_the_clock_says() {
        /// The days of recordings that were there before, and of those that this gateway began, in this order.
        #[track_caller]
        fn check(before: &[i32], begun: &[i32], files: usize, expected: &[i32]) {
            let before = before.iter().map(|day| (None, *day));
            let begun = begun.iter().enumerate().map(|(place, day)| (Some(place), *day));
            let stored =
                begun.chain(before).map(|(begun, day)| Stored { begun, id: id(day), bytes: 1, is_live: false });
            let removed = surplus(stored.collect(), Limits { files, total: 99, each: 1 });
            assert_eq!(removed, expected.iter().map(|day| id(*day)).collect::<Vec<_>>());
        }
        check(&[21, 20], &[1, 2], 2, &[20, 21]);
        check(&[20, 21], &[1], 2, &[20]);
        // The clock was set back, or right, between two flights.
        check(&[20], &[25, 1, 2], 2, &[20, 25]);
    }

    #[test]
    fn one_that_cannot_be_removed_keeps_none_of_the_others() {
        /// The days that cannot be removed and why; the days that are, and what is said.
        #[track_caller]
        fn check(fails: &[(i32, io::ErrorKind)], removed: &[i32], said: Option<&str>) {
            let mut gone = Vec::new();
            let result = remove_each((1..=4).map(id).collect(), |removing| {
                if let Some((_, kind)) = fails.iter().find(|(day, _)| id(*day) == *removing) {
                    return Err((*kind).into());
                }
                gone.push(removing.clone());
                Ok(())
            });
            assert_eq!(gone, removed.iter().map(|day| id(*day)).collect::<Vec<_>>());
            assert_eq!(result.map_err(|cause| cause.to_string()).err().as_deref(), said);
        }
        use io::ErrorKind::{NotFound, PermissionDenied, ReadOnlyFilesystem};
        check(&[], &[1, 2, 3, 4], None);
        check(&[(2, NotFound)], &[1, 3, 4], None);
        let first = Some("20260101T000000000Z-uav1.mcap: permission denied");
        check(&[(1, PermissionDenied), (3, ReadOnlyFilesystem)], &[2, 4], first);
    }
}
