//! What the files are like, so that they are read again when they have changed, and only then.

use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// What the files were like when they were looked at. Another one means that a file has been replaced, or that somebody else may read
/// it now.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stamp([Option<OfFile>; 4]);

#[derive(Debug, Clone, PartialEq, Eq)]
struct OfFile {
    inode: u64,
    size: u64,
    /// In seconds and nanoseconds: when its content changed.
    modified: (i64, i64),
    /// The same for its owner and its permissions: a file that could not be read may be readable with the same content.
    changed: (i64, i64),
}

impl Stamp {
    pub(crate) fn of(files: [&Path; 4]) -> Stamp {
        Stamp(files.map(|path| {
            let it = std::fs::metadata(path).ok()?;
            let (modified, changed) = ((it.mtime(), it.mtime_nsec()), (it.ctime(), it.ctime_nsec()));
            Some(OfFile { inode: it.ino(), size: it.size(), modified, changed })
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt as _;

    #[test]
    fn a_file_that_somebody_else_may_read_now_is_another_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("revoked.pem");
        std::fs::write(&path, "a list").unwrap();
        let before = Stamp::of([&path; 4]);
        assert_eq!(before, Stamp::of([&path; 4]));
        // The clock of a file system ticks some hundred times a second: as often as it takes.
        let differs = (0..1_000_000).any(|turn| {
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600 + turn % 2)).unwrap();
            Stamp::of([&path; 4]) != before
        });
        assert!(differs, "as if nothing had happened");
    }
}
