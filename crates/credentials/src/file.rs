//! Reads files with certificates, keys and lists of what is revoked. They are read again in flight, so none of them may hold a
//! process up or take its memory, whatever somebody has put in its place.

use std::fs::File;
use std::io::{Error, ErrorKind, Read as _, Result};
use std::path::Path;

/// The most bytes of such a file: some ten thousand entries of a list of what is revoked, and far more than any key has.
pub const LARGEST_BYTES: u64 = 1 << 20;

/// The whole file.
///
/// # Errors
/// If it cannot be read, is a pipe, a device or a folder, or has more than [`LARGEST_BYTES`].
pub fn read(path: &Path) -> Result<Vec<u8>> {
    // Before it is opened: to open a pipe waits for somebody who writes.
    if !std::fs::metadata(path)?.is_file() {
        return Err(Error::new(ErrorKind::InvalidInput, "is no regular file"));
    }
    let mut bytes = Vec::new();
    // One byte more shows that there is more: a file may grow.
    File::open(path)?.take(LARGEST_BYTES + 1).read_to_end(&mut bytes)?;
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
        assert_eq!(read(folder.path()).unwrap_err().to_string(), "is no regular file");
        assert_eq!(read(Path::new("/nowhere/key.pem")).unwrap_err().kind(), ErrorKind::NotFound);
    }
}
