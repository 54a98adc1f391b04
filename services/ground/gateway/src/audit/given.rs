//! The number that was given to a record last, in a file of its own that is overwritten in place.
//!
//! That needs no room: it is kept also while the disk is full and no record is. So the numbers go on where they were when the gateway is
//! started again, and records that could not be written, or were removed from the end, are missed.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt as _;
use std::path::{Path, PathBuf};

use crate::in_place::is_at;

const NAME: &str = "last-audit-number";
/// A number with all its digits, and a line feed.
const BYTES: usize = 21;

/// What the file says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Given {
    /// There is none, or it is empty: no number was given.
    Absent,
    /// The number that was given last.
    Number(u64),
    /// Something that no gateway writes.
    Garbled,
}

/// The file, open.
#[derive(Debug)]
pub(crate) struct GivenNumber {
    path: PathBuf,
    file: File,
}

impl GivenNumber {
    /// Opens the file in a folder, or makes it; with the number in it.
    ///
    /// # Errors
    /// Its path, and why it cannot be opened or read.
    pub(crate) fn open(folder: &Path) -> Result<(GivenNumber, u64), (PathBuf, io::Error)> {
        let path = folder.join(NAME);
        let opened = regular_file::in_place(&path).and_then(|file| Ok((read(&file)?, file)));
        let (given, file) = opened.map_err(|cause| (path.clone(), cause))?;
        // Without a number the records that there are say where the numbers go on.
        let number = if let Given::Number(number) = given { number } else { 0 };
        Ok((GivenNumber { path, file }, number))
    }

    /// The file, to wait until the disk has it.
    ///
    /// # Errors
    /// When the system has no more file descriptors.
    pub(crate) fn file(&self) -> io::Result<File> {
        self.file.try_clone()
    }

    /// Writes the number that is given now.
    ///
    /// # Errors
    /// When it cannot be written; at the first time the disk must have room.
    pub(crate) fn set(&mut self, number: u64) -> io::Result<()> {
        if !is_at(&self.file, &self.path) {
            self.file = regular_file::in_place(&self.path)?;
        }
        self.file.write_all_at(format!("{number:020}\n").as_bytes(), 0)
    }
}

/// What the file in the folder says.
///
/// # Errors
/// If it cannot be read.
pub(crate) fn in_folder(folder: &Path) -> io::Result<Given> {
    match regular_file::open(&folder.join(NAME)) {
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => Ok(Given::Absent),
        file => read(&file?),
    }
}

fn read(file: &File) -> io::Result<Given> {
    if file.metadata()?.len() == 0 {
        return Ok(Given::Absent);
    }
    let mut bytes = [0; BYTES];
    match file.read_exact_at(&mut bytes, 0) {
        Err(cause) if cause.kind() == io::ErrorKind::UnexpectedEof => return Ok(Given::Garbled),
        read => read?,
    }
    let digits = str::from_utf8(&bytes).ok().and_then(|it| it.strip_suffix('\n'));
    Ok(digits.and_then(|it| it.parse().ok()).map_or(Given::Garbled, Given::Number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_kept_and_what_is_none_is_told_apart() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(NAME);
        assert_eq!(in_folder(folder.path()).unwrap(), Given::Absent);
        let (mut given, before) = GivenNumber::open(folder.path()).unwrap();
        assert_eq!((before, in_folder(folder.path()).unwrap()), (0, Given::Absent));
        for number in [1, 9, 10, u64::MAX, 7] {
            given.set(number).unwrap();
            assert_eq!(in_folder(folder.path()).unwrap(), Given::Number(number));
        }
        assert_eq!(std::fs::metadata(&path).unwrap().len(), BYTES as u64);
        // Somebody removes it while it is used.
        std::fs::remove_file(&path).unwrap();
        given.set(8).unwrap();
        assert_eq!(GivenNumber::open(folder.path()).unwrap().1, 8);
        for garbled in ["7", "garbled, and longer than it", &"9".repeat(BYTES)] {
            std::fs::write(&path, garbled).unwrap();
            assert_eq!(in_folder(folder.path()).unwrap(), Given::Garbled, "{garbled}");
            assert_eq!(GivenNumber::open(folder.path()).unwrap().1, 0, "{garbled}");
        }
        std::fs::remove_file(&path).unwrap();
        std::fs::create_dir(&path).unwrap();
        assert_eq!(GivenNumber::open(folder.path()).unwrap_err().1.to_string(), "it is a folder, not a regular file");
    }
}
