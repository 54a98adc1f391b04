//! A machine: a container whose process 1 is systemd. It is removed with the value.

use std::path::Path;
use std::process::Output;
use std::time::Duration;

use crate::support::engine::docker;
use crate::support::wait::wait_within;

/// On a machine in order every wait is much shorter than this.
const LIMIT: Duration = Duration::from_secs(120);

/// A container that runs.
pub struct Machine(String);

impl Machine {
    /// Starts one of `image` in `network`, where it is reached by the name `host`, and waits until it has come up.
    #[track_caller]
    pub fn start(image: &str, name: String, network: &str, host: &str) -> Machine {
        let net = ["--network", network, "--network-alias", host, "--hostname", host];
        // What systemd needs for control groups and sandboxes: to mount, with the system calls for it, and to see processes
        // that a sandbox hides.
        let rights = ["--cap-add", "SYS_ADMIN", "--cap-add", "SYS_PTRACE"];
        let rights =
            [rights, ["--security-opt", "seccomp=unconfined", "--security-opt", "apparmor=unconfined"]].concat();
        let folders = ["--tmpfs", "/run", "--tmpfs", "/tmp"];
        let run = ["run", "--detach", "--name", &name];
        succeeded(&docker(&[&run[..], &net, &rights, &folders, &[image]].concat()));
        let machine = Machine(name);
        machine.wait_until_up();
        machine
    }

    /// Runs commands of bash to their end and returns what they print; fails with the first that fails.
    #[track_caller]
    pub fn run(&self, commands: &str) -> String {
        succeeded(&self.try_run(commands))
    }

    /// The same, whatever the exit code. They run in the folder into which [`Machine::copy_in`] copies.
    pub fn try_run(&self, commands: &str) -> Output {
        docker(&["exec", "--workdir", "/root", &self.0, "bash", "-euo", "pipefail", "-c", commands])
    }

    /// Copies a file or a folder of the host to `to`, relative to `/root`.
    #[track_caller]
    pub fn copy_in(&self, from: &Path, to: &str) {
        let from = from.to_str().expect("a readable path");
        succeeded(&docker(&["cp", "--follow-link", from, &format!("{}:/root/{to}", self.0)]));
    }

    /// Copies `/root/{from}` into a folder of the host.
    #[track_caller]
    pub fn copy_out(&self, from: &str, to: &Path) {
        let to = to.to_str().expect("a readable path");
        succeeded(&docker(&["cp", &format!("{}:/root/{from}", self.0), to]));
    }

    /// Cuts its power and switches it on again.
    #[track_caller]
    pub fn cut_power(&self) {
        succeeded(&docker(&["kill", &self.0]));
        succeeded(&docker(&["start", &self.0]));
        self.wait_until_up();
    }

    #[track_caller]
    fn wait_until_up(&self) {
        wait_for(&format!("{} to come up", self.0), || {
            // Where nothing is `running` yet, the command fails.
            let state = self.try_run("systemctl is-system-running || true");
            let state = String::from_utf8_lossy(&state.stdout).trim().to_owned();
            (state == "running" || state == "degraded").then_some(())
        });
    }

    /// A property of a process's unit.
    #[track_caller]
    pub fn property(&self, process: &str, name: &str) -> String {
        self.run(&format!("systemctl show --property {name} --value kittiwake@{process}")).trim().to_owned()
    }

    /// The id of a process inside the machine; none while it is not running.
    #[track_caller]
    pub fn process_id(&self, process: &str) -> Option<u32> {
        self.property(process, "MainPID").parse().ok().filter(|it| *it != 0)
    }

    /// Waits until a process runs that is not `former`, and is ready.
    #[track_caller]
    pub fn wait_for_another(&self, process: &str, former: Option<u32>) {
        let ask = format!("systemctl show --property MainPID,ActiveState kittiwake@{process}");
        wait_for(&format!("{process} to be started again"), || {
            let said = self.run(&ask);
            let value = |name: &str| said.lines().find_map(|it| it.strip_prefix(name)).unwrap_or_default();
            let id = value("MainPID=").parse::<u32>().ok().filter(|it| *it != 0);
            (value("ActiveState=") == "active" && id.is_some() && id != former).then_some(())
        });
    }

    /// What the units of Kittiwake and systemd have logged about them.
    pub fn journal(&self) -> String {
        let said = self.try_run("journalctl --no-pager --output short-monotonic --unit 'kittiwake*'");
        String::from_utf8_lossy(&said.stdout).into_owned()
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("--- {}\n{}", self.0, self.journal());
        }
        docker(&["rm", "--force", "--volumes", &self.0]);
    }
}

/// What a command has printed; fails if it has failed.
#[track_caller]
pub fn succeeded(output: &Output) -> String {
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    said
}

/// Waits until `find` finds something.
#[track_caller]
pub fn wait_for<T>(what: &str, find: impl FnMut() -> Option<T>) -> T {
    wait_within(LIMIT, Duration::from_millis(100), what, find)
}
