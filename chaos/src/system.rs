//! A system under trouble: `kittiwake up` with scratch folders, its children by their ids, and a tap on its bus.

use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::SyncSender;
use std::time::{Duration, Instant};

use bus::{Link, Scope, Tap, Tapped};
use control_tower::policy::Policy;
use kittiwake_proto::topics::{Message, Topic};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::run::Heard;

/// What the oracle judges by, and whom the figures are of.
const TOPICS: &[Topic] = &[
    Topic::PlannerStatus,
    Topic::PermissionLedger,
    Topic::McmStatus,
    Topic::VehicleLandDetected,
    Topic::VehicleStatus,
    Topic::VehicleLocalPosition,
    Topic::Heartbeat,
];
/// The vehicle of the shipped configuration.
pub(crate) const VEHICLE: &str = "uav1";
/// Getting onto the bus takes no longer than this.
const LIMIT: Duration = Duration::from_secs(10);

/// How a system is started.
#[derive(Debug, Clone)]
pub(crate) struct Setup {
    pub(crate) program: PathBuf,
    pub(crate) config: PathBuf,
    pub(crate) speed: String,
    pub(crate) seed: u64,
    pub(crate) permissions: Policy,
    /// Of state and recordings; they outlive a loss of power.
    pub(crate) scratch: PathBuf,
    /// It ends with its mission.
    pub(crate) ends: bool,
}

impl Setup {
    /// Where the persisted state is.
    pub(crate) fn state(&self) -> PathBuf {
        self.scratch.join("state")
    }

    /// Starts the launcher. What it says goes to `heard`, line by line, and last that it ended.
    pub(crate) fn start(&self, heard: &SyncSender<Heard>) -> io::Result<Launcher> {
        let mut command = Command::new(&self.program);
        command.args(["up", "--json", "--http", "127.0.0.1:0", "--vehicle", VEHICLE, "--speed", &self.speed]);
        command.args(["--seed", &self.seed.to_string(), "--permissions", self.permissions.name()]);
        command.args(self.ends.then_some("--exit-when-done"));
        command.arg("--config").arg(&self.config).arg("--state").arg(self.state());
        command.arg("--recordings").arg(self.scratch.join("recordings"));
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut process = command.spawn()?;
        let (stderr, id, heard) = (process.stderr.take(), process.id(), heard.clone());
        std::thread::spawn(move || {
            for line in stderr.into_iter().flat_map(|it| BufReader::new(it).lines().map_while(Result::ok)) {
                if heard.send(Heard::Line(id, line)).is_err() {
                    return;
                }
            }
            // Fails only once the run is over.
            let _ = heard.send(Heard::LauncherEnded(id));
        });
        Ok(Launcher(process))
    }
}

/// The launcher; it ends with the value, and its children with it.
pub(crate) struct Launcher(Child);

impl Launcher {
    /// Its process id.
    pub(crate) fn id(&self) -> u32 {
        self.0.id()
    }

    /// Its exit code, once it has ended.
    pub(crate) fn exit_code(&mut self) -> Option<i32> {
        self.0.wait().ok()?.code()
    }

    /// Everything loses its power: none has the time for a last word.
    pub(crate) fn cut_power(mut self) {
        let children = children(self.id());
        // Frozen first, so that none sees another one die.
        let _ = kill(pid(self.id()), Signal::SIGSTOP);
        children.iter().for_each(|(_, id)| signal(*id, Signal::SIGKILL));
        let _ = self.0.kill();
        let _ = self.0.wait();
        wait_until(LIMIT, || children.iter().all(|(_, id)| !Path::new(&format!("/proc/{id}")).exists()));
    }
}

impl Drop for Launcher {
    fn drop(&mut self) {
        let id = self.id();
        signal(id, Signal::SIGINT);
        let ended = wait_until(LIMIT, || self.0.try_wait().is_ok_and(|it| it.is_some()));
        if !ended {
            let _ = self.0.kill();
            let _ = self.0.wait();
        }
    }
}

/// The children of a launcher, by their subcommand.
pub(crate) fn children(launcher: u32) -> Vec<(String, u32)> {
    let ids = std::fs::read_to_string(format!("/proc/{launcher}/task/{launcher}/children")).unwrap_or_default();
    let child = |id: &str| {
        let command = std::fs::read(format!("/proc/{id}/cmdline")).ok()?;
        let name = command.split(|it| *it == 0).nth(1)?;
        Some((String::from_utf8_lossy(name).into_owned(), id.parse().ok()?))
    };
    ids.split_whitespace().filter_map(child).collect()
}

/// Sends a signal to a process that may have ended.
pub(crate) fn signal(id: u32, signal: Signal) {
    let _ = kill(pid(id), signal);
}

fn pid(id: u32) -> Pid {
    Pid::from_raw(id as i32)
}

/// Waits until `is`, at most for `limit`; whether it was.
pub(crate) fn wait_until(limit: Duration, mut is: impl FnMut() -> bool) -> bool {
    let until = Instant::now() + limit;
    while !is() {
        if until <= Instant::now() {
            return false;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    true
}

/// Looks on at the bus of the router at `locator`.
pub(crate) fn tap(locator: &str, heard: &SyncSender<Heard>) -> Result<Tap, String> {
    let heard = heard.clone();
    let pass_on = move |it: Tapped| {
        // Those on the ground have heartbeats too, and belong to no vehicle.
        if *it.vehicle == *VEHICLE || matches!(it.message, Message::Heartbeat(_)) {
            // Fails only once the run is over.
            let _ = heard.send(Heard::Message(it.message));
        }
    };
    let everywhere = Link { scope: Scope::Fleet, ..link(locator) };
    Tap::open(&everywhere, TOPICS, pass_on).map_err(|it| it.to_string())
}

/// How to get onto that bus, on board.
pub(crate) fn link(locator: &str) -> Link {
    Link { connect: vec![locator.to_owned()], scope: Scope::Vehicle(VEHICLE.to_owned()), open_timeout: LIMIT }
}
