//! A memory that cannot be used: nothing takes off by itself, everybody sees why, and the operator's `start` begins.

use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use nix::sys::signal::Signal;
use serde_json::Value;
use store::Store;

use crate::support::files::{Files, state_folder};
use crate::support::http::Http;
use crate::support::{KITTIWAKE, System, wait_for};

/// A system over a folder of states that a test spoils.
struct Flight {
    system: System,
    http: Http,
    state: PathBuf,
    _folder: tempfile::TempDir,
    _files: Files,
}

/// Told when a wait was in vain.
struct LastSeen(Value);

impl Drop for LastSeen {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let of = |name: &str| &self.0[name];
            eprintln!("last seen: {} {} {} {}", of("mission"), of("contingencies"), of("operator"), of("report"));
        }
    }
}

impl Flight {
    fn start() -> Flight {
        let folder = state_folder();
        let state = folder.path().join("state");
        std::fs::create_dir(&state).expect("a folder can be made");
        Flight::start_over(folder, state)
    }

    fn start_over(folder: tempfile::TempDir, state: PathBuf) -> Flight {
        // With the shipped limit, deaths in a row on the ground would end the launcher.
        let files = Files::with_long_leg().with("kittiwake.toml", "deaths = 5", "deaths = 100");
        let config = files.config();
        let readable = |it: &'_ Path| it.to_str().expect("a readable path").to_owned();
        // Slow enough that a crowded machine can end several flights on one leg.
        let system = System::up(&["--config", &readable(&config), "--speed", "2", "--state", &readable(&state)], &[]);
        let http = system.http();
        Flight { system, http, state, _folder: folder, _files: files }
    }

    /// Gives an order; what was said, and whether it was obeyed.
    fn order(&self, verb: &str) -> (bool, String) {
        let mut command = Command::new(KITTIWAKE);
        command.args(["vehicle", verb]).env("KITTIWAKE_URL", format!("http://{}", self.http.address));
        command.env("KITTIWAKE_TOKEN", &self.http.token).stdin(Stdio::null());
        let output = command.output().expect("the program starts");
        let said = [output.stdout, output.stderr].concat();
        (output.status.success(), String::from_utf8_lossy(&said).into_owned())
    }

    #[track_caller]
    fn obeyed(&self, verb: &str) {
        let (done, said) = self.order(verb);
        assert!(done, "{verb}: {said}");
    }

    #[track_caller]
    fn wait_until(&self, what: &str, is: impl Fn(&Value) -> bool) -> Value {
        let mut last = LastSeen(Value::Null);
        wait_for(what, || {
            last.0 = self.system.status();
            Some(last.0.clone()).filter(&is)
        })
    }

    #[track_caller]
    fn wait_for_flight(&self) {
        self.wait_until("the flight", |it| it["aircraft"]["status"]["actualMode"] == "FLIGHT_MODE_OFFBOARD");
    }

    /// Flies, is aborted, and lands; its manager knows that the mission is over.
    #[track_caller]
    fn abort(&self) {
        self.wait_for_flight();
        self.http.order("/api/v1/vehicles/uav1/abort", "");
        self.wait_until("the end", |it| !it["report"].is_null() && !is_armed(it));
    }

    /// The manager dies and is started again.
    #[track_caller]
    fn kill_manager(&self) {
        self.kill("mcm", |_| {});
    }

    /// A process dies and is started again, with a memory that was spoiled meanwhile.
    #[track_caller]
    fn kill(&self, process: &str, spoil: impl FnOnce(&Path)) {
        let process = self.system.process(process);
        process.signal(Signal::SIGSTOP);
        spoil(&self.state);
        process.signal(Signal::SIGKILL);
        wait_for("the process to be gone", || (!process.runs()).then_some(()));
    }

    /// The vehicle stays on the ground, and the reason is shown everywhere.
    #[track_caller]
    fn stays_down(&self, what: &str, words: &str) {
        let seen = self.wait_until(&format!("{what}: the flag"), |it| {
            assert!(!is_armed(it), "{what}: it took off by itself: {it}");
            it["operator"]["startAwaited"] == true
                && reasons(it).iter().any(|(flag, why)| flag == "memory_unusable" && why.contains(words))
        });
        self.http.wait_for_problem(words);
        let until = time_s(&seen) + 12.0;
        self.wait_until(&format!("{what}: longer than a start takes"), |it| {
            assert!(!is_armed(it), "{what}: it took off by itself: {it}");
            until <= time_s(it)
        });
    }
}

fn is_armed(vehicle: &Value) -> bool {
    vehicle["aircraft"]["status"]["armed"] == true
}

fn time_s(vehicle: &Value) -> f64 {
    vehicle["missionTimeS"].as_f64().unwrap_or_default()
}

/// The flags that are up, each with its reason.
fn reasons(vehicle: &Value) -> Vec<(String, String)> {
    let text = |it: &Value| it.as_str().unwrap_or_default().to_owned();
    let active = vehicle["contingencies"]["active"].as_array().cloned().unwrap_or_default();
    active.iter().map(|it| (text(&it["flag"]), text(&it["reason"]))).collect()
}

/// Puts something in place of both generations.
fn replace(state: &Path, put: impl Fn(&Path)) {
    for slot in ["mcm.0", "mcm.1"] {
        let path = state.join(slot);
        if path.is_dir() {
            std::fs::remove_dir_all(&path).expect("it can be removed");
        } else {
            std::fs::remove_file(&path).expect("it can be removed");
        }
        put(&path);
    }
}

/// Copies the generations of another store.
fn replace_by_store(state: &Path, owner: &str, version: u32) {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let mut store = Store::open(folder.path(), "mcm", owner, version).expect("nobody else has it").0;
    store.save(b"{}").expect("it can be written");
    replace(state, |path| {
        std::fs::copy(folder.path().join(path.file_name().expect("it has a name")), path).expect("it can be copied");
    });
}

#[test]
fn no_unusable_memory_lets_an_aborted_vehicle_take_off_again() {
    type Kind = (&'static str, fn(&Path), &'static str);
    let kinds: [Kind; 5] = [
        ("empty", |it| replace(it, |path| std::fs::write(path, "").unwrap()), "is garbled: it is empty"),
        ("garbled", |it| replace(it, |path| std::fs::write(path, "\u{0}garbled").unwrap()), "is garbled"),
        ("a directory", |it| replace(it, |path| std::fs::create_dir(path).unwrap()), "is of another kind"),
        ("newer", |it| replace_by_store(it, "uav1", 99), "was written by a newer program"),
        ("unreadable", |it| replace(it, |path| symlink(path, path).unwrap()), "cannot be read"),
    ];
    let flight = Flight::start();
    for (what, spoil, words) in kinds {
        flight.abort();
        flight.kill("mcm", spoil);
        flight.stays_down(what, words);
        // A further restart, with a memory that can be read, does not forget that the one before was lost.
        flight.kill_manager();
        flight.stays_down(what, words);
        flight.obeyed("start");
    }
    flight.wait_for_flight();
    let health = wait_for("the health", || Some(flight.http.json("/healthz")).filter(|it| it["status"] == "ok"));
    assert_eq!(health["problems"], Value::Array(Vec::new()));
}

#[test]
fn the_folder_of_another_vehicle_is_not_written_to_and_nothing_begins_there() {
    let flight = Flight::start();
    flight.abort();
    flight.kill("mcm", |it| replace_by_store(it, "uav2", 1));
    let content = || ["mcm.0", "mcm.1"].map(|it| std::fs::read(flight.state.join(it)).expect("it is there"));
    let before = content();
    flight.stays_down("foreign", "belongs to `uav2`, not to `uav1`");
    let (done, said) = flight.order("start");
    assert!(!done && said.contains("what happens could not be remembered"), "{said}");
    assert_eq!(content(), before);
    flight.kill("mcm", |it| replace(it, |path| std::fs::write(path, "").expect("it can be written")));
    flight.stays_down("empty", "is garbled");
    flight.obeyed("start");
    flight.wait_for_flight();
}

impl Flight {
    /// Somebody moves the state folder away, and makes an empty one in its place.
    fn replace_folder(&self, number: u32) {
        std::fs::rename(&self.state, self.state.with_extension(number.to_string())).expect("it can be renamed");
        std::fs::create_dir(&self.state).expect("a folder can be made");
    }

    #[track_caller]
    fn wait_for_reason(&self, flag: &str, words: &str) -> Value {
        self.wait_until(&format!("{flag}: {words}"), |it| {
            reasons(it).iter().any(|(name, why)| name == flag && why.contains(words))
        })
    }
}

#[test]
fn a_state_folder_that_was_replaced_is_a_memory_that_was_lost() {
    let gone = "has no state of `mcm`, which has run before";
    let flight = Flight::start();
    flight.abort();
    flight.replace_folder(1);
    flight.kill_manager();
    flight.stays_down("after an abort", gone);
    flight.obeyed("start");
    flight.wait_for_flight();
    // In flight nobody writes into what may be another system's, and a manager that is started again has an operator decide.
    flight.replace_folder(2);
    flight.wait_for_reason("memory_unwritable", "the state folder was replaced");
    let left: Vec<_> = std::fs::read_dir(&flight.state).expect("it is there").collect();
    assert!(left.is_empty(), "{left:?}");
    flight.kill_manager();
    flight.wait_for_reason("memory_unusable", gone);
    flight.wait_until("the hold", |it| it["aircraft"]["status"]["actualMode"] == "FLIGHT_MODE_LOITER");
    flight.obeyed("abort");
    flight.wait_until("the end", |it| !it["report"].is_null() && !is_armed(it));
}

/// A small disk in memory, mounted for a test.
struct Disk(PathBuf);

impl Disk {
    #[track_caller]
    fn mount(at: &Path) -> Disk {
        std::fs::create_dir_all(at).expect("a folder can be made");
        assert!(mount(&["-t", "tmpfs", "-o", "size=64k", "none"], at), "a disk can be mounted");
        Disk(at.to_owned())
    }

    /// Mounts the same disk over itself, read-only: what opens a file from now on cannot write, whatever is open already.
    fn cover_read_only(&self) {
        let folder = self.0.to_str().expect("a readable path");
        assert!(mount(&["--bind", folder], &self.0) && mount(&["-o", "remount,bind,ro"], &self.0), "mounted read-only");
    }

    fn uncover(&self) {
        let status = Command::new("umount").arg("--lazy").arg(&self.0).status();
        assert!(status.is_ok_and(|it| it.success()), "unmounted");
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("--lazy").arg(&self.0).status();
    }
}

fn mount(args: &[&str], at: &Path) -> bool {
    Command::new("mount").args(args).arg(at).stderr(Stdio::null()).status().is_ok_and(|it| it.success())
}

/// In the environment of a story that has mounts of its own.
const OWN_MOUNTS: &str = "KITTIWAKE_STORY_HAS_OWN_MOUNTS";

/// Runs a story of this file once more, where it may mount: as root, or as the root of a namespace that users may make.
/// Its mounts go with it, whatever happens.
#[track_caller]
fn run_with_own_mounts(story: &str) {
    let kinds: [&[&str]; 2] = [&["--mount"], &["--user", "--map-root-user", "--mount"]];
    let is_allowed = |kind: &&[&str]| {
        let tried = Command::new("unshare").args(*kind).arg("true").stderr(Stdio::null()).status();
        tried.is_ok_and(|it| it.success())
    };
    let kind = kinds.into_iter().find(is_allowed);
    let kind =
        kind.expect("a disk has to be mounted: needs root, or a system whose users may make namespaces (unshare)");
    // Not the folder of the real root: the one of a namespace may not use it.
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let mut command = Command::new("unshare");
    command.env("TMPDIR", folder.path()).args(kind).arg(std::env::current_exe().expect("this program has a path"));
    // A test's name has no crate in it.
    let (_, module) = module_path!().split_once("::").expect("a module");
    command.args(["--exact", &format!("{module}::{story}"), "--ignored", "--nocapture"]).env(OWN_MOUNTS, "1");
    let ended = command.output().expect("util-linux");
    let said = String::from_utf8_lossy(&ended.stdout) + String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.success() && said.contains("1 passed"), "{story}, with mounts of its own: {said}");
}

#[test]
#[ignore = "needs root or namespaces to mount a disk: cargo test --test stories -- --ignored a_disk_that_cannot_be_written_to"]
fn a_disk_that_cannot_be_written_to_lets_nothing_begin() {
    if std::env::var_os(OWN_MOUNTS).is_none() {
        return run_with_own_mounts("a_disk_that_cannot_be_written_to_lets_nothing_begin");
    }
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let state = folder.path().join("state");
    let disk = Disk::mount(&state);
    let flight = Flight::start_over(folder, state.clone());
    let fill = state.join("filler");
    type Kind<'a> = (&'a str, &'a dyn Fn(), &'a dyn Fn(), &'a str);
    let full = || {
        // Fails once it is full.
        let _ = std::fs::write(&fill, vec![0; 1 << 20]);
    };
    let free = || std::fs::remove_file(&fill).expect("it can be removed");
    let read_only = || disk.cover_read_only();
    let writable = || disk.uncover();
    let kinds: [Kind; 2] =
        [("full", &full, &free, "there is no space"), ("read-only", &read_only, &writable, "it is read-only")];
    for (what, spoil, mend, words) in kinds {
        flight.wait_for_flight();
        spoil();
        // Nothing changes in flight, and the order is obeyed.
        flight.abort();
        flight.kill_manager();
        flight.stays_down(what, "");
        let (done, said) = flight.order("start");
        assert!(!done && said.contains(words), "{what}: {said}");
        mend();
        flight.wait_until("a memory that is written", |it| {
            assert!(!is_armed(it), "{what}: it took off by itself: {it}");
            reasons(it).iter().all(|(flag, _)| flag != "memory_unwritable")
        });
        flight.stays_down(what, "");
        flight.obeyed("start");
    }
    flight.wait_for_flight();
}

#[test]
fn a_second_manager_for_one_vehicle_ends_and_says_why() {
    let flight = Flight::start();
    flight.wait_for_flight();
    let locator = flight.system.locator();
    let manager = flight.system.process("mcm").id();
    let config = crate::support::shipped().join("kittiwake.toml");
    let elsewhere = state_folder();
    let check = |state: &Path, words: &str| {
        let [config, state] = [&config, state].map(|it| it.to_str().expect("a readable path"));
        let mut second = Command::new(KITTIWAKE);
        second.args(["run", "mcm", "--config", config, "--connect", &locator, "--state", state]);
        let mut second = second.stdin(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program starts");
        wait_for("the second manager to end", || second.try_wait().expect("it is a child"));
        let output = second.wait_with_output().expect("it has ended");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && said.contains(words), "{said}");
        assert!(!said.contains("panicked"), "{said}");
        said
    };
    check(&flight.state, "is in use by another process: end that one, or name another folder");
    check(elsewhere.path(), "another mcm runs already for the same vehicle");
    assert_eq!(flight.system.process("mcm").id(), manager, "the first one flies on");
    flight.obeyed("abort");
}
