//! Opens files of the folders for certificates and for access: certificates, keys, lists of what is revoked, and the audit trail. They are
//! read and written in flight, so none of them may hold a process up or take its memory, whatever somebody has put in its place:
//! a pipe waits for somebody at its other end, and a device may never end.

use std::fs::{File, OpenOptions};
use std::io::{Error, ErrorKind, Read as _, Result, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;

/// The most bytes that [`read`] reads: some ten thousand entries of a list of what is revoked, and far more than any key has.
pub const LARGEST_BYTES: u64 = 1 << 20;

/// Opens a file to read it.
///
/// # Errors
/// If it cannot be opened, or is no regular file.
pub fn open(path: &Path) -> Result<File> {
    // Before it is opened: to open a pipe waits already.
    if !std::fs::metadata(path)?.is_file() {
        return Err(irregular());
    }
    File::open(path)
}

/// Opens a file to write at its end; it is made for the owner alone if there is none.
///
/// # Errors
/// If it cannot be opened or made, or is no regular file.
pub fn append(path: &Path) -> Result<File> {
    make(path, File::options().append(true))
}

/// Opens a file to read and to write anywhere in it; it is made for the owner alone if there is none.
///
/// # Errors
/// As [`append`].
pub fn in_place(path: &Path) -> Result<File> {
    make(path, File::options().read(true).write(true))
}

fn make(path: &Path, options: &mut OpenOptions) -> Result<File> {
    if std::fs::metadata(path).is_ok_and(|it| !it.is_file()) {
        return Err(irregular());
    }
    options.create(true).mode(0o600).open(path)
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

fn irregular() -> Error {
    Error::new(ErrorKind::InvalidInput, "is no regular file")
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
/// As [`read`], or if it is no UTF-8.
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
        std::fs::remove_file(&path).unwrap();
        std::os::unix::fs::symlink("/dev/zero", &path).unwrap();
        assert_eq!(said(), Err("is no regular file".to_owned()));
        std::fs::remove_file(&path).unwrap();
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        assert_eq!(said(), Err("is no regular file".to_owned()));
        assert_eq!(append(&path).unwrap_err().to_string(), "is no regular file");
        assert_eq!(read(folder.path()).unwrap_err().to_string(), "is no regular file");
        assert_eq!(read(Path::new("/nowhere/key.pem")).unwrap_err().kind(), ErrorKind::NotFound);
    }
}
