//! Opens files that a human names or puts into a folder: configurations, missions, certificates, keys, the audit trail. None of them may hold
//! a process up or take its memory, whatever is in its place: a pipe waits for somebody at its other end, and a device may never end.
//!
//! A file that is replaced while a process runs is followed by [`Followed`]. Where a loop must not wait for the disk, a [`DiskThread`] writes.

mod disk_thread;
mod followed;

pub use disk_thread::{DiskThread, NotTaken};
pub use followed::{Followed, Unusable};

use std::fs::{File, FileType, OpenOptions};
use std::io::{Error, ErrorKind, Read as _, Result, Write as _};
use std::os::unix::fs::{FileTypeExt as _, OpenOptionsExt as _};
use std::path::Path;

/// The most bytes that [`read`] reads: some ten thousand entries of a list of what is revoked, and far more than any key has.
pub const LARGEST_BYTES: u64 = 1 << 20;

/// Opens a file to read it.
///
/// # Errors
/// If it cannot be opened, or is not a regular file.
pub fn open(path: &Path) -> Result<File> {
    // Before it is opened: to open a pipe waits already.
    check(std::fs::metadata(path)?.file_type())?;
    File::open(path)
}

/// Opens a file to write it from its beginning; what it had is gone.
///
/// # Errors
/// If it cannot be opened or made, or is not a regular file.
pub fn create(path: &Path) -> Result<File> {
    make(path, File::options().write(true).truncate(true))
}

/// Writes a whole file, in place of what it had.
///
/// # Errors
/// As [`create`], or if it cannot be written.
pub fn write(path: &Path, content: impl AsRef<[u8]>) -> Result<()> {
    create(path)?.write_all(content.as_ref())
}

/// Opens a file to write at its end; it is made for the owner alone if there is none.
///
/// # Errors
/// If it cannot be opened or made, or is not a regular file.
pub fn append(path: &Path) -> Result<File> {
    make(path, File::options().append(true).mode(0o600))
}

/// Opens a file to read and to write anywhere in it; it is made for the owner alone if there is none.
///
/// # Errors
/// As [`append`].
pub fn in_place(path: &Path) -> Result<File> {
    make(path, File::options().read(true).write(true).mode(0o600))
}

fn make(path: &Path, options: &mut OpenOptions) -> Result<File> {
    if let Ok(found) = std::fs::metadata(path) {
        check(found.file_type())?;
    }
    options.create(true).open(path)
}

/// Replaces a file at once and for good: a reader finds the old one or the new one, also after a power loss. It is written beside it,
/// as `NAME.part`.
///
/// # Errors
/// If it cannot be written; the old one is then as it was, or the new one is there and a power loss may take it back.
pub fn replace(path: &Path, mode: u32, bytes: &[u8]) -> Result<()> {
    let unfinished = path.with_added_extension("part");
    // Left behind by a process that was killed, or lost its disk.
    let _ = std::fs::remove_file(&unfinished);
    let written = write_synced(&unfinished, mode, bytes).and_then(|()| std::fs::rename(&unfinished, path));
    if let Err(cause) = written {
        // A disk that is full gets back the little that it took.
        let _ = std::fs::remove_file(&unfinished);
        return Err(cause);
    }
    let folder = path.parent().filter(|it| !it.as_os_str().is_empty()).unwrap_or(Path::new("."));
    File::open(folder)?.sync_all()
}

fn write_synced(path: &Path, mode: u32, bytes: &[u8]) -> Result<()> {
    let mut file = File::options().write(true).create_new(true).mode(mode).open(path)?;
    file.write_all(bytes)?;
    // Before it gets its name: else a power loss could leave the name with an empty file.
    file.sync_all()
}

fn check(kind: FileType) -> Result<()> {
    let what = match kind {
        _ if kind.is_file() => return Ok(()),
        _ if kind.is_dir() => "folder",
        _ if kind.is_fifo() => "pipe",
        _ if kind.is_socket() => "socket",
        _ => "device",
    };
    Err(Error::new(ErrorKind::InvalidInput, format!("it is a {what}, not a regular file")))
}

/// The whole file.
///
/// # Errors
/// If it cannot be read, is a pipe, a device or a folder, or has more than [`LARGEST_BYTES`].
pub fn read(path: &Path) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // One byte more shows that there is more: a file may grow.
    open(path)?.take(LARGEST_BYTES + 1).read_to_end(&mut bytes)?;
    if LARGEST_BYTES < bytes.len() as u64 {
        return Err(Error::new(ErrorKind::FileTooLarge, format!("has more than {LARGEST_BYTES} bytes")));
    }
    Ok(bytes)
}

/// As [`read`], of a text.
///
/// # Errors
/// As [`read`], or if it is not UTF-8.
pub fn read_text(path: &Path) -> Result<String> {
    String::from_utf8(read(path)?).map_err(|cause| Error::new(ErrorKind::InvalidData, cause))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whatever_an_earlier_attempt_left() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("key.pem");
        let unfinished = folder.path().join("key.pem.part");
        std::fs::write(&unfinished, "half").unwrap();
        for text in ["first", "second"] {
            replace(&path, 0o600, text.as_bytes()).unwrap();
            assert_eq!(read_text(&path).unwrap(), text);
            assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        }
        let taken = folder.path().join("taken");
        std::fs::create_dir(&taken).unwrap();
        replace(&taken, 0o600, b"a file where a folder is").unwrap_err();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "nothing unfinished is left");
    }

    #[test]
    fn only_regular_files_of_a_bounded_size_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("revoked.pem");
        let said = || read(&path).map(|it| it.len() as u64).map_err(|it| it.to_string());
        std::fs::write(&path, vec![b'x'; LARGEST_BYTES as usize]).unwrap();
        assert_eq!(said(), Ok(LARGEST_BYTES));
        std::fs::write(&path, vec![b'x'; LARGEST_BYTES as usize + 1]).unwrap();
        assert_eq!(said(), Err("has more than 1048576 bytes".to_owned()));
        // A hole: nothing of what is beyond the limit is read.
        File::create(&path).unwrap().set_len(1 << 40).unwrap();
        assert_eq!(said(), Err("has more than 1048576 bytes".to_owned()));
        assert_eq!(read(Path::new("/nowhere/key.pem")).unwrap_err().kind(), ErrorKind::NotFound);
    }

    #[test]
    fn what_is_not_a_regular_file_is_neither_read_nor_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::os::unix::fs::symlink("/dev/zero", path("device")).unwrap();
        assert!(std::process::Command::new("mkfifo").arg(path("pipe")).status().unwrap().success());
        let _listener = std::os::unix::net::UnixListener::bind(path("socket")).unwrap();
        std::fs::create_dir(path("folder")).unwrap();
        for name in ["device", "pipe", "socket", "folder"] {
            for open in [open, create, append, in_place] {
                let why = open(&path(name)).unwrap_err().to_string();
                assert!(why.starts_with(&format!("it is a {name}, not a regular file")), "{why}");
            }
        }
    }
}
