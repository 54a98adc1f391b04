//! Opens files of the access folder. A pipe or a device at the path of one would never end, or wait for somebody who writes.

use std::fs::File;
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

/// Opens a file to read it.
///
/// # Errors
/// If it cannot be opened, or is no regular file.
pub(crate) fn open(path: &Path) -> io::Result<File> {
    if !std::fs::metadata(path)?.is_file() {
        return Err(refusal());
    }
    File::open(path)
}

/// Opens a file, which is made if there is none, to write at its end.
///
/// # Errors
/// If it cannot be opened or made, or is no regular file.
pub(crate) fn append(path: &Path) -> io::Result<File> {
    if std::fs::metadata(path).is_ok_and(|it| !it.is_file()) {
        return Err(refusal());
    }
    File::options().create(true).append(true).mode(0o600).open(path)
}

fn refusal() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, "is no regular file")
}
