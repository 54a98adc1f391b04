//! Starts a whole system of real processes, observes it, disturbs it, and ends it with the value.

use std::fmt::Display;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::{Arc, Condvar, Mutex};
use std::time::{Duration, Instant};

use serde_json::Value;

use files::Files;

pub mod browser;
pub mod crowd;
pub mod engine;
pub mod files;
pub mod http;
pub mod http_proxy;
pub mod people;
pub mod processes;
mod seats;
pub mod wait;

/// On a machine in order every wait is much shorter than this. Beside eight busy loops some take two minutes.
pub const LIMIT: Duration = Duration::from_secs(300);

/// The step of [`System::on_long_leg`].
pub const FLY_LONG_LEG: &str = "fly to (0, 2000, 10)";

/// The program under test.
pub const KITTIWAKE: &str = env!("CARGO_BIN_EXE_kittiwake");

/// A launcher and its children. They end with the value.
pub struct System {
    launcher: std::process::Child,
    said: Arc<Said>,
    stdout: Option<std::thread::JoinHandle<String>>,
}

/// The launcher's output on standard error so far.
#[derive(Default)]
struct Said {
    lines: Mutex<(Vec<String>, bool)>,
    changed: Condvar,
}

/// How a system ended.
pub struct Ending {
    /// The launcher's exit code.
    pub code: Option<i32>,
    /// What it printed on standard output.
    pub stdout: String,
    /// What it printed on standard error.
    pub lines: Vec<String>,
}

impl System {
    /// Starts one that flies the reference mission at twenty times real time and ends with it,
    /// unless the arguments say otherwise.
    pub fn start(args: &[&str]) -> System {
        System::start_with(args, &[])
    }

    /// The same, with environment variables.
    pub fn start_with(args: &[&str], variables: &[(&str, &str)]) -> System {
        let usual: &[&str] = if args.contains(&"--speed") { &[] } else { &["--speed", "20"] };
        System::up(&[&["--exit-when-done"], usual, args].concat(), variables)
    }

    /// Starts one with these arguments and no others but `--json`.
    pub fn up(args: &[&str], variables: &[(&str, &str)]) -> System {
        System::of(Path::new(KITTIWAKE), args, variables)
    }

    /// The same, of the program at another place.
    pub fn of(program: &Path, args: &[&str], variables: &[(&str, &str)]) -> System {
        let mut launcher = command(program, args)
            .envs(variables.iter().copied())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let said = Arc::new(Said::default());
        let (mut stdout, stderr) = (launcher.stdout.take().unwrap(), launcher.stderr.take().unwrap());
        let heard = said.clone();
        std::thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                heard.update(|(lines, _)| lines.push(line));
            }
            heard.update(|(_, ended)| *ended = true);
        });
        let stdout = std::thread::spawn(move || {
            let mut text = String::new();
            stdout.read_to_string(&mut text).expect("standard output is text");
            text
        });
        System { launcher, said, stdout: Some(stdout) }
    }

    /// One whose lines go to `output`.
    pub fn speaking_to(output: std::io::PipeWriter, args: &[&str]) -> System {
        let also = output.try_clone().expect("a descriptor is left");
        let launcher = command(Path::new(KITTIWAKE), args).stdout(output).stderr(also).spawn();
        System { launcher: launcher.expect("the program starts"), said: Arc::default(), stdout: None }
    }

    /// Waits for a line that contains `part`, printed now or before, and returns it.
    #[track_caller]
    pub fn wait_for(&self, part: &str) -> String {
        self.wait_for_nth(part, 1)
    }

    /// The same, for the line that is the `nth` to contain it, counted from 1.
    #[track_caller]
    pub fn wait_for_nth(&self, part: &str, nth: usize) -> String {
        let found = self.said.wait(|lines| lines.iter().filter(|it| it.contains(part)).nth(nth - 1).cloned());
        found.unwrap_or_else(|| panic!("waited for `{part}` ({nth}) in vain; it said:\n{}", self.said.text()))
    }

    /// Waits for a line that contains one of `parts`, and returns that part.
    #[track_caller]
    pub fn wait_for_any<'a>(&self, parts: &[&'a str]) -> &'a str {
        let found = self
            .said
            .wait(|lines| lines.iter().find_map(|line| parts.iter().find(|part| line.contains(**part))).copied());
        found.unwrap_or_else(|| panic!("waited for one of {parts:?} in vain; it said:\n{}", self.said.text()))
    }

    /// Waits for the end.
    #[track_caller]
    pub fn end(mut self) -> Ending {
        let start = Instant::now();
        let said = self.said.clone();
        if said.wait_for_end().is_none() {
            panic!("not over within {:?}; it said:\n{}", start.elapsed(), said.text());
        }
        let code = self.launcher.wait().expect("the launcher was started").code();
        let stdout = self.stdout.take().and_then(|it| it.join().ok()).unwrap_or_default();
        Ending { code, stdout, lines: said.lines() }
    }

    /// One of `files`, whose mission begins with [`System::begin`]; returns when it waits for that, as everybody has heard.
    #[track_caller]
    pub fn waiting(files: &Files, args: &[&str]) -> System {
        let config = files.config();
        let config = config.to_str().expect("a readable path");
        let system = System::start(&[&["--config", config], args].concat());
        wait_for("the manager to wait for the operator", || {
            system.status()["operator"]["startAwaited"].as_bool()?.then_some(())
        });
        system
    }

    /// Waits until it flies the leg of [`Files::with_long_leg`], whichever step that is: on a crowded machine the plan on the ground was not the
    /// last one before.
    #[track_caller]
    pub fn wait_for_long_leg(&self) {
        self.wait_for(&[": ", FLY_LONG_LEG].concat());
    }

    /// At this speed, on a leg of two kilometres without areas: 200 mission seconds, in which commands can be given on a machine
    /// that is as crowded as can be. Returns as it begins.
    #[track_caller]
    pub fn on_long_leg(speed: &str) -> System {
        let files = Files::with_long_leg();
        let config = files.config();
        let system = System::start(&["--config", config.to_str().expect("a readable path"), "--speed", speed]);
        // It flies with a copy of its files.
        system.wait_for_long_leg();
        system
    }

    /// The operator's order that its mission begins.
    #[track_caller]
    pub fn begin(&self) {
        let started = kittiwake(&["vehicle", "start", "--pid", &self.pid().to_string()]);
        assert!(started.status.success(), "{}", String::from_utf8_lossy(&started.stderr));
    }

    /// The tower's decision that the vehicle may enter an area. Until the vehicle has asked for it, and the tower answers, there is nothing
    /// to decide.
    #[track_caller]
    pub fn grant(&self, area: &str) {
        let pid = self.pid().to_string();
        wait_for(&format!("area {area} to be granted"), || {
            kittiwake(&["permission", "grant", area, "--pid", &pid]).status.success().then_some(())
        });
    }

    /// The launcher's process id.
    pub fn pid(&self) -> u32 {
        self.launcher.id()
    }

    /// Runs `kittiwake inject ..` against this system, until the process that it is for is seen and answers: on a crowded machine that may
    /// take longer than the command waits. One that was not answered in time may be injected twice.
    #[track_caller]
    pub fn inject(&self, args: &[&str]) -> Output {
        let pid = self.pid().to_string();
        let all = [&["inject"], args, &["--pid", &pid]].concat();
        wait_for("the receiver of an injection", || {
            let output = kittiwake(&all);
            let said = String::from_utf8_lossy(&output.stderr);
            let is_late = said.contains("unavailable: no ") || said.contains("unanswered: ");
            (!is_late).then_some(output)
        })
    }

    /// The gateway's document about the vehicle. On a crowded machine the mission may have begun before the launcher has seen
    /// every process, and only then the system can be asked.
    #[track_caller]
    pub fn status(&self) -> Value {
        wait_for("a status", || {
            let output = kittiwake(&["status", "--all", "--pid", &self.pid().to_string()]);
            output.status.success().then(|| serde_json::from_slice(&output.stdout).expect("the status is JSON"))
        })
    }

    /// The link to the operator's page, with its token.
    pub fn link(&self) -> String {
        let line = self.wait_for("#token=");
        line[line.find("http").unwrap_or(0)..].trim().to_owned()
    }

    /// The router's locator.
    pub fn locator(&self) -> String {
        self.wait_for(" is up: ").rsplit(' ').next().unwrap_or_default().to_owned()
    }
}

impl Drop for System {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("the system of this failed story said:\n{}", self.said.text());
        }
        // Its children end with it.
        let _ = self.launcher.kill();
        let _ = self.launcher.wait();
    }
}

impl Said {
    fn update(&self, change: impl FnOnce(&mut (Vec<String>, bool))) {
        change(&mut self.lines.lock().unwrap());
        self.changed.notify_all();
    }

    /// `None` if the limit has passed, or the output has ended, without it.
    fn wait<T>(&self, mut find: impl FnMut(&[String]) -> Option<T>) -> Option<T> {
        let until = Instant::now() + LIMIT;
        let mut state = self.lines.lock().unwrap();
        loop {
            let found = find(&state.0);
            let left = until.saturating_duration_since(Instant::now());
            if found.is_some() || state.1 || left.is_zero() {
                return found;
            }
            state = self.changed.wait_timeout(state, left).unwrap().0;
        }
    }

    fn wait_for_end(&self) -> Option<()> {
        let until = Instant::now() + LIMIT;
        let mut state = self.lines.lock().unwrap();
        while !state.1 {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return None;
            }
            state = self.changed.wait_timeout(state, left).unwrap().0;
        }
        Some(())
    }

    fn lines(&self) -> Vec<String> {
        self.lines.lock().unwrap().0.clone()
    }

    fn text(&self) -> String {
        self.lines().join("\n")
    }
}

impl Ending {
    /// The report: the one document on standard output.
    #[track_caller]
    pub fn report(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error} in:\n{}", self.stdout))
    }

    /// The mission manager's decisions about `topic`, in order, without the times.
    pub fn story(&self, topic: &str) -> Vec<String> {
        let told = |line: &String| {
            let (_, text) = line.strip_prefix('[')?.split_once(" s] ")?;
            text.strip_prefix(topic)?.strip_prefix(": ").map(str::to_owned)
        };
        self.lines.iter().filter_map(told).collect()
    }

    /// Fails unless these parts were printed in this order.
    #[track_caller]
    pub fn expect_in_order(&self, parts: &[&str]) {
        let mut lines = self.lines.iter();
        for part in parts {
            assert!(
                lines.any(|it| it.contains(part)),
                "`{part}` is missing or too early in:\n{}",
                self.lines.join("\n")
            );
        }
    }

    /// Each objective's state, without the enum's prefix.
    #[track_caller]
    pub fn objectives(&self) -> Vec<String> {
        let report = self.report();
        let objectives = report["objectives"].as_array().expect("a report has objectives");
        let state = |it: &Value| it["state"].as_str().unwrap_or_default().replace("OBJECTIVE_STATE_", "");
        objectives.iter().map(state).collect()
    }

    /// Fails unless it ended with this code and these objectives.
    #[track_caller]
    pub fn expect(&self, code: i32, objectives: &[&str]) {
        assert_eq!(self.code, Some(code), "exit code; it said:\n{}", self.lines.join("\n"));
        assert_eq!(self.objectives(), objectives, "it said:\n{}", self.lines.join("\n"));
    }
}

/// How the program keeps a system up, as [`System::of`] starts it.
fn command(program: &Path, args: &[&str]) -> Command {
    // A terminal that is closed is heard of, also where the tests are run by `nohup`.
    let mut command = Command::new("env");
    command.arg("--default-signal=HUP").arg(program);
    // Not into the recordings of the user who runs the tests.
    command.args(["up", "--json"]).args(args).env("XDG_STATE_HOME", concat!(env!("CARGO_TARGET_TMPDIR"), "/state"));
    command.stdin(Stdio::null());
    command
}

/// Runs the program to its end.
pub fn kittiwake(args: &[&str]) -> Output {
    Command::new(KITTIWAKE).args(args).stdin(Stdio::null()).output().expect("the program starts")
}

/// Waits until `find` finds something.
#[track_caller]
pub fn wait_for<T>(what: &(impl Display + ?Sized), find: impl FnMut() -> Option<T>) -> T {
    wait::wait_within(LIMIT, Duration::from_millis(20), what, find)
}

/// The folder of the shipped configuration.
pub fn shipped() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("config")
}
