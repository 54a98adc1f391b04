//! The launcher's children: started, listened to, ended.
//!
//! A child holds the reading end of a pipe whose other end only the launcher has, and ends when
//! that end is closed, so no child survives the launcher. Each child has a process group of its
//! own: Ctrl-C reaches only the launcher, which ends them in order. A child that is frozen when the
//! launcher dies has asked the operating system to wake it then (`run/end.rs`).

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::io::{self, BufRead, BufReader, Read};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::mpsc::Sender;

use crate::run::run_file::{ROUTER_SOCKET, RunFolder};
use crate::settings::Settings;
use crate::up::Happening;
use crate::up::supervise::{Child, Ending};

/// The children that run.
pub struct Children {
    program: PathBuf,
    settings: Settings,
    /// The folder of the router's socket and of the direct links between those on board: no other user can enter it.
    sockets: RunFolder,
    /// Where the router listens.
    listen: String,
    happenings: Sender<Happening>,
    running: BTreeMap<Child, std::process::Child>,
    /// Those that have been seen on the bus.
    have_run: BTreeSet<Child>,
}

impl Children {
    /// No child runs yet. They will run the program that this process runs, also after another was installed in its place:
    /// that one may want other files than those that this run flies with.
    pub fn new(settings: &Settings, happenings: Sender<Happening>) -> io::Result<Children> {
        Children::of("/proc/self/exe".into(), settings, happenings)
    }

    /// None runs yet. They will be of the executable `program`.
    pub fn of(program: PathBuf, settings: &Settings, happenings: Sender<Happening>) -> io::Result<Children> {
        let sockets = RunFolder::create("links")?;
        let router = sockets.0.join(ROUTER_SOCKET);
        bus::sockets::check_to_listen(&router).map_err(io::Error::other)?;
        let (settings, listen) = (settings.clone(), bus::sockets::locator_of(&router));
        let (running, have_run) = (BTreeMap::new(), BTreeSet::new());
        Ok(Children { program, settings, sockets, listen, happenings, running, have_run })
    }

    /// The router is to listen at `locator`, instead of on a socket that only this user can reach.
    ///
    /// # Errors
    /// When it is a socket that is not to be used.
    pub fn listen_at(&mut self, locator: &str) -> io::Result<()> {
        bus::sockets::path_in(locator).map_or(Ok(()), bus::sockets::check_to_listen).map_err(io::Error::other)?;
        locator.clone_into(&mut self.listen);
        Ok(())
    }

    /// From now on a gateway is started at this address, so that a restarted one keeps it.
    pub fn keep_http(&mut self, address: std::net::SocketAddr) {
        self.settings.http = Some(address);
    }

    /// A child is on the bus, and so has saved its state: when it is started again, a state that is missing was lost.
    pub fn seen(&mut self, child: Child) {
        self.have_run.insert(child);
    }

    /// Starts a child. `locator` is the router's, once it is known.
    pub fn start(&mut self, child: Child, locator: Option<&str>) -> io::Result<()> {
        let mut args: Vec<OsString> = vec!["run".into(), child.name().into(), "--exit-with-parent".into()];
        match child {
            Child::Router => args.extend(["--listen".into(), locator.unwrap_or(&self.listen).into()]),
            Child::Service(_) | Child::Onboard(_) => {
                if let Child::Onboard(composition) = child {
                    args.extend(["--nodes".into(), composition.to_string().into()]);
                }
                let has_run = self.have_run.contains(&child);
                args.extend(Settings { has_run, ..self.settings.clone() }.to_args(&child.services()));
                args.extend(["--direct".into(), self.sockets.0.clone().into()]);
                args.extend(locator.into_iter().flat_map(|it| ["--connect".into(), it.into()]));
            }
        }
        let mut process = Command::new(&self.program)
            .arg0("kittiwake")
            .args(args)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .process_group(0)
            .spawn()?;
        let listening = self.listen_to(child, &mut process);
        if listening.is_err() {
            // Nobody would hear that it has ended.
            let _ = process.kill();
            let _ = process.wait();
            return listening;
        }
        self.running.insert(child, process);
        Ok(())
    }

    /// Reads what a child says, until it ends.
    fn listen_to(&self, child: Child, process: &mut std::process::Child) -> io::Result<()> {
        let (stdout, stderr) = (process.stdout.take(), process.stderr.take());
        let to_launcher = self.happenings.clone();
        read_lines(stderr, move |text| to_launcher.send(Happening::Log { child, text }).is_ok())?;
        let to_launcher = self.happenings.clone();
        std::thread::Builder::new().spawn(move || {
            each_line(stdout, |text| to_launcher.send(Happening::Line { child, text }).is_ok());
            // No other process has its standard output: the child has ended.
            let _ = to_launcher.send(Happening::Ended(child));
        })?;
        Ok(())
    }

    /// Whether the router has a socket in a folder, and it is not there.
    pub fn router_is_nowhere(&self) -> bool {
        let path = self.sockets.0.join(ROUTER_SOCKET);
        self.listen == bus::sockets::locator_of(&path) && !path.exists()
    }

    /// Keeps the folder of the sockets from being cleared away, also where it was removed and made again.
    pub fn hold_sockets(&self) {
        self.sockets.hold();
    }

    /// The folder of the direct links.
    pub fn sockets(&self) -> &Path {
        &self.sockets.0
    }

    /// The children that run, with their process ids.
    pub fn process_ids(&self) -> Vec<(Child, u32)> {
        self.running.iter().map(|(child, process)| (*child, process.id())).collect()
    }

    /// Whether this is the process id of a child that runs.
    pub fn is_process(&self, child: Child, id: u32) -> bool {
        self.running.get(&child).is_some_and(|process| process.id() == id)
    }

    /// How a child ended; `None` if it was not running. One that cannot be waited for has ended too: somebody else has waited.
    pub fn reap(&mut self, child: Child) -> Option<Ending> {
        let status = self.running.remove(&child)?.wait();
        Some(status.map_or(Ending::Unknown, ending))
    }

    /// The children that run, the router last.
    pub fn running(&self) -> Vec<Child> {
        self.running.keys().rev().copied().collect()
    }

    /// Asks a child to end.
    pub fn ask_to_end(&mut self, child: Child) {
        if let Some(process) = self.running.get_mut(&child) {
            drop(process.stdin.take());
        }
    }

    /// Ends a child that did not end when it was asked.
    pub fn kill(&mut self, child: Child) {
        if let Some(process) = self.running.get_mut(&child) {
            // Fails only if it has ended meanwhile.
            let _ = process.kill();
        }
    }
}

fn ending(status: ExitStatus) -> Ending {
    match (status.code(), status.signal()) {
        (Some(code), _) => Ending::Code(code),
        (None, signal) => Ending::Signal(signal.unwrap_or_default()),
    }
}

fn read_lines(
    pipe: Option<impl Read + Send + 'static>,
    take: impl FnMut(String) -> bool + Send + 'static,
) -> io::Result<()> {
    std::thread::Builder::new().spawn(move || each_line(pipe, take)).map(drop)
}

/// Passes each line to `take` until the pipe ends or `take` wants no more.
fn each_line(pipe: Option<impl Read>, mut take: impl FnMut(String) -> bool) {
    let Some(pipe) = pipe else { return };
    let mut reader = BufReader::new(pipe);
    let mut line = Vec::new();
    while reader.read_until(b'\n', &mut line).is_ok_and(|it| it > 0) {
        let text = String::from_utf8_lossy(&line).trim_end().to_owned();
        line.clear();
        if !take(text) {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_child_for_which_somebody_else_has_waited_has_ended() {
        let (sender, happenings) = std::sync::mpsc::channel();
        let settings = Settings::of_file(Path::new("kittiwake.toml"));
        let mut children = Children::of("/bin/true".into(), &settings, sender).unwrap();
        children.start(Child::Router, None).unwrap();
        let id = children.process_ids()[0].1;
        nix::sys::wait::waitpid(nix::unistd::Pid::from_raw(id as i32), None).unwrap();
        assert!(matches!(happenings.recv(), Ok(Happening::Ended(Child::Router))));
        assert_eq!(children.reap(Child::Router), Some(Ending::Unknown));
        assert_eq!(children.reap(Child::Router), None);
    }
}
