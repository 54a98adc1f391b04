//! That one command at a time changes what an authority has issued and revoked: of two that read the same list, the one that writes it
//! last would take back what the other has revoked.
//!
//! The lock ends with the process, however that ends.

use std::fs::{File, TryLockError};
use std::path::Path;

use super::Failure;
use crate::output;

/// In the authority's folder. It has no content.
const NAME: &str = "certs.lock";

/// The lock, held for as long as the file is open. Waits for another command, which takes a moment.
pub(super) fn lock(authority: &Path) -> Result<File, Failure> {
    let path = authority.join(NAME);
    let failed = |cause| Failure::Write { path: path.clone(), cause };
    let file = regular_file::append(&path).map_err(failed)?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            output::error_line(format_args!("certs: waits for another command that uses {}", authority.display()));
            file.lock().map_err(failed)?;
        }
        // Who revokes a stolen aircraft is not kept from it by a file system that has no locks.
        Err(TryLockError::Error(cause)) => output::error_line(format_args!(
            "certs: warning: {} cannot be locked ({cause}): start no second command meanwhile",
            path.display()
        )),
    }
    Ok(file)
}
