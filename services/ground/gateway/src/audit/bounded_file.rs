//! The file of the refusals: it is renamed when it reaches its limit, in place of the one that was renamed before.

use std::fs::File;
use std::io::{self, Write};
use std::path::PathBuf;

use kittiwake_proto::json::to_json;
use kittiwake_proto::v1::RefusalRecord;

use crate::in_place::is_at;

/// Bytes at which the file is renamed.
const MAX_BYTES: u64 = 1024 * 1024;

/// The file, open.
#[derive(Debug)]
pub(super) struct BoundedFile {
    path: PathBuf,
    file: File,
    bytes: u64,
}

impl BoundedFile {
    /// Opens the file, or makes it.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(super) fn open(path: PathBuf) -> io::Result<BoundedFile> {
        let file = regular_file::append(&path)?;
        Ok(BoundedFile { bytes: file.metadata()?.len(), path, file })
    }

    /// Appends a line.
    ///
    /// # Errors
    /// When it cannot be written as a whole.
    pub(super) fn write(&mut self, refusal: &RefusalRecord) -> io::Result<()> {
        let line = format!("{}\n", to_json(refusal));
        if !is_at(&self.file, &self.path) {
            self.file = regular_file::append(&self.path)?;
            self.bytes = self.file.metadata()?.len();
        }
        if MAX_BYTES < self.bytes + line.len() as u64 {
            std::fs::rename(&self.path, self.path.with_extension("1.jsonl"))?;
            (self.file, self.bytes) = (regular_file::append(&self.path)?, 0);
        }
        self.bytes += line.len() as u64;
        self.file.write_all(line.as_bytes())
    }

    /// One that is open already.
    #[cfg(test)]
    pub(super) fn of(path: PathBuf, file: File) -> BoundedFile {
        BoundedFile { path, file, bytes: 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn however_much_is_written_two_files_of_a_bounded_size_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let mut file = BoundedFile::open(path("refusals.jsonl")).unwrap();
        for n in 0..10_000 {
            file.write(&RefusalRecord { what: format!("{n:0160}"), ..Default::default() }).unwrap();
        }
        let bytes = |name: &str| std::fs::metadata(path(name)).unwrap().len();
        assert!(bytes("refusals.jsonl") <= MAX_BYTES && bytes("refusals.1.jsonl") <= MAX_BYTES);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
    }
}
