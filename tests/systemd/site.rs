//! An aircraft and its ground, installed as docs/deployment.md says.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};

use serde_json::Value;

use crate::support::engine::{self, docker};
use crate::systemd::documented::{commands, commands_of};
use crate::systemd::machine::{Machine, succeeded, wait_for};

/// Names the image of the machines.
const IMAGE: &str = "KITTIWAKE_SYSTEMD_IMAGE";
/// Names the folder of an earlier version, built by `cargo build`, that is installed in place of this one and then upgraded.
const EARLIER: &str = "KITTIWAKE_EARLIER_VERSION";

/// What is enabled on board.
pub const ON_BOARD: [&str; 6] = ["router", "vehicle-sim", "skill-manager", "monitor", "planner", "mcm"];
/// What is enabled on the ground.
pub const ON_GROUND: [&str; 3] = ["router", "control-tower", "gateway"];

/// Whole systems, one at a time: they share the machine's processors.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Two machines that know each other.
pub struct Site {
    pub aircraft: Machine,
    pub ground: Machine,
    _network: Network,
    _alone: MutexGuard<'static, ()>,
}

/// A network of the engine; removed with the value, after the machines.
struct Network(String);

impl Site {
    /// Both are installed, enabled and started by the documented commands. Mission time runs `speed` times as fast as the wall
    /// clock.
    #[track_caller]
    pub fn start(story: &str, speed: u32) -> Site {
        Site::start_installed(story, |machine| install(machine, speed))
    }

    /// The same, where `install` installs the program, its configuration and its units.
    #[track_caller]
    pub fn start_installed(story: &str, install: impl Fn(&Machine) + Sync) -> Site {
        let alone = ONE_AT_A_TIME.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let image = engine::image(IMAGE);
        let name = format!("kittiwake-systemd-{}-{story}", std::process::id());
        succeeded(&docker(&["network", "create", &name]));
        let network = Network(name.clone());
        let machine = |host: &str| {
            let machine = Machine::start(&image, format!("{name}-{host}"), &network.0, &format!("{host}.example"));
            install(&machine);
            machine
        };
        let (ground, aircraft) = std::thread::scope(|scope| {
            let ground = scope.spawn(|| machine("ground"));
            let aircraft = machine("aircraft");
            (ground.join().expect("the ground's machine is installed"), aircraft)
        });
        ground.run(&documented("kittiwake certs"));
        let scratch = tempfile::tempdir().expect("a temporary folder can be made");
        ground.copy_out("credentials", scratch.path());
        aircraft.copy_in(&scratch.path().join("credentials"), "credentials");
        ground.run(&documented("credentials/ground-router"));
        aircraft.run(&documented("credentials/uav1-router"));
        Site { aircraft, ground, _network: network, _alone: alone }
    }

    /// What the gateway says of the vehicle, if it can be asked.
    pub fn vehicle(&self) -> Option<Value> {
        let ask = "KITTIWAKE_URL=http://127.0.0.1:8080 KITTIWAKE_TOKEN=$(cat operator-token) kittiwake status --all --vehicle uav1";
        let output = self.ground.try_run(ask);
        output.status.success().then(|| serde_json::from_slice(&output.stdout).expect("the status is JSON"))
    }

    /// Waits until what is said of the vehicle is so.
    #[track_caller]
    pub fn wait_until(&self, what: &str, is: impl Fn(&Value) -> bool) -> Value {
        wait_for(what, || self.vehicle().filter(&is))
    }

    /// Waits until the vehicle is on its first long leg.
    #[track_caller]
    pub fn wait_for_flight(&self) {
        self.wait_until("the flight", |it| {
            flies(it) && it["aircraft"]["status"]["actualMode"] == "FLIGHT_MODE_OFFBOARD"
        });
    }

    /// Fails unless the vehicle is in the air, as soon as it is known: a monitor that has just started has yet to be heard.
    #[track_caller]
    pub fn check_flies(&self, when: &str) {
        let known = |it: &Value| it["aircraft"]["derived"]["flying"].is_boolean();
        let vehicle = self.wait_until(&format!("what the monitor says, {when}"), known);
        assert!(flies(&vehicle), "{when}: it is not in the air: {vehicle:#}");
    }

    /// Waits until the mission is over and the vehicle stands; fails unless everything was achieved.
    #[track_caller]
    pub fn wait_for_success(&self) {
        let over = self.wait_until("the end of the mission", |it| it["report"]["outcome"].is_string() && !is_armed(it));
        assert_eq!(over["report"]["outcome"], "MISSION_OUTCOME_SUCCESS", "{:#}", over["report"]);
    }

    /// Every unit that is enabled is active and ready.
    #[track_caller]
    pub fn check_active(&self) {
        for (machine, processes) in [(&self.aircraft, &ON_BOARD[..]), (&self.ground, &ON_GROUND)] {
            let units: Vec<_> = processes.iter().map(|it| format!("kittiwake@{it}")).collect();
            let said = machine.try_run(&format!("systemctl is-active {}", units.join(" ")));
            let said = String::from_utf8_lossy(&said.stdout).into_owned();
            let active = said.lines().filter(|it| *it == "active").count();
            assert_eq!(active, units.len(), "{units:?}:\n{said}\n{}", machine.journal());
        }
    }
}

/// The documented installation, with another speed in its configuration.
#[track_caller]
fn install(machine: &Machine, speed: u32) {
    machine.run("mkdir -p target/release");
    match earlier() {
        Some(earlier) => unpack(machine, &earlier, &earlier.join("target/debug/kittiwake"), speed),
        None => unpack_this(machine, speed),
    }
    machine.run(&documented("useradd"));
    machine.run(
        "kittiwake --version || { echo 'the image needs the C library of this machine or a newer one' >&2; exit 1; }",
    );
}

/// The folder of the version that is installed first, if it is another one.
fn earlier() -> Option<PathBuf> {
    std::env::var_os(EARLIER).map(PathBuf::from)
}

/// The block of commands that contains `part`, as the version that is installed first documents it.
#[track_caller]
fn documented(part: &str) -> String {
    earlier().map_or_else(|| commands(part), |it| commands_of(&it, part))
}

/// Puts the new version where the documentation of an upgrade expects it: another file than the one that runs, though it may say
/// the same.
#[track_caller]
pub fn unpack_upgrade(machine: &Machine, speed: u32) {
    machine.run("rm -rf config deploy target/release/kittiwake");
    unpack_this(machine, speed);
    machine.run("echo >>target/release/kittiwake");
}

fn unpack_this(machine: &Machine, speed: u32) {
    unpack(machine, Path::new(env!("CARGO_MANIFEST_DIR")), Path::new(env!("CARGO_BIN_EXE_kittiwake")), speed);
}

/// Puts a version into the folder in which the documented commands run.
#[track_caller]
fn unpack(machine: &Machine, root: &Path, program: &Path, speed: u32) {
    machine.copy_in(program, "target/release/kittiwake");
    machine.copy_in(&root.join("config"), "config");
    machine.copy_in(&root.join("deploy"), "deploy");
    machine.run(&format!("sed -i 's/^speed = .*/speed = {speed}.0/' config/kittiwake.toml"));
}

pub fn is_armed(vehicle: &Value) -> bool {
    vehicle["aircraft"]["status"]["armed"] == true
}

/// Whether the ground hears that the vehicle flies.
pub fn flies(vehicle: &Value) -> bool {
    vehicle["aircraft"]["derived"]["flying"] == true
}

impl Drop for Network {
    fn drop(&mut self) {
        docker(&["network", "rm", &self.0]);
    }
}
