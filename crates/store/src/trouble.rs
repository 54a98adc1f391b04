//! Why a state cannot be read or written.

use std::io::{self, ErrorKind};
use std::path::PathBuf;

/// What is wrong, and with which file. Operators read it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Trouble {
    /// Permissions, or the medium itself.
    #[error("{} cannot be read: {cause}", file.display())]
    Unreadable {
        /// Where.
        file: PathBuf,
        /// What the operating system said.
        cause: String,
    },
    /// A folder, a device or a pipe is in place of a file, or a file in place of the folder.
    #[error("{} is of another kind: something else stands where a file or a folder was expected", file.display())]
    WrongKind {
        /// Where.
        file: PathBuf,
    },
    /// Empty, cut short or changed since.
    #[error("{} is garbled: {what}", file.display())]
    Garbled {
        /// Where.
        file: PathBuf,
        /// What was noticed.
        what: String,
    },
    /// The folder is another owner's. Nothing is written there.
    #[error("{} belongs to `{owner}`, not to `{expected}`: name a folder of its own", file.display())]
    Foreign {
        /// Where.
        file: PathBuf,
        /// Whose it is.
        owner: String,
        /// Whose was expected.
        expected: String,
    },
    /// Written by a program that knows more.
    #[error("{} was written by a newer program: format {found}, and this one knows {known}", file.display())]
    Newer {
        /// Where.
        file: PathBuf,
        /// Its format version.
        found: u32,
        /// The newest version that this program knows.
        known: u32,
    },
    /// A generation that was saved is not there.
    #[error("{} is missing, or of another generation than expected: a later state may be lost", file.display())]
    Missing {
        /// Where.
        file: PathBuf,
    },
    /// The process before could not save its last state.
    #[error("a later state than {} could not be written", file.display())]
    Outdated {
        /// Where.
        file: PathBuf,
    },
    /// No space, no quota, or a limit on the size of files.
    #[error("{} cannot be written, there is no space: {cause}", file.display())]
    Full {
        /// Where.
        file: PathBuf,
        /// What the operating system said.
        cause: String,
    },
    /// A file system or a folder that may not be written to.
    #[error("{} cannot be written, it is read-only: {cause}", file.display())]
    ReadOnly {
        /// Where.
        file: PathBuf,
        /// What the operating system said.
        cause: String,
    },
    /// Anything else that prevents writing.
    #[error("{} cannot be written: {cause}", file.display())]
    Unwritable {
        /// Where.
        file: PathBuf,
        /// What the operating system said.
        cause: String,
    },
    /// There is no state where a process that has run before must have left one.
    #[error("{} has no state of `{name}`, which has run before", folder.display())]
    Gone {
        /// Where it was.
        folder: PathBuf,
        /// Whose it is.
        name: String,
    },
    /// Somebody has removed the folder, or put another one in its place: what is there now is another process's.
    #[error("the state folder was replaced: {} is not the lock that this process has; start it again", lock.display())]
    Replaced {
        /// Where the lock was.
        lock: PathBuf,
    },
    /// Another process has taken it meanwhile.
    #[error("{} is locked by another process", file.display())]
    InUse {
        /// The lock.
        file: PathBuf,
    },
}

impl Trouble {
    pub(crate) fn of_reading(file: PathBuf, cause: &io::Error) -> Trouble {
        match cause.kind() {
            ErrorKind::IsADirectory | ErrorKind::NotADirectory => Trouble::WrongKind { file },
            _ => Trouble::Unreadable { file, cause: cause.to_string() },
        }
    }

    pub(crate) fn of_writing(file: PathBuf, cause: &io::Error) -> Trouble {
        let text = cause.to_string();
        match cause.kind() {
            ErrorKind::IsADirectory | ErrorKind::NotADirectory => Trouble::WrongKind { file },
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
                Trouble::Full { file, cause: text }
            }
            ErrorKind::ReadOnlyFilesystem | ErrorKind::PermissionDenied => Trouble::ReadOnly { file, cause: text },
            _ => Trouble::Unwritable { file, cause: text },
        }
    }

    pub(crate) fn is_foreign(&self) -> bool {
        matches!(self, Trouble::Foreign { .. })
    }
}
