//! A project of the compose file: brought up, observed from the host, taken down with the value.

use std::collections::BTreeMap;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Mutex, MutexGuard};
use std::time::Duration;

use serde_json::Value;

use crate::support::engine::{self, answers, docker};
use crate::support::wait;

pub mod http;

/// On a machine in order every wait is much shorter than this.
pub const LIMIT: Duration = Duration::from_secs(240);

/// Whole systems of containers, one at a time: they share the machine's two processors.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Names the image under test.
const IMAGE: &str = "KITTIWAKE_IMAGE";

/// The prefix of every project's name.
const PREFIX: &str = "kittiwake-test";

/// A project, not up yet.
pub struct Project {
    name: String,
    /// The port of the operator's page, on the host.
    pub port: u16,
    compose: &'static [&'static str],
    variables: BTreeMap<&'static str, String>,
    profiles: &'static [&'static str],
    image: String,
    _alone: MutexGuard<'static, ()>,
}

impl Project {
    /// A project for one story. They are ignored unless they are asked for, because they need an engine and an image.
    #[track_caller]
    pub fn new(story: &str) -> Project {
        let alone = ONE_AT_A_TIME.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let (image, compose) = (image(), compose());
        let port = free_port();
        let mut project = Project {
            name: format!("{PREFIX}-{}-{story}", std::process::id()),
            port,
            compose,
            variables: BTreeMap::new(),
            profiles: &[],
            image,
            _alone: alone,
        };
        project.set("KITTIWAKE_PORT", &port.to_string());
        project.set("KITTIWAKE_SPEED", "20");
        project
    }

    /// Sets a variable of the compose file.
    pub fn set(&mut self, name: &'static str, value: &str) {
        self.variables.insert(name, value.to_owned());
    }

    /// With a profile, in addition to the services without one.
    pub fn with_profiles(&mut self, profiles: &'static [&'static str]) {
        self.profiles = profiles;
    }

    /// Runs a command of compose.
    pub fn run(&self, args: &[&str]) -> Output {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("deploy/compose.yaml");
        let profiles = self.profiles.iter().flat_map(|it| ["--profile", it]);
        Command::new(self.compose[0])
            .args(&self.compose[1..])
            .args(["--project-name", &self.name, "--file"])
            .arg(file)
            .args(profiles)
            .args(args)
            .env("KITTIWAKE_IMAGE", &self.image)
            .envs(&self.variables)
            .output()
            .expect("compose was there a moment ago")
    }

    /// The command of the documentation, but in the background.
    #[track_caller]
    pub fn up(&self) {
        let output = self.run(&["up", "--detach", "--no-build"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }

    /// Removes everything; returns what is left.
    pub fn down(&self) -> Vec<String> {
        let output = self.run(&["down", "--volumes", "--timeout", "5"]);
        let failed = (!output.status.success()).then(|| String::from_utf8_lossy(&output.stderr).into_owned());
        let label = format!("label=com.docker.compose.project={}", self.name);
        let left = [["ps", "--all"], ["network", "ls"], ["volume", "ls"]]
            .map(|kind| docker_lines(&[&kind[..], &["--quiet", "--filter", &label]].concat()));
        failed.into_iter().chain(left.into_iter().flatten()).collect()
    }

    /// The container of a service.
    #[track_caller]
    pub fn container(&self, service: &str) -> String {
        let found = self.containers().remove(service);
        found.unwrap_or_else(|| panic!("no container of {service}"))
    }

    /// Every container, by the name of its service.
    pub fn containers(&self) -> BTreeMap<String, String> {
        let label = format!("label=com.docker.compose.project={}", self.name);
        let format = "{{.Label \"com.docker.compose.service\"}} {{.ID}}";
        let lines = docker_lines(&["ps", "--all", "--no-trunc", "--filter", &label, "--format", format]);
        lines.iter().filter_map(|it| it.split_once(' ')).map(|(name, id)| (name.to_owned(), id.to_owned())).collect()
    }

    /// The name of a network.
    pub fn network(&self, name: &str) -> String {
        format!("{}_{name}", self.name)
    }

    /// The name of a volume.
    pub fn volume(&self, name: &str) -> String {
        format!("{}_{name}", self.name)
    }

    /// The log of a service.
    pub fn log(&self, service: &str) -> String {
        let output = docker(&["logs", &self.container(service)]);
        format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
    }

    /// The operator's token, from the link in the log.
    #[track_caller]
    pub fn token(&self) -> String {
        let link = format!("operate: http://127.0.0.1:{}/#token=", self.port);
        let log = wait_for("the link in the operator's log", || {
            Some(self.log("operator")).filter(|it| it.contains("#token="))
        });
        let line = log.lines().find_map(|it| it.strip_prefix(&link));
        line.unwrap_or_else(|| panic!("no `{link}..` in:\n{log}")).trim().to_owned()
    }

    /// A document of the gateway, on the host's loopback.
    pub fn get(&self, path: &str, token: &str) -> Option<(u16, Value)> {
        http::get(self.port, path, token).ok()
    }

    /// A vehicle as the gateway sees it.
    pub fn vehicle(&self, vehicle: &str, token: &str) -> Option<Value> {
        self.get(&format!("/api/v1/vehicles/{vehicle}"), token).filter(|it| it.0 == 200).map(|it| it.1)
    }

    /// Waits until the gateway has the mission's end, and returns its report.
    #[track_caller]
    pub fn wait_for_report(&self, vehicle: &str, token: &str) -> Value {
        wait_for(&format!("the report of {vehicle}"), || report(&self.vehicle(vehicle, token)?))
    }

    /// The same, of a mission that an operator starts as often as it waits for that.
    #[track_caller]
    pub fn start_until_report(&self, vehicle: &str, token: &str) -> Value {
        wait_for(&format!("the report of {vehicle}"), || {
            let seen = self.vehicle(vehicle, token)?;
            if seen["operator"]["startAwaited"] == true {
                // What is refused is ordered again: the next look shows it.
                for order in ["command/take", "start"] {
                    http::post(self.port, &format!("/api/v1/vehicles/{vehicle}/{order}"), token).ok()?;
                }
            }
            report(&seen)
        })
    }

    /// What every container's health check says: `healthy`, `unhealthy`, `starting`, or `none` where it has none.
    pub fn health(&self) -> BTreeMap<String, String> {
        let format = "{{if .State.Health}}{{.State.Health.Status}}{{else}}none{{end}}";
        let containers = self.containers().into_iter();
        containers.map(|(name, id)| (name, docker_lines(&["inspect", "--format", format, &id]).concat())).collect()
    }

    /// Waits until every container that has a health check is healthy.
    #[track_caller]
    pub fn wait_until_healthy(&self) {
        wait_for("every container to be healthy", || {
            self.health().values().all(|it| it == "healthy" || it == "none").then_some(())
        });
    }

    /// How often the engine has started each container again.
    pub fn restarts(&self) -> BTreeMap<String, String> {
        let count = |id: &str| docker_lines(&["inspect", "--format", "{{.RestartCount}}", id]).concat();
        self.containers().into_iter().map(|(name, id)| (name, count(&id))).collect()
    }

    /// The process of each container that runs, as the host sees it.
    pub fn processes(&self) -> BTreeMap<String, PathBuf> {
        let pid = |id: &str| docker_lines(&["inspect", "--format", "{{.State.Pid}}", id]).concat();
        let all = self.containers().into_iter().map(|(name, id)| (name, pid(&id)));
        all.filter(|(_, pid)| pid != "0").map(|(name, pid)| (name, Path::new("/proc").join(pid))).collect()
    }
}

/// The report of a vehicle's mission, if that is over.
fn report(vehicle: &Value) -> Option<Value> {
    Some(vehicle["report"].clone()).filter(|it| it["outcome"].is_string())
}

impl Drop for Project {
    fn drop(&mut self) {
        if std::thread::panicking() {
            for service in self.containers().keys() {
                eprintln!("--- {service}\n{}", self.log(service));
            }
        }
        self.down();
    }
}

/// The image under test.
#[track_caller]
pub fn image() -> String {
    engine::image(IMAGE)
}

/// What `docker` prints, line by line.
pub fn docker_lines(args: &[&str]) -> Vec<String> {
    let output = docker(args);
    String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect()
}

/// The compose command of this machine.
#[track_caller]
fn compose() -> &'static [&'static str] {
    const PLUGIN: &[&str] = &["docker", "compose"];
    const PROGRAM: &[&str] = &["docker-compose"];
    let found = [PLUGIN, PROGRAM].into_iter().find(|it| answers(it[0], &[&it[1..], &["version"]].concat()));
    found.expect("`docker compose` or `docker-compose` is installed")
}

/// A port that was free a moment ago.
fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").and_then(|it| it.local_addr()).expect("the loopback is there").port()
}

/// Waits until `find` finds something.
#[track_caller]
pub fn wait_for<T>(what: &str, find: impl FnMut() -> Option<T>) -> T {
    wait::wait_within(LIMIT, Duration::from_millis(100), what, find)
}
