//! The control tower dies, and the one after it knows what was decided, or says that it does not.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use nix::sys::signal::Signal;
use serde_json::Value;
use store::Store;

use crate::support::files::{Files, state_folder};
use crate::support::http::Http;
use crate::support::{KITTIWAKE, System, wait_for};

/// A flight over a tower that is killed.
struct Flight {
    system: System,
    http: Http,
    state: PathBuf,
    _folder: tempfile::TempDir,
}

impl Flight {
    fn start(args: &[&str]) -> Flight {
        let folder = state_folder();
        let state = folder.path().join("state");
        let system = System::up(&[args, &["--state", state.to_str().expect("a readable path")]].concat(), &[]);
        let http = system.http();
        Flight { system, http, state, _folder: folder }
    }

    /// Runs a command for operators; what was said, and whether it was done.
    fn run(&self, command: &str) -> (bool, String) {
        let mut program = Command::new(KITTIWAKE);
        program.args(command.split(' ')).env("KITTIWAKE_URL", format!("http://{}", self.http.address));
        let output = program.env("KITTIWAKE_TOKEN", &self.http.token).stdin(Stdio::null()).output();
        let output = output.expect("the program starts");
        (output.status.success(), String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned())
    }

    /// What is refused because the disk of this machine is busy with something else is ordered again, as an operator would.
    #[track_caller]
    fn done(&self, command: &str) -> String {
        let (done, said) = wait_for(command, || {
            Some(self.run(command)).filter(|(done, said)| *done || !said.contains("the disk has not answered"))
        });
        assert!(done, "{command}: {said}");
        said
    }

    #[track_caller]
    fn refused(&self, command: &str, words: &str) {
        let (done, said) = self.run(command);
        assert!(!done && said.contains(words), "{command}: {said}");
    }

    #[track_caller]
    fn wait_until(&self, what: &str, is: impl Fn(&Value) -> bool) -> Value {
        wait_for(what, || Some(self.system.status()).filter(&is))
    }

    /// The tower is killed by `kill -9` after `spoil`, and the next one is there.
    #[track_caller]
    fn kill_tower(&self, spoil: impl FnOnce(&Path)) {
        let before = tower(&self.system.status());
        // One that hung may have just been killed by the launcher.
        let process = wait_for("a tower", || {
            self.system.children().into_iter().find(|(name, _)| name == "control-tower").map(|it| it.1)
        });
        process.signal(Signal::SIGSTOP);
        spoil(&self.state);
        process.signal(Signal::SIGKILL);
        self.wait_until("the next tower", |it| {
            let now = tower(it);
            now.0 != before.0 && now.1 == "alive" && stale(it) != "the control tower is gone"
        });
    }
}

/// The newest instance of the tower, and its health.
fn tower(vehicle: &Value) -> (String, String) {
    let processes = vehicle["processes"].as_array().cloned().unwrap_or_default();
    let tower = processes.into_iter().find(|it| it["service"] == "control-tower").unwrap_or_default();
    (tower["instance"].to_string(), tower["health"].as_str().unwrap_or_default().to_owned())
}

fn stale(vehicle: &Value) -> &str {
    vehicle["tower"]["stale"].as_str().unwrap_or("the control tower is gone")
}

fn permission<'a>(vehicle: &'a Value, area: &str) -> Option<&'a Value> {
    vehicle["permissions"].as_array()?.iter().find(|it| it["area"] == area)
}

fn is(vehicle: &Value, area: &str, state: &str) -> bool {
    permission(vehicle, area).is_some_and(|it| it["state"] == format!("PERMISSION_STATE_{state}"))
}

/// Whether it is over area A of the reference mission, with a margin.
fn is_over_a(vehicle: &Value, margin_m: f64) -> bool {
    let position = &vehicle["aircraft"]["localPosition"]["position"];
    let [north, east] = ["northM", "eastM"].map(|it| position[it].as_f64().unwrap_or_default());
    (110.0 + margin_m..290.0 - margin_m).contains(&east) && north.abs() < 90.0 - margin_m
}

#[test]
fn an_area_that_was_denied_by_hand_stays_denied_after_the_tower_was_killed() {
    let files = Files::begun_by_operator();
    let config = files.config();
    let flight = Flight::start(&["--config", config.to_str().expect("a readable path"), "--speed", "5"]);
    flight.wait_until("the manager to wait for the operator", |it| it["operator"]["startAwaited"] == true);
    for area in ["A", "B"] {
        flight.done(&format!("permission deny {area} --reason fog"));
    }
    flight.kill_tower(|_| {});
    flight.system.begin();
    let asked = flight.wait_until("the request for B", |it| {
        assert!(!is(it, "A", "GRANTED") && !is(it, "B", "GRANTED"), "{}", it["permissions"]);
        permission(it, "B").is_some_and(|it| it["requestId"] != "")
    });
    assert!(is(&asked, "B", "DENIED"), "{}", asked["permissions"]);
    assert_eq!(permission(&asked, "B").map(|it| &it["reason"]), Some(&"fog".into()));
}

#[test]
fn a_vehicle_inside_is_made_to_leave_by_a_tower_that_was_killed_meanwhile() {
    // In real time it is over A for long enough to be paused there on a crowded machine, on which the hung tower is not killed either
    // before its ledger is looked at.
    let files = Files::shipped().with("kittiwake.toml", "hung_after_s = 3.0", "hung_after_s = 60.0");
    let flight = Flight::start(&["--config", files.config().to_str().expect("a readable path"), "--speed", "1"]);
    flight.wait_until("the vehicle over A", |it| is_over_a(it, 30.0));
    flight.done("vehicle pause");
    let before = flight.wait_until("the pause over A", |it| it["operator"]["paused"] == true);
    assert!(is_over_a(&before, 0.0) && is(&before, "A", "GRANTED"), "{}", before["permissions"]);
    // A tower that hangs is shown as such until it is killed.
    flight.system.process("control-tower").signal(Signal::SIGSTOP);
    flight.wait_until("a stale ledger", |it| stale(it).contains("heard last") || stale(it).contains("is gone"));
    let said = flight.done("permission list");
    assert!(said.contains("granted (stale)") && said.contains("\nstale: the control tower"), "{said}");
    flight.kill_tower(|_| {});
    let after = flight.wait_until("its ledger", |it| stale(it).is_empty() && is(it, "A", "GRANTED"));
    let number =
        |it| permission(it, "A").and_then(|it| it["decision"].as_str()?.parse::<u64>().ok()).expect("a number");
    assert!(number(&before) <= number(&after), "{}, then {}", number(&before), number(&after));
    flight.system.wait_for("asking for area A again because the control tower was started again");
    flight.done("permission revoke A --reason fire");
    flight.wait_until("the vehicle outside of A", |it| !is_over_a(it, 0.0));
    // Denied, if its request came to the tower after the revocation.
    let status = flight.system.status();
    let ended = permission(&status, "A").filter(|_| !is(&status, "A", "GRANTED"));
    assert_eq!(ended.map(|it| &it["reason"]), Some(&"fire".into()), "{}", status["permissions"]);
}

#[test]
fn a_tower_whose_ledger_cannot_be_used_says_so_and_grants_nothing_until_an_operator_accepts_that() {
    let flight = Flight::start(&["--speed", "1"]);
    flight.done("permission deny A --reason fog");
    flight.done("permission grant C");
    for (spoil, words) in KINDS {
        flight.kill_tower(spoil);
        let lost = flight.wait_until(words, |it| stale(it).contains(words));
        assert!(!is(&lost, "A", "GRANTED") && !is(&lost, "C", "GRANTED"), "{words}: {}", lost["permissions"]);
        flight.http.wait_for_problem("control-tower: waits for an operator");
        flight.http.wait_for_problem(words);
        flight.refused("permission grant A", "nothing is granted before an operator accepts that");
        // Nobody knows what the vehicle was granted, so everything can be taken from it.
        flight.done("permission revoke C");
        flight.done("permission accept-loss");
        flight.wait_until("a ledger that counts again", |it| stale(it).is_empty() && is(it, "C", "REVOKED"));
        flight.done("permission grant A");
        flight.wait_until("the grant", |it| is(it, "A", "GRANTED"));
        flight.refused("permission accept-loss", "nothing to accept");
    }
    // What was not used is still there.
    assert!(std::fs::read_dir(&flight.state).expect("it is there").count() > 2 * KINDS.len());
}

/// What spoils a ledger, and the words that tell it.
type Kind = (fn(&Path), &'static str);

const KINDS: [Kind; 2] = [
    (|it| replace(it, |path| std::fs::write(path, "\u{0}garbled").expect("it can be written")), "is garbled"),
    (|it| replace(it, newer), "was written by a newer program"),
];

#[test]
fn the_ledger_of_another_owner_is_not_written_to_and_nothing_is_granted_over_it() {
    let flight = Flight::start(&["--speed", "1"]);
    flight.done("permission deny A");
    flight.kill_tower(|it| replace(it, |path| copy(path, "uav7", 1)));
    flight.wait_until("the loss", |it| stale(it).contains("belongs to `uav7`, not to `the fleet`"));
    let content =
        || ["control-tower.0", "control-tower.1"].map(|it| std::fs::read(flight.state.join(it)).expect("there"));
    let before = content();
    flight.refused("permission accept-loss", "a grant could not be stored");
    flight.refused("permission grant A", "nothing is granted");
    flight.done("permission deny B");
    assert_eq!(content(), before);
}

/// Puts something in place of both generations.
fn replace(state: &Path, put: impl Fn(&Path)) {
    for slot in ["control-tower.0", "control-tower.1"] {
        let path = state.join(slot);
        std::fs::remove_file(&path).expect("it can be removed");
        put(&path);
    }
}

fn newer(path: &Path) {
    copy(path, "the fleet", 99);
}

/// Copies a generation of another store.
fn copy(path: &Path, owner: &str, version: u32) {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let mut store = Store::open(folder.path(), "control-tower", owner, version).expect("nobody else has it").0;
    store.save(b"{}").expect("it can be written");
    std::fs::copy(folder.path().join(path.file_name().expect("it has a name")), path).expect("it can be copied");
}
