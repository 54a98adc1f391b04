//! A system under trouble, in any layout: how it is started, its processes by their ids, and a tap on its buses.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use bus::{Link, Scope, Tap, Tapped};
use control_tower::policy::Policy;
use kittiwake_proto::topics::{Message, Topic};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::clock::Clocks;
use crate::link::FaultyLink;
use crate::run::heard::Heard;
use crate::trouble::Layout;

mod keeper;
mod kept;
mod launcher;

use keeper::Keeper;
use launcher::Launcher;

/// What the oracle judges by, and whom the figures are of: as the vehicle's side of the link has it.
const ON_BOARD: &[Topic] = &[
    Topic::MissionStatus,
    Topic::McmStatus,
    Topic::DecisionRecord,
    Topic::VehicleLandDetected,
    Topic::VehicleStatus,
    Topic::VehicleLocalPosition,
    Topic::Heartbeat,
];
/// The same on the ground's side: what was granted, whether or not the vehicle has heard that.
const ON_GROUND: &[Topic] = &[Topic::PermissionLedger, Topic::Heartbeat];
/// Services whose heartbeats are the ground's.
const GROUND_SERVICES: [&str; 2] = ["control-tower", "gateway"];
/// The vehicle of the shipped configuration.
pub(crate) const VEHICLE: &str = "uav1";
/// Getting onto the bus takes no longer than this.
const LIMIT: Duration = Duration::from_secs(10);

/// How a system is started.
#[derive(Debug)]
pub(crate) struct Setup {
    pub(crate) program: PathBuf,
    pub(crate) config: PathBuf,
    pub(crate) speed: String,
    pub(crate) seed: u64,
    pub(crate) layout: Layout,
    pub(crate) permissions: Policy,
    /// Names of the mission's areas that need a permission.
    pub(crate) permission_areas: Vec<String>,
    /// Of state and recordings; they outlive a loss of power.
    pub(crate) scratch: PathBuf,
    /// It ends with its mission, if it has a launcher.
    pub(crate) ends: bool,
    /// The clocks of its machines; absent if nobody sets them.
    pub(crate) clocks: Option<Clocks>,
    /// Between its routers, once there are two; it outlives a loss of power.
    pub(crate) link: OnceLock<Arc<FaultyLink>>,
}

impl Setup {
    /// Of two routers, with `program` in place of the troubled one.
    #[cfg(test)]
    pub(crate) fn made_up(program: &str, scratch: &Path) -> Setup {
        Setup {
            program: program.into(),
            config: "nowhere".into(),
            speed: "1".into(),
            seed: 1,
            layout: Layout::TwoRouters,
            permissions: Policy::Grant,
            permission_areas: Vec::new(),
            scratch: scratch.to_owned(),
            ends: false,
            clocks: None,
            link: OnceLock::new(),
        }
    }

    /// Where the persisted state is.
    pub(crate) fn state(&self) -> PathBuf {
        self.scratch.join("state")
    }

    /// Starts it. What it says goes to `heard`, line by line, once where it can be reached, and last that it ended.
    pub(crate) fn start(self: &Arc<Setup>, heard: &SyncSender<Heard>) -> Result<System, String> {
        match self.layout {
            Layout::OneRouter | Layout::Composed => Launcher::start(self, heard).map(System::Launched),
            Layout::TwoRouters => Ok(System::Supervised(Keeper::start(self, heard))),
        }
    }
}

/// Where a system can be reached.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Reach {
    /// The locators of the routers; with one router both are the same.
    pub(crate) on_board: String,
    pub(crate) ground: String,
    /// The gateway's address, without a scheme.
    pub(crate) http: String,
    /// The arguments by which `kittiwake vehicle` finds it.
    pub(crate) target: Vec<OsString>,
}

/// A running system; it ends with the value.
pub(crate) enum System {
    Launched(Launcher),
    Supervised(Keeper),
}

impl System {
    /// Tells it from the one before a loss of power.
    pub(crate) fn id(&self) -> u32 {
        match self {
            System::Launched(it) => it.id(),
            System::Supervised(it) => it.id(),
        }
    }

    /// Its processes, which change.
    pub(crate) fn processes(&self) -> Processes {
        match self {
            System::Launched(it) => Processes::OfLauncher(it.id()),
            System::Supervised(it) => Processes::Supervised(it.processes()),
        }
    }

    /// Everything loses its power: none has the time for a last word.
    pub(crate) fn cut_power(self) {
        match self {
            System::Launched(it) => it.cut_power(),
            System::Supervised(it) => drop(it),
        }
    }

    /// The exit code of its launcher, once that has ended.
    pub(crate) fn exit_code(&mut self) -> Option<i32> {
        match self {
            System::Launched(it) => it.exit_code(),
            System::Supervised(_) => None,
        }
    }
}

/// The processes of a running system.
#[derive(Debug, Clone)]
pub(crate) enum Processes {
    OfLauncher(u32),
    Supervised(keeper::Shared),
}

impl Processes {
    /// By their names, with their ids.
    pub(crate) fn list(&self) -> Vec<(String, u32)> {
        match self {
            Processes::OfLauncher(id) => launcher::children(*id),
            Processes::Supervised(shared) => shared.list(),
        }
    }

    /// The id of one, if it runs.
    pub(crate) fn find(&self, name: &str) -> Option<u32> {
        self.list().into_iter().find(|it| it.0 == name).map(|it| it.1)
    }

    /// Whether a process that runs is ready, as far as its supervisor tells.
    pub(crate) fn is_ready(&self, id: u32) -> bool {
        match self {
            Processes::OfLauncher(_) => true,
            Processes::Supervised(shared) => shared.is_ready(id),
        }
    }

    /// Whether the aircraft's computer is without power.
    pub(crate) fn is_companion_off(&self) -> bool {
        match self {
            Processes::OfLauncher(_) => false,
            Processes::Supervised(shared) => shared.companion_off_until().is_some(),
        }
    }

    /// Kills those of the aircraft's computer, and starts none of them before `until`. Without a computer of its own there is nothing to do.
    pub(crate) fn take_down_companion(&self, until: Instant) {
        match self {
            Processes::OfLauncher(_) => {}
            Processes::Supervised(shared) => shared.take_down_companion(until),
        }
    }

    /// Whether somebody starts again what ends.
    pub(crate) fn are_kept_up(&self) -> bool {
        match self {
            Processes::OfLauncher(id) => is_there(*id),
            Processes::Supervised(shared) => shared.is_kept_up(),
        }
    }
}

fn is_there(id: u32) -> bool {
    Path::new(&format!("/proc/{id}")).exists()
}

/// Sends a signal to a process that may have ended.
pub(crate) fn signal(id: u32, signal: Signal) {
    let _ = kill(Pid::from_raw(id as i32), signal);
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

/// Looks on at both buses.
pub(crate) fn taps(reach: &Reach, heard: &SyncSender<Heard>) -> Result<[Tap; 2], String> {
    let is_ground = |it: &Message| match it {
        Message::Heartbeat(beat) => GROUND_SERVICES.contains(&beat.service.as_str()),
        _ => false,
    };
    let on_board = tap(&reach.on_board, ON_BOARD, heard, move |it| *it.vehicle == *VEHICLE && !is_ground(&it.message))?;
    // Beats of those on board arrive here as well, perhaps late.
    let of_ground = move |it: &Tapped| match it.message {
        Message::Heartbeat(_) => is_ground(&it.message),
        _ => *it.vehicle == *VEHICLE,
    };
    Ok([on_board, tap(&reach.ground, ON_GROUND, heard, of_ground)?])
}

fn tap(
    locator: &str,
    topics: &'static [Topic],
    heard: &SyncSender<Heard>,
    counts: impl Fn(&Tapped) -> bool + Clone + Send + Sync + 'static,
) -> Result<Tap, String> {
    let heard = heard.clone();
    let pass_on = move |it: Tapped| {
        if counts(&it) {
            // Fails only once the run is over.
            let _ = heard.send(Heard::Message(it.message));
        }
    };
    let everywhere = Link { scope: Scope::Fleet, ..link(locator) };
    Tap::open(&everywhere, topics, pass_on).map_err(|it| it.to_string())
}

/// How to get onto that bus, on board.
pub(crate) fn link(locator: &str) -> Link {
    Link { connect: vec![locator.to_owned()], scope: Scope::Vehicle(VEHICLE.to_owned()), open_timeout: LIMIT }
}
