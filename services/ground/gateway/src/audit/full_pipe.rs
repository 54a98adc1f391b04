//! A file that takes no bytes until it is read, as one on a disk that hangs: a full pipe.

use std::fs::File;
use std::io::{ErrorKind, Read as _, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde_json::Value;

/// Longer than anything takes on a busy machine.
const LIMIT: Duration = Duration::from_secs(20);

pub(crate) struct FullPipe {
    pub(crate) path: PathBuf,
    /// Both ends, neither of which waits.
    ends: File,
    text: String,
}

impl FullPipe {
    pub(crate) fn new(folder: &Path) -> FullPipe {
        let path = folder.join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        let nonblock = nix::libc::O_NONBLOCK;
        let mut ends = File::options().read(true).write(true).custom_flags(nonblock).open(&path).unwrap();
        for size in [4096, 1] {
            while ends.write_all(&vec![b'\n'; size]).is_ok() {}
        }
        FullPipe { path, ends, text: String::new() }
    }

    /// An end that waits, as a file on a disk does.
    pub(crate) fn writer(&self) -> File {
        File::options().write(true).open(&self.path).unwrap()
    }

    /// Reads from now on what the pipe takes, until there are this many lines.
    pub(crate) fn lines(&mut self, count: usize) -> Vec<Value> {
        wait_for("lines in the pipe", || {
            let mut bytes = [0; 4096];
            match self.ends.read(&mut bytes) {
                Ok(read) => self.text += str::from_utf8(&bytes[..read]).unwrap(),
                Err(cause) => assert_eq!(cause.kind(), ErrorKind::WouldBlock, "{cause}"),
            }
            let whole = self.text.rsplit_once('\n').map_or("", |(whole, _)| whole);
            let lines = whole.lines().filter(|it| !it.is_empty());
            let lines: Vec<Value> = lines.map(|it| serde_json::from_str(it).unwrap()).collect();
            (count <= lines.len()).then_some(lines)
        })
    }
}

/// What `look` finds, once there is something.
#[track_caller]
pub(crate) fn wait_for<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let limit = Instant::now() + LIMIT;
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(Instant::now() < limit, "waited for {what}");
        std::thread::yield_now();
    }
}
