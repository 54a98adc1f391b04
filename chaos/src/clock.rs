//! The wall clocks of the machines, so that they can be set: `libfaketime`, loaded into every process of a system. Only
//! the wall clock is its own; the monotonic clock stays the machine's, as it does when a real clock is set.

use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicI64, Ordering};

use crate::trouble::Machine;

/// Where distributions put it.
const FOLDERS: &[&str] = &[
    "/usr/lib/x86_64-linux-gnu/faketime",
    "/usr/lib/aarch64-linux-gnu/faketime",
    "/usr/lib64/faketime",
    "/usr/lib/faketime",
    "/usr/local/lib/faketime",
];
/// The one for programs with threads.
const LIBRARY: &str = "libfaketimeMT.so.1";

/// The library, if it is installed and `program` runs with it.
pub(crate) fn find_library(program: &Path) -> Option<PathBuf> {
    let library = FOLDERS.iter().map(|it| Path::new(it).join(LIBRARY)).find(|it| it.is_file())?;
    let mut probe = Command::new(program);
    probe.arg("--version").env("LD_PRELOAD", &library).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    probe.status().is_ok_and(|it| it.success()).then_some(library)
}

/// The clocks of both machines of a system.
#[derive(Debug)]
pub(crate) struct Clocks {
    library: PathBuf,
    folder: PathBuf,
    /// How far each is ahead of the true one, in milliseconds.
    ahead_ms: [AtomicI64; 2],
}

/// The sides of a system: on board and on the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Side {
    Aircraft,
    Ground,
}

impl Side {
    const ALL: [Side; 2] = [Side::Aircraft, Side::Ground];

    fn of(machine: Machine) -> &'static [Side] {
        match machine {
            Machine::Aircraft => &Side::ALL[..1],
            Machine::Ground => &Side::ALL[1..],
            Machine::Both => &Side::ALL,
        }
    }
}

impl Clocks {
    /// Both right. `folder` exists and keeps what the processes read.
    pub(crate) fn new(library: PathBuf, folder: PathBuf) -> io::Result<Clocks> {
        let clocks = Clocks { library, folder, ahead_ms: Default::default() };
        Side::ALL.into_iter().try_for_each(|it| clocks.write(it))?;
        Ok(clocks)
    }

    /// A process of this side will read its clock.
    pub(crate) fn give(&self, side: Side, command: &mut Command) {
        command.env("LD_PRELOAD", &self.library).env("FAKETIME_TIMESTAMP_FILE", self.file(side));
        // A step is seen at once; both names, since the library knows one or the other by its version.
        command.env("FAKETIME_NO_CACHE", "1").env("FAKETIME_DONT_FAKE_MONOTONIC", "1").env("DONT_FAKE_MONOTONIC", "1");
    }

    /// What this process makes is a day old: certificates are valid from an hour before they are made, and a clock may be set
    /// back by more than that.
    pub(crate) fn give_yesterday(&self, command: &mut Command) {
        command.env("LD_PRELOAD", &self.library).env("FAKETIME", "-1d");
    }

    /// Sets the clocks of a machine forward by that much.
    pub(crate) fn step(&self, machine: Machine, by_ms: i64) -> io::Result<()> {
        Side::of(machine).iter().try_for_each(|side| {
            self.ahead_ms[*side as usize].fetch_add(by_ms, Ordering::SeqCst);
            self.write(*side)
        })
    }

    /// How far that side's clock is ahead of the true one, in milliseconds.
    pub(crate) fn ahead_ms(&self, side: Side) -> i64 {
        self.ahead_ms[side as usize].load(Ordering::SeqCst)
    }

    /// Replaced as a whole: a process may be reading it.
    fn write(&self, side: Side) -> io::Result<()> {
        let (path, ahead_s) = (self.file(side), self.ahead_ms(side) as f64 / 1e3);
        let new = path.with_extension("new");
        std::fs::write(&new, format!("{ahead_s:+.3}\n"))?;
        std::fs::rename(new, path)
    }

    fn file(&self, side: Side) -> PathBuf {
        self.folder.join(match side {
            Side::Aircraft => "aircraft.clock",
            Side::Ground => "ground.clock",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_add_up_for_each_machine() {
        let folder = kittiwake::run::run_file::RunFolder::create("clock-test").unwrap();
        let clocks = Clocks::new("nowhere.so".into(), folder.0.clone()).unwrap();
        let read = |side| std::fs::read_to_string(clocks.file(side)).unwrap();
        assert_eq!((read(Side::Aircraft), read(Side::Ground)), ("+0.000\n".to_owned(), "+0.000\n".to_owned()));
        clocks.step(Machine::Both, 1_500).unwrap();
        clocks.step(Machine::Aircraft, -10_800_000).unwrap();
        assert_eq!((read(Side::Aircraft), read(Side::Ground)), ("-10798.500\n".to_owned(), "+1.500\n".to_owned()));
        assert_eq!(clocks.ahead_ms(Side::Aircraft), -10_798_500);
    }
}
