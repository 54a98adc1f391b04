//! A folder of the file system.

use std::fs::{DirBuilder, File, OpenOptions, TryLockError};
use std::io::{self, Read, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use crate::Medium;

/// A state is some kilobytes; what is longer is not one, and neither written nor read.
const LONGEST: u64 = 16 << 20;

/// A folder that only its owner may read.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    /// Open for as long as the lock is held.
    lock: Option<File>,
}

impl Folder {
    pub(crate) fn new(path: &Path) -> Folder {
        Folder { path: path.to_owned(), lock: None }
    }
}

impl Drop for Folder {
    /// A child that another thread has just forked has the lock file open until it executes its program: closing ours does not unlock it.
    fn drop(&mut self) {
        if let Some(lock) = &self.lock {
            let _ = lock.unlock();
        }
    }
}

impl Medium for Folder {
    fn prepare(&mut self) -> io::Result<()> {
        match DirBuilder::new().recursive(true).mode(0o700).create(&self.path) {
            Err(_) if self.path.is_file() => Err(io::ErrorKind::NotADirectory.into()),
            other => other,
        }
    }

    fn lock(&mut self, name: &str) -> io::Result<bool> {
        let file = OpenOptions::new().write(true).create(true).truncate(false).mode(0o600).open(self.path(name))?;
        match file.try_lock() {
            Ok(()) => {
                self.lock = Some(file);
                Ok(true)
            }
            Err(TryLockError::WouldBlock) => Ok(false),
            Err(TryLockError::Error(cause)) => Err(cause),
        }
    }

    fn has_lock(&mut self, name: &str) -> io::Result<bool> {
        let Some(lock) = &self.lock else { return Ok(false) };
        let taken = lock.metadata()?;
        match std::fs::symlink_metadata(self.path(name)) {
            // As long as it is open, no other file has its number.
            Ok(there) => Ok((there.dev(), there.ino()) == (taken.dev(), taken.ino())),
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => Ok(false),
            Err(cause) => Err(cause),
        }
    }

    fn read(&mut self, name: &str) -> io::Result<Option<Vec<u8>>> {
        let path = self.path(name);
        let kind = match std::fs::metadata(&path) {
            Ok(metadata) => metadata.file_type(),
            // A symbolic link that leads nowhere is something, and nothing that can be read.
            Err(cause) if cause.kind() == io::ErrorKind::NotFound && !path.is_symlink() => return Ok(None),
            Err(cause) => return Err(cause),
        };
        if !kind.is_file() {
            // A pipe would never end, and opening it could already block.
            return Err(io::ErrorKind::IsADirectory.into());
        }
        let mut bytes = Vec::new();
        File::open(path)?.take(LONGEST).read_to_end(&mut bytes)?;
        Ok(Some(bytes))
    }

    fn write(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        if LONGEST < bytes.len() as u64 {
            let why = format!("{} bytes, more than the {LONGEST} that are read back", bytes.len());
            return Err(io::Error::new(io::ErrorKind::InvalidData, why));
        }
        let path = self.path(name);
        match std::fs::remove_file(&path) {
            Err(cause) if cause.kind() != io::ErrorKind::NotFound => return Err(cause),
            _ => {}
        }
        let mut file = OpenOptions::new().write(true).create_new(true).mode(0o600).open(path)?;
        file.write_all(bytes)?;
        file.sync_all()
    }

    fn rename(&mut self, from: &str, to: &str) -> io::Result<()> {
        std::fs::rename(self.path(from), self.path(to))
    }

    fn sync_folder(&mut self) -> io::Result<()> {
        File::open(&self.path)?.sync_all()
    }

    fn exists(&mut self, name: &str) -> bool {
        self.path(name).symlink_metadata().is_ok()
    }

    fn path(&self, name: &str) -> PathBuf {
        if name.is_empty() { self.path.clone() } else { self.path.join(name) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_is_dropped_is_unlocked_although_a_forked_child_has_the_lock_open() {
        let place = tempfile::tempdir().unwrap();
        let mut first = Folder::new(place.path());
        assert!(first.lock("lock").unwrap());
        let _of_child = first.lock.as_ref().unwrap().try_clone().unwrap();
        drop(first);
        assert!(Folder::new(place.path()).lock("lock").unwrap());
    }
}
