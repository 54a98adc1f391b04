//! A lock that says of a file or folder that its process lives: it ends with the process, however that ends. A process id says less: it is used
//! again, and in another namespace of processes it is somebody else's.

use std::fs::{File, TryLockError};
use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::Path;

/// Locks what is at `path`, for as long as the value lives. `None` if another process has it, or removes it just now.
///
/// # Errors
/// If there is nothing, or nothing can be locked there.
pub fn take(path: &Path) -> io::Result<Option<File>> {
    let file = File::open(path)?;
    match file.try_lock() {
        Ok(()) => Ok(is_at(&file, path).then_some(file)),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(cause)) => Err(cause),
    }
}

/// Whether the process that has locked the file lives. `None` where nothing can be locked.
pub fn is_taken(file: &File) -> Option<bool> {
    // Shared, so that several who look do not take each other for that process.
    match file.try_lock_shared() {
        Ok(()) => Some(false),
        Err(TryLockError::WouldBlock) => Some(true),
        Err(TryLockError::Error(_)) => None,
    }
}

/// Whether it is this file or folder that is at `path`, and not another that has taken its place. As long as it is open, no other has its number.
pub fn is_at(file: &File, path: &Path) -> bool {
    let number = |it: std::fs::Metadata| (it.dev(), it.ino());
    let there = std::fs::symlink_metadata(path).map(number);
    file.metadata().map(number).is_ok_and(|own| there.is_ok_and(|it| it == own))
}
