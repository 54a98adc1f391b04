//! Which state of the files has been looked into, so that they are read again when they have become others, and only then.

use std::os::unix::fs::MetadataExt;
use std::path::Path;

use crate::InvalidCredentials;

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

/// The state of the files that was looked into last.
#[derive(Debug, Clone)]
pub struct Seen {
    stamp: Stamp,
    /// The state of the files that was reported last as not usable, and why.
    told: Option<(Stamp, String)>,
}

impl Seen {
    /// Files like this are in use.
    pub fn new(stamp: Stamp) -> Seen {
        Seen { stamp, told: None }
    }

    /// The state of the files that counts as looked into.
    pub fn stamp(&self) -> &Stamp {
        &self.stamp
    }

    /// What `read` returns for the files, whose present state is `stamp`; `None` if nothing has changed. Unusable files are reported once,
    /// and are left alone until they change; but those that could not be read are read again each time, since what stood in the way,
    /// such as a limit of open files, may pass without a trace in them.
    pub fn look<T>(
        &mut self,
        stamp: Stamp,
        read: impl FnOnce() -> Result<T, InvalidCredentials>,
    ) -> Option<Result<T, InvalidCredentials>> {
        if stamp == self.stamp {
            return None;
        }
        let found = read();
        if !matches!(found, Err(InvalidCredentials::Unreadable { .. })) {
            self.stamp = stamp.clone();
        }
        let news = found.as_ref().err().map(|it| (stamp, it.to_string()));
        if news.is_some() && news == self.told {
            return None;
        }
        self.told = news;
        Some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;
    use std::os::unix::fs::PermissionsExt as _;

    fn stamp_of(path: &Path) -> Stamp {
        Stamp::of([path; 4])
    }

    /// Two states of a file.
    fn stamps() -> [Stamp; 2] {
        let folder = tempfile::tempdir().unwrap();
        ["one", "the other"].map(|text| {
            std::fs::write(folder.path().join("file"), text).unwrap();
            stamp_of(&folder.path().join("file"))
        })
    }

    fn unreadable(kind: std::io::ErrorKind) -> InvalidCredentials {
        InvalidCredentials::Unreadable { path: "revoked.pem".into(), source: kind.into() }
    }

    fn malformed() -> InvalidCredentials {
        InvalidCredentials::Malformed { path: "revoked.pem".into(), expected: "revocation list" }
    }

    #[test]
    fn a_file_that_somebody_else_may_read_now_is_another_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("revoked.pem");
        std::fs::write(&path, "a list").unwrap();
        let before = stamp_of(&path);
        assert_eq!(before, stamp_of(&path));
        // The clock of a file system ticks some hundred times a second: as often as it takes.
        let differs = (0..1_000_000).any(|turn| {
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600 + turn % 2)).unwrap();
            stamp_of(&path) != before
        });
        assert!(differs, "as if nothing had happened");
    }

    #[test]
    fn files_that_cannot_be_read_are_read_again_although_they_have_not_changed() {
        let [used, now] = stamps();
        let mut seen = Seen::new(used.clone());
        let denied = || Err::<(), _>(unreadable(std::io::ErrorKind::PermissionDenied));
        assert!(matches!(seen.look(now.clone(), denied), Some(Err(_))), "it is told");
        let read = Cell::new(false);
        let told_again = seen.look(now.clone(), || {
            read.set(true);
            denied()
        });
        assert!(told_again.is_none() && read.get(), "it is told once, and tried again");
        assert!(
            seen.look(now.clone(), || Err::<(), _>(unreadable(std::io::ErrorKind::TimedOut))).is_some(),
            "another cause"
        );
        assert_eq!(seen.stamp(), &used, "those in use are the ones of before");
        assert!(matches!(seen.look(now.clone(), || Ok(())), Some(Ok(()))), "it can be read after all");
        assert_eq!(seen.stamp(), &now);
        assert!(seen.look(now, || -> Result<(), _> { panic!("nothing is new") }).is_none());
    }

    #[test]
    fn files_that_are_no_credentials_are_left_alone_until_they_change() {
        let [used, now] = stamps();
        let mut seen = Seen::new(used.clone());
        assert!(matches!(seen.look(now.clone(), || Err::<(), _>(malformed())), Some(Err(_))));
        assert!(seen.look(now, || -> Result<(), _> { panic!("they have not changed") }).is_none());
        assert!(matches!(seen.look(used, || Ok(())), Some(Ok(()))), "they are those of before again");
    }

    #[test]
    fn what_comes_back_after_it_was_good_is_told_again() {
        let [used, now] = stamps();
        let mut seen = Seen::new(used.clone());
        let gone = || Err::<(), _>(unreadable(std::io::ErrorKind::NotFound));
        assert!(seen.look(now.clone(), gone).is_some());
        for good in [now.clone(), used] {
            assert!(matches!(seen.look(good, || Ok(())), Some(Ok(()))));
        }
        assert!(matches!(seen.look(now, gone), Some(Err(_))));
    }
}
