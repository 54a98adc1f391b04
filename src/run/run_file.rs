//! How `kittiwake inject` and `kittiwake status` find a running system: the launcher leaves a file
//! with its addresses while it runs.

use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

/// The router's socket in its folder.
pub const ROUTER_SOCKET: &str = "router.sock";

/// Where a running system can be reached.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Running {
    /// The launcher's process id.
    pub pid: u32,
    /// The router's locator.
    pub connect: String,
    /// The gateway's address.
    pub http: String,
    /// A token with every role for this run; empty if the launcher was started with tokens from elsewhere.
    pub token: String,
    /// The vehicle's name.
    pub vehicle: String,
    /// The configuration file that its processes read.
    pub config: PathBuf,
    /// The CA file for the gateway's certificate; absent without encryption.
    pub ca: Option<PathBuf>,
}

/// The file of a running launcher; removed with the value.
pub struct RunFile(PathBuf);

impl RunFile {
    /// Leaves the file; readers see all of it or nothing.
    pub fn write(running: &Running) -> io::Result<RunFile> {
        let folder = folder();
        private_folder(&folder)?;
        let path = folder.join(format!("{}.json", running.pid));
        let unfinished = path.with_extension("part");
        write_private(&unfinished, &serde_json::to_vec(running)?)?;
        std::fs::rename(&unfinished, &path)?;
        Ok(RunFile(path))
    }
}

impl Drop for RunFile {
    fn drop(&mut self) {
        // Removed already, or stale from now on: readers check the process.
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Every running system of this user. Files of launchers that were killed are removed.
pub fn running() -> Vec<Running> {
    let entries = std::fs::read_dir(folder()).into_iter().flatten().flatten();
    let mut found: Vec<Running> = entries.filter_map(|it| read(&it.path())).collect();
    found.sort_by_key(|it| it.pid);
    found
}

fn read(path: &Path) -> Option<Running> {
    if path.extension()? != "json" {
        return None;
    }
    let running: Running = serde_json::from_slice(&std::fs::read(path).ok()?).ok()?;
    if is_alive(running.pid) {
        return Some(running);
    }
    let _ = std::fs::remove_file(path);
    None
}

/// Removes the folders of processes that were killed.
fn clear_away(base: &Path) {
    for entry in std::fs::read_dir(base).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let pid = name.to_str().and_then(|it| it.split_once('.')?.0.parse().ok());
        if pid.is_some_and(|it| !is_alive(it)) && entry.file_type().is_ok_and(|it| it.is_dir()) {
            // Another command may be removing it at the same time.
            let _ = std::fs::remove_dir_all(entry.path());
        }
    }
}

/// Whether the process exists: signal 0 is checked but not delivered.
fn is_alive(pid: u32) -> bool {
    i32::try_from(pid).is_ok_and(|pid| nix::sys::signal::kill(nix::unistd::Pid::from_raw(pid), None).is_ok())
}

/// A file that nobody else can read; there must be none yet.
pub fn write_private(path: &Path, bytes: &[u8]) -> io::Result<()> {
    use std::io::Write;
    use std::os::unix::fs::OpenOptionsExt;
    // Left behind by a killed process of the same number.
    let _ = std::fs::remove_file(path);
    let mut file = std::fs::OpenOptions::new().write(true).create_new(true).mode(0o600).open(path)?;
    file.write_all(bytes)
}

/// Of this user's running systems.
pub fn folder() -> PathBuf {
    of_user(&std::env::temp_dir())
}

fn of_user(base: &Path) -> PathBuf {
    base.join(format!("kittiwake-{}", nix::unistd::getuid()))
}

/// Where a router listens, and processes look for it, if nothing else is said: a socket in a folder that no other user can
/// enter. systemd names that folder; else it is that of this user's running systems.
pub fn router_locator() -> String {
    let named = std::env::var_os("RUNTIME_DIRECTORY").map(PathBuf::from).filter(|it| it.is_absolute());
    bus::sockets::locator_of(&named.unwrap_or_else(folder).join(ROUTER_SOCKET))
}

/// A folder that nobody else can put files into.
pub fn private_folder(folder: &Path) -> io::Result<()> {
    use std::os::unix::fs::{DirBuilderExt, MetadataExt};
    std::fs::DirBuilder::new().recursive(true).mode(0o700).create(folder)?;
    let owner = std::fs::symlink_metadata(folder)?.uid();
    if owner == nix::unistd::getuid().as_raw() {
        Ok(())
    } else {
        Err(io::Error::other(format!("{} belongs to user {owner}", folder.display())))
    }
}

/// A folder of one run of this process, removed with the value.
pub struct RunFolder(pub PathBuf);

impl RunFolder {
    /// Makes it; `what` distinguishes it from the process's other folders.
    ///
    /// # Errors
    /// If that is not possible.
    pub fn create(what: &str) -> io::Result<RunFolder> {
        RunFolder::create_in(&folder(), what)
    }

    /// The same in memory, where there is a place for that: what ends with the run need not wait for a disk, which may take
    /// seconds while the machine builds or copies something.
    ///
    /// # Errors
    /// As [`RunFolder::create`].
    pub fn create_in_memory(what: &str) -> io::Result<RunFolder> {
        let of_session = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from).filter(|it| it.is_absolute());
        let places = of_session.into_iter().chain([PathBuf::from("/dev/shm")]).filter(|it| it.is_dir());
        let in_memory = places.map(|it| of_user(&it)).find_map(|base| RunFolder::create_in(&base, what).ok());
        in_memory.map_or_else(|| RunFolder::create(what), Ok)
    }

    fn create_in(base: &Path, what: &str) -> io::Result<RunFolder> {
        private_folder(base)?;
        clear_away(base);
        let path = base.join(format!("{}.{what}", std::process::id()));
        // Left behind by a killed process of the same number.
        let _ = std::fs::remove_dir_all(&path);
        private_folder(&path)?;
        Ok(RunFolder(path))
    }
}

/// What a run wrote into a folder of its own, to be written again where it was removed or changed: who cleans up temporary files does not
/// know that somebody flies with them.
#[derive(Debug, Default)]
pub struct Remembered(Vec<(PathBuf, Vec<u8>)>);

impl Remembered {
    /// All files in the folder, also in folders in it.
    ///
    /// # Errors
    /// If one cannot be read.
    pub fn of(folder: &Path) -> io::Result<Remembered> {
        let mut files = Vec::new();
        for entry in std::fs::read_dir(folder)? {
            let path = entry?.path();
            match path.is_dir() {
                true => files.extend(Remembered::of(&path)?.0),
                false => files.push((path.clone(), std::fs::read(&path)?)),
            }
        }
        Ok(Remembered(files))
    }

    /// Writes again what is not as it was written; whether anything was not.
    ///
    /// # Errors
    /// If that is not possible.
    pub fn restore(&self, folder: &RunFolder) -> io::Result<bool> {
        let spoiled: Vec<_> = self.0.iter().filter(|(path, bytes)| !holds(path, bytes)).collect();
        if spoiled.is_empty() {
            return Ok(false);
        }
        folder.0.parent().map_or(Ok(()), private_folder)?;
        private_folder(&folder.0)?;
        for (path, bytes) in spoiled {
            path.parent().map_or(Ok(()), std::fs::create_dir_all)?;
            if path.is_dir() {
                std::fs::remove_dir_all(path)?;
            } else if path.symlink_metadata().is_ok() {
                // Not into what somebody has linked to it, nor into a pipe.
                std::fs::remove_file(path)?;
            }
            write_private(path, bytes)?;
        }
        Ok(true)
    }
}

/// Whether a file has this content.
fn holds(path: &Path, bytes: &[u8]) -> bool {
    use std::io::Read as _;
    let mut found = Vec::new();
    // One byte more shows that there is more.
    let read = credentials::file::open(path).and_then(|it| it.take(bytes.len() as u64 + 1).read_to_end(&mut found));
    read.is_ok() && found == bytes
}

impl Drop for RunFolder {
    fn drop(&mut self) {
        // Removed already, or no longer needed.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_written_is_written_again_whatever_stands_in_its_place() {
        #[track_caller]
        fn check(spoil: impl Fn(&Path), expected: bool) {
            let folder = RunFolder(tempfile::tempdir().unwrap().keep());
            let file = folder.0.join("trees").join("main.xml");
            std::fs::create_dir(file.parent().unwrap()).unwrap();
            std::fs::write(&file, "as checked").unwrap();
            let written = Remembered::of(&folder.0).unwrap();
            spoil(&file);
            assert_eq!(written.restore(&folder).unwrap(), expected);
            assert_eq!(std::fs::read_to_string(&file).unwrap(), "as checked");
            assert!(!written.restore(&folder).unwrap());
        }
        let remove = |it: &Path| std::fs::remove_file(it).unwrap();
        check(|_| {}, false);
        check(remove, true);
        check(|it| std::fs::remove_dir_all(it.parent().unwrap()).unwrap(), true);
        check(|it| std::fs::write(it, "").unwrap(), true);
        check(|it| std::fs::write(it, "as checked, and more").unwrap(), true);
        let replace = |it: &Path, by: fn(&Path) -> std::io::Result<()>| {
            remove(it);
            by(it).unwrap();
        };
        check(|it| replace(it, |it| std::fs::create_dir(it)), true);
        check(|it| replace(it, |it| std::os::unix::fs::symlink("/dev/zero", it)), true);
    }

    #[test]
    fn a_running_system_is_found_until_its_file_is_dropped() {
        let me = Running {
            pid: std::process::id(),
            connect: "tcp/127.0.0.1:1".into(),
            http: "http://127.0.0.1:2".into(),
            token: "secret".into(),
            vehicle: "uav1".into(),
            config: "config/kittiwake.toml".into(),
            ca: None,
        };
        let file = RunFile::write(&me).unwrap();
        assert!(running().contains(&me));
        drop(file);
        assert!(!running().contains(&me));
    }
}
