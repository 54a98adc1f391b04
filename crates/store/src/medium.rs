//! Where the files are: a folder, or in tests a medium that fails.

use std::io;
use std::path::PathBuf;

/// A flat folder of small files.
pub trait Medium {
    /// Makes the folder if it is missing.
    fn prepare(&mut self) -> io::Result<()>;

    /// Takes the lock of this name, which ends with the process at the latest. `false` if another process has it.
    fn lock(&mut self, name: &str) -> io::Result<bool>;

    /// Whether the lock of this name, which was taken, is still the one that another process would find: it is not once the folder was
    /// removed or replaced.
    fn has_lock(&mut self, name: &str) -> io::Result<bool> {
        let _ = name;
        Ok(true)
    }

    /// The whole content; `None` if there is no such file.
    fn read(&mut self, name: &str) -> io::Result<Option<Vec<u8>>>;

    /// Writes a new file in place of any other of this name, and syncs it.
    fn write(&mut self, name: &str, bytes: &[u8]) -> io::Result<()>;

    /// Renames a file or folder, in place of any file of the new name. Survives a loss of power only after
    /// [`Medium::sync_folder`].
    fn rename(&mut self, from: &str, to: &str) -> io::Result<()>;

    /// Syncs the names.
    fn sync_folder(&mut self) -> io::Result<()>;

    /// Whether there is anything of this name.
    fn exists(&mut self, name: &str) -> bool;

    /// The path of a file, for messages.
    fn path(&self, name: &str) -> PathBuf;
}
