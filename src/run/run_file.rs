//! How `kittiwake inject` and `kittiwake status` find a running system: the launcher leaves a file
//! with its addresses while it runs.

use std::fs::{File, Metadata};
use std::hash::{BuildHasher as _, RandomState};
use std::io::{self, Write as _};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use crate::output;
use crate::run::life_lock;

/// The router's socket in its folder.
pub const ROUTER_SOCKET: &str = "router.sock";

/// A new folder is cleared away by others only if they look in the moment before it is locked.
const MOST_TRIES: usize = 8;

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

/// What the file says.
#[derive(Serialize, Deserialize)]
struct Content {
    #[serde(flatten)]
    running: Running,
    /// Whether its launcher holds a lock on it: not every file system has locks.
    locked: bool,
}

/// The file of a running launcher; removed with the value.
pub struct RunFile {
    path: PathBuf,
    running: Running,
    /// Open, and locked where that is possible: readers so know that the launcher lives.
    file: File,
}

impl RunFile {
    /// Leaves the file; readers see the whole file or nothing.
    pub fn write(running: &Running) -> io::Result<RunFile> {
        let path = folder().join(format!("{}.json", new_name()));
        let file = write_locked(&path, running, lock)?;
        Ok(RunFile { path, running: running.clone(), file })
    }

    /// Writes it again where it was removed or replaced; whether it was.
    ///
    /// # Errors
    /// If that is not possible.
    pub fn restore(&mut self) -> io::Result<bool> {
        let is_gone = !life_lock::is_at(&self.file, &self.path);
        if is_gone {
            self.file = write_locked(&self.path, &self.running, lock)?;
        }
        Ok(is_gone)
    }
}

impl Drop for RunFile {
    fn drop(&mut self) {
        // Removed already, or stale from now on: readers look for the lock.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Whether this process has it from now on.
fn lock(file: &File) -> bool {
    file.try_lock().is_ok()
}

/// Nobody sees the file before it is whole, and locked where that is possible.
fn write_locked(path: &Path, running: &Running, lock: fn(&File) -> bool) -> io::Result<File> {
    path.parent().map_or(Ok(()), folder_of_runs)?;
    let unfinished = path.with_extension("part");
    write_private(&unfinished, &[])?;
    // For writing: a file system of another machine locks no file that is only read.
    let mut file = File::options().read(true).write(true).open(&unfinished)?;
    let content = Content { running: running.clone(), locked: lock(&file) };
    file.write_all(&serde_json::to_vec(&content)?)?;
    std::fs::rename(&unfinished, path)?;
    Ok(file)
}

/// Every running system of this user. Files of launchers that were killed are removed.
pub fn running() -> Vec<Running> {
    running_in(&folder()).unwrap_or_else(|why| {
        output::error_line(format_args!("no system that runs here is looked for: {why}"));
        Vec::new()
    })
}

/// A stranger's file could name any address, and orders would go there with the operator's token.
fn running_in(folder: &Path) -> io::Result<Vec<Running>> {
    match check_closed(folder) {
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        checked => checked?,
    }
    let entries = std::fs::read_dir(folder)?.flatten();
    let mut found: Vec<Running> = entries.filter_map(|it| read(&it.path())).collect();
    found.sort_by_key(|it| it.pid);
    Ok(found)
}

fn read(path: &Path) -> Option<Running> {
    if path.extension()? != "json" {
        return None;
    }
    let file = regular_file::open(path).ok()?;
    if file.metadata().ok()?.uid() != own() {
        return None;
    }
    let Content { running, locked } = serde_json::from_str(&io::read_to_string(&file).ok()?).ok()?;
    // Where there are no locks, only the process id is left to go by.
    let is_taken = locked.then(|| life_lock::is_taken(&file)).flatten();
    if is_taken.unwrap_or_else(|| is_alive(running.pid)) {
        return Some(running);
    }
    let _ = std::fs::remove_file(path);
    None
}

/// Removes the folders of processes that were killed: those that are nobody's any more. The process that removes
/// one holds it meanwhile.
fn clear_away(base: &Path) {
    for entry in std::fs::read_dir(base).into_iter().flatten().flatten() {
        let is_folder = entry.file_type().is_ok_and(|it| it.is_dir());
        if is_folder
            && entry.file_name().to_str().is_some_and(is_of_run)
            && let Ok(Some(_taken)) = life_lock::take(&entry.path())
        {
            let _ = std::fs::remove_dir_all(entry.path());
        }
    }
}

/// A name that no other run has: a process of another namespace may have the same process id.
fn new_name() -> String {
    let differs = RandomState::new().hash_one(());
    format!("{}-{:08x}", std::process::id(), differs >> 32)
}

/// Whether a folder has such a name, followed by what it is for.
fn is_of_run(name: &str) -> bool {
    let parts = name.split_once('.').and_then(|(it, _)| it.split_once('-'));
    parts.is_some_and(|(pid, differs)| pid.parse::<u32>().is_ok() && u32::from_str_radix(differs, 16).is_ok())
}

/// Whether the process exists: signal 0 is checked but not delivered.
fn is_alive(pid: u32) -> bool {
    i32::try_from(pid).is_ok_and(|pid| nix::sys::signal::kill(nix::unistd::Pid::from_raw(pid), None).is_ok())
}

/// A file that nobody else can read; there must be none yet.
pub fn write_private(path: &Path, bytes: &[u8]) -> io::Result<()> {
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
    base.join(format!("kittiwake-{}", own()))
}

/// Where a router listens, and processes look for it, if nothing else is said: a socket in a folder that no other user can
/// enter. systemd names that folder; else it is that of this user's running systems.
pub fn router_locator() -> String {
    let named = std::env::var_os("RUNTIME_DIRECTORY").map(PathBuf::from).filter(|it| it.is_absolute());
    bus::sockets::locator_of(&named.unwrap_or_else(folder).join(ROUTER_SOCKET))
}

/// A folder of this user's own; where there is none, one that nobody else can enter.
pub fn private_folder(folder: &Path) -> io::Result<()> {
    use std::os::unix::fs::DirBuilderExt;
    std::fs::DirBuilder::new().recursive(true).mode(0o700).create(folder)?;
    check_owner(folder).map(drop)
}

/// A folder of running systems, which nobody else can enter.
fn folder_of_runs(folder: &Path) -> io::Result<()> {
    private_folder(folder)?;
    check_closed(folder)
}

/// Whether nobody but this user can put files into the folder, or take any out.
fn check_closed(folder: &Path) -> io::Result<()> {
    let mode = check_owner(folder)?.mode() & 0o777;
    if mode & 0o077 == 0 {
        return Ok(());
    }
    Err(io::Error::other(format!("{} may be entered by others (mode {mode:o}): `chmod 700` it", folder.display())))
}

fn check_owner(folder: &Path) -> io::Result<Metadata> {
    let found = std::fs::symlink_metadata(folder)?;
    if found.uid() == own() {
        return Ok(found);
    }
    Err(io::Error::other(format!("{} belongs to user {}, expected {}", folder.display(), found.uid(), own())))
}

fn own() -> u32 {
    nix::unistd::getuid().as_raw()
}

/// A folder of one run of this process, removed with the value. Until then it is locked, and so nobody else clears it away.
pub struct RunFolder(pub PathBuf, Mutex<Option<File>>);

impl RunFolder {
    /// Makes it; `what` distinguishes it from the process's other folders.
    ///
    /// # Errors
    /// If that is not possible.
    pub fn create(what: &str) -> io::Result<RunFolder> {
        RunFolder::create_in(&folder(), what)
    }

    /// The same in memory, where there is a place for that: what ends with the run need not wait for a disk, which may take
    /// seconds while the machine builds or copies something. Not so for one that `outlasts_session`, its user's last one.
    ///
    /// # Errors
    /// As [`RunFolder::create`].
    pub fn create_in_memory(what: &str, outlasts_session: bool) -> io::Result<RunFolder> {
        let places = places_in_memory(std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from), outlasts_session);
        let mut places = places.iter().filter(|it| it.is_dir()).map(|it| of_user(it));
        let in_memory = places.find_map(|base| RunFolder::create_in(&base, what).ok());
        in_memory.map_or_else(|| RunFolder::create(what), Ok)
    }

    fn create_in(base: &Path, what: &str) -> io::Result<RunFolder> {
        use std::os::unix::fs::DirBuilderExt as _;
        folder_of_runs(base)?;
        clear_away(base);
        for _ in 0..MOST_TRIES {
            let path = base.join(format!("{}.{what}", new_name()));
            std::fs::DirBuilder::new().mode(0o700).create(&path)?;
            match life_lock::take(&path) {
                // Who clears away was first, and took it for one that was left behind.
                Ok(None) => {}
                Err(cause) if cause.kind() == io::ErrorKind::NotFound => {}
                // Where there are no locks, nobody clears away.
                taken => return Ok(RunFolder(path, Mutex::new(taken.ok().flatten()))),
            }
        }
        Err(io::Error::other(format!("each new folder in {} is cleared away at once", base.display())))
    }

    /// Keeps it from being cleared away by others, also where it was removed and made again.
    pub fn hold(&self) {
        let mut lock = self.1.lock().unwrap_or_else(PoisonError::into_inner);
        if !lock.as_ref().is_some_and(|it| life_lock::is_at(it, &self.0)) {
            // If it is not there now, it may be later.
            *lock = life_lock::take(&self.0).ok().flatten();
        }
    }
}

/// Where there is memory for files. At the end of a user's last session the operating system removes what that user has there.
fn places_in_memory(of_session: Option<PathBuf>, outlasts_session: bool) -> Vec<PathBuf> {
    let places = of_session.into_iter().filter(|it| it.is_absolute()).chain(["/dev/shm".into()]);
    places.filter(|_| !outlasts_session).collect()
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
        folder.hold();
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
    let read = regular_file::open(path).and_then(|it| it.take(bytes.len() as u64 + 1).read_to_end(&mut found));
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
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    #[test]
    fn what_was_written_is_written_again_whatever_stands_in_its_place() {
        #[track_caller]
        fn check(spoil: impl Fn(&Path), expected: bool) {
            let folder = RunFolder(tempfile::tempdir().unwrap().keep(), Mutex::new(None));
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

    fn private_tempdir() -> tempfile::TempDir {
        tempfile::Builder::new().permissions(PermissionsExt::from_mode(0o700)).tempdir().unwrap()
    }

    fn system() -> Running {
        Running {
            pid: std::process::id(),
            connect: "tcp/127.0.0.1:1".into(),
            http: format!("http://127.0.0.1/{}", new_name()),
            token: "secret".into(),
            vehicle: "uav1".into(),
            config: "config/kittiwake.toml".into(),
            ca: None,
        }
    }

    #[test]
    fn a_running_system_is_found_until_its_file_is_dropped() {
        let me = system();
        let file = RunFile::write(&me).unwrap();
        assert!(running().contains(&me));
        drop(file);
        assert!(!running().contains(&me));
    }

    #[test]
    fn a_run_file_that_is_removed_or_replaced_in_flight_is_written_again() {
        let me = system();
        let mut file = RunFile::write(&me).unwrap();
        assert!(!file.restore().unwrap());
        std::fs::remove_file(&file.path).unwrap();
        assert!(file.restore().unwrap());
        assert!(running().contains(&me));
        std::fs::remove_file(&file.path).unwrap();
        std::fs::write(&file.path, "{}").unwrap();
        assert!(file.restore().unwrap());
        assert!(running().contains(&me));
    }

    #[test]
    fn a_run_file_is_believed_while_its_launcher_lives_and_not_while_its_process_id_is_used() {
        // Of a launcher in another namespace, whose id means nothing here.
        let elsewhere = Running { pid: u32::MAX, ..system() };
        let file = RunFile::write(&elsewhere).unwrap();
        assert!(running().contains(&elsewhere));
        // Of one that was killed, whose id is used again.
        let killed = Running { pid: std::process::id(), ..elsewhere };
        let content = Content { running: killed.clone(), locked: true };
        write_private(&file.path, &serde_json::to_vec(&content).unwrap()).unwrap();
        // A process that another test starts now holds a copy of the file for a moment: closing ours is not enough.
        file.file.unlock().unwrap();
        assert!(!running().contains(&killed));
        assert!(!file.path.exists(), "what is left behind is removed");
    }

    #[test]
    fn a_run_file_without_a_lock_is_believed_while_there_is_a_process_of_its_id() {
        let folder = private_tempdir();
        let (flying, killed) = (system(), Running { pid: u32::MAX, ..system() });
        let path = folder.path().join("12-00c0ffee.json");
        // Where nothing can be locked.
        let write = |it: &Running| drop(write_locked(&path, it, |_| false).unwrap());
        write(&flying);
        assert_eq!(read(&path), Some(flying.clone()));
        assert!(path.exists());
        write(&killed);
        assert_eq!(read(&path), None);
        assert!(!path.exists(), "what is left behind is removed");
    }

    #[test]
    fn a_strangers_run_file_is_not_believed() {
        #[track_caller]
        fn check(change: impl Fn(&Path, &Path), expected: Result<usize, &str>) {
            let base = private_tempdir();
            let folder = base.path().join("kittiwake");
            let path = folder.join("12-00c0ffee.json");
            let flying = system();
            let _file = write_locked(&path, &flying, lock).unwrap();
            assert_eq!(running_in(&folder).unwrap(), [flying]);
            change(&folder, &path);
            match (running_in(&folder), expected) {
                (Ok(found), Ok(count)) => assert_eq!(found.len(), count),
                (Err(why), Err(part)) => assert!(why.to_string().contains(part), "{why}"),
                other => panic!("{other:?}"),
            }
        }
        let mode = |it: &Path, mode| std::fs::set_permissions(it, PermissionsExt::from_mode(mode)).unwrap();
        check(|_, _| {}, Ok(1));
        check(|folder, _| mode(folder, 0o1777), Err("may be entered by others (mode 777): `chmod 700` it"));
        check(|folder, _| mode(folder, 0o755), Err("(mode 755)"));
        // Only root can make a stranger's.
        if own() == 0 {
            let give = |it: &Path| std::os::unix::fs::chown(it, Some(65_534), None).unwrap();
            check(|folder, _| give(folder), Err("belongs to user 65534, expected 0"));
            check(|_, path| give(path), Ok(0));
        }
        // What waits for somebody at its other end is not waited for.
        let pipe = |_: &Path, path: &Path| {
            std::fs::remove_file(path).unwrap();
            assert!(std::process::Command::new("mkfifo").arg(path).status().unwrap().success());
        };
        check(pipe, Ok(0));
        check(|folder, _| std::fs::remove_dir_all(folder).unwrap(), Ok(0));
    }

    #[test]
    fn a_run_file_is_locked_as_a_file_that_is_written() {
        let folder = private_tempdir();
        let path = folder.path().join("12-00c0ffee.json");
        let mut file = write_locked(&path, &system(), lock).unwrap();
        // What is only read cannot be locked in each file system.
        file.write_all(b"\n").unwrap();
        let content: Content = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        assert!(content.locked);
    }

    #[test]
    fn folders_of_runs_that_were_killed_are_cleared_away_and_no_others() {
        let base = private_tempdir();
        let create = || RunFolder::create_in(base.path(), "state").unwrap();
        let killed = create();
        std::fs::write(killed.0.join("mcm.0"), "a state").unwrap();
        // A process that another test starts now holds a copy for a moment: closing ours is not enough.
        killed.1.lock().unwrap().take().unwrap().unlock().unwrap();
        for name in ["notes", "12.state", "flight-2.state"] {
            std::fs::create_dir(base.path().join(name)).unwrap();
        }
        // Two of one process id, as two in namespaces of their own may be.
        let (flying, other) = (create(), create());
        assert!(!killed.0.exists());
        assert!(flying.0.is_dir() && flying.0 != other.0);
        // What was removed and made again is still that of a run.
        std::fs::remove_dir(&flying.0).unwrap();
        flying.hold();
        std::fs::create_dir(&flying.0).unwrap();
        flying.hold();
        drop(other);
        drop(create());
        let mut left: Vec<_> = std::fs::read_dir(base.path()).unwrap().map(|it| it.unwrap().path()).collect();
        left.sort();
        let mut expected: Vec<_> = ["notes", "12.state", "flight-2.state"].map(|it| base.path().join(it)).into();
        expected.push(flying.0.clone());
        expected.sort();
        assert_eq!(left, expected);
    }

    #[test]
    fn a_state_that_is_to_outlast_its_users_session_is_not_where_that_is_cleared() {
        #[track_caller]
        fn check(of_session: Option<&str>, outlasts_session: bool, expected: &[&str]) {
            let places = places_in_memory(of_session.map(PathBuf::from), outlasts_session);
            assert_eq!(places, expected.iter().map(PathBuf::from).collect::<Vec<_>>());
        }
        check(Some("/run/user/1000"), false, &["/run/user/1000", "/dev/shm"]);
        check(Some("run"), false, &["/dev/shm"]);
        check(None, false, &["/dev/shm"]);
        check(Some("/run/user/1000"), true, &[]);
    }
}
