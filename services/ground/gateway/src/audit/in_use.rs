//! That one gateway alone writes an audit trail: two would break its chain, and later it would look as if somebody had changed it.
//!
//! The lock ends with the process, however that ends: a gateway that was killed is started again at once. Readers need none.

use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// In the access folder. It has no content.
const NAME: &str = "audit.lock";

/// Another process writes the audit trail.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "the audit trail in {place} is in use by another process: end that one, or name another access folder",
    place = .0.display()
)]
pub struct InUse(PathBuf);

/// Whether nobody writes the audit trail in a folder now.
///
/// # Errors
/// If another process does.
pub fn check_free(folder: &Path) -> Result<(), InUse> {
    lock(folder).map(drop)
}

/// The lock, held for as long as the file is open; or why the file system gives none, which keeps no gateway away.
///
/// # Errors
/// If another process has it.
pub(super) fn lock(folder: &Path) -> Result<io::Result<File>, InUse> {
    let file = match regular_file::append(&folder.join(NAME)) {
        Ok(file) => file,
        Err(cause) => return Ok(Err(cause)),
    };
    match file.try_lock() {
        Ok(()) => Ok(Ok(file)),
        Err(TryLockError::WouldBlock) => Err(InUse(folder.to_owned())),
        Err(TryLockError::Error(cause)) => Ok(Err(cause)),
    }
}
