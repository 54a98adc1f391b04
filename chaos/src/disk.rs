//! A small disk of a run's own, so that it can be full: a `tmpfs` in a mount namespace that nobody else sees.

use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Room for the persisted state and its set-aside files.
const SIZE: &str = "size=512k";

/// Becomes the same program with mounts of its own. Returns if that is not possible.
pub fn enter_own_mounts() {
    if !nix::unistd::geteuid().is_root() {
        return;
    }
    let Ok(own) = std::env::current_exe() else { return };
    let arguments = std::env::args_os().skip(1);
    // The shell's `exec` comes back if the namespace is refused.
    let probe = Command::new("unshare").args(["--mount", "true"]).stdout(Stdio::null()).stderr(Stdio::null()).status();
    if probe.is_ok_and(|it| it.success()) {
        let _cause = Command::new("unshare").arg("--mount").arg(own).args(arguments).arg("--own-mounts").exec();
    }
}

/// A small disk; unmounted with the value.
pub(crate) struct Disk(PathBuf);

impl Disk {
    /// Mounts one at `folder`, which exists; `None` where that is not possible.
    pub(crate) fn mount(folder: &Path) -> Option<Disk> {
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", SIZE, "tmpfs"]).arg(folder).stdout(Stdio::null()).stderr(Stdio::null());
        mount.status().is_ok_and(|it| it.success()).then(|| Disk(folder.to_owned()))
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        // Detached at once, even while somebody still has a file open; gone with the namespace at the latest.
        let _ = Command::new("umount").arg("--lazy").arg(&self.0).status();
    }
}
