//! The shipped configuration with mistakes made in it.

use std::path::{Path, PathBuf};

use super::shipped;

/// A copy of the shipped configuration; gone with the value.
pub struct Files(tempfile::TempDir);

impl Files {
    /// The files as shipped.
    pub fn shipped() -> Files {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        copy(&shipped(), folder.path());
        Files(folder)
    }

    /// With the first `from` in `file` replaced by `to`.
    #[track_caller]
    pub fn with(self, file: &str, from: &str, to: &str) -> Files {
        let path = self.0.path().join(file);
        let text = std::fs::read_to_string(&path).expect("the file is there");
        assert!(text.contains(from), "`{from}` is not in {file}");
        std::fs::write(&path, text.replacen(from, to, 1)).expect("the file can be written");
        self
    }

    /// As shipped, but for a mission that begins by an operator's order.
    pub fn begun_by_operator() -> Files {
        Files::shipped().with("kittiwake.toml", "start = \"at-once\"", "start = \"operator\"")
    }

    /// As shipped, but for a mission that is a leg of two kilometres without areas.
    pub fn with_long_leg() -> Files {
        Files::shipped().flying(
            "name = \"long\"\n[[objective]]\nname = \"there\"\nnorth_m = 0\neast_m = 2000\nheight_m = 0\nflying = false\n",
        )
    }

    /// With this mission.
    pub fn flying(self, mission: &str) -> Files {
        std::fs::write(self.0.path().join("missions/reference.toml"), mission).expect("the file can be written");
        self
    }

    /// The configuration file.
    pub fn config(&self) -> PathBuf {
        self.0.path().join("kittiwake.toml")
    }
}

/// A folder for states, in memory if possible: a disk that is busy with other builds may take seconds to answer, and a vehicle whose state
/// is not saved for that long holds for an operator.
pub fn state_folder() -> tempfile::TempDir {
    let in_memory = tempfile::tempdir_in("/dev/shm");
    in_memory.or_else(|_| tempfile::tempdir()).expect("a temporary folder can be made")
}

/// A file that nobody but its owner can read.
pub fn write_private(path: &Path, text: &str) {
    use std::os::unix::fs::PermissionsExt;
    std::fs::write(path, text).expect("the file can be written");
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600)).expect("its mode can be set");
}

fn copy(from: &Path, to: &Path) {
    for entry in std::fs::read_dir(from).expect("the folder is there") {
        let entry = entry.expect("the folder can be read");
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            std::fs::create_dir_all(&target).expect("a folder can be made");
            copy(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), &target).expect("a file can be copied");
        }
    }
}
