//! `kittiwake vehicle`, `mission` and `permission` against a system that flies.

use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use gateway::access::{Role, entry};
use nix::sys::signal::Signal;
use serde_json::Value;

use crate::support::files::write_private;
use crate::support::{KITTIWAKE, System, kittiwake, shipped, wait_for};

/// A system with tokens of its own, and who uses them.
struct Crew {
    system: System,
    url: String,
    folder: tempfile::TempDir,
}

/// What a command came to.
struct Told {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

impl Told {
    fn of(output: Output) -> Told {
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        Told { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
    }

    /// Fails unless it ended with `code` and said `part` on either output.
    #[track_caller]
    fn expect(self, code: i32, part: &str) -> Told {
        let said = format!("{}{}", self.stdout, self.stderr);
        assert!(self.code == Some(code) && said.contains(part), "expected {code} and `{part}`: {:?} {said}", self.code);
        self
    }

    /// The one document on standard output.
    #[track_caller]
    fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error}: {}{}", self.stdout, self.stderr))
    }
}

impl Crew {
    fn start(args: &[&str]) -> Crew {
        let folder = tempfile::tempdir().unwrap();
        let roles = [("anna", Role::Operator), ("ben", Role::Operator), ("eve", Role::Observer), ("tom", Role::Tower)];
        let entries = roles.map(|(name, role)| entry(name, &[role], &format!("{name}-token")));
        write_private(&folder.path().join("tokens.toml"), &entries.concat());
        let access = folder.path().to_str().unwrap();
        let system = System::up(&[&["--access", access], args].concat(), &[]);
        let line = system.wait_for("status: http://");
        let url = line["status: ".len()..].split("/api/").next().unwrap().to_owned();
        Crew { system, url, folder }
    }

    /// Has somebody say `line`.
    fn says(&self, who: &str, line: &str) -> Told {
        let mut command = Command::new(KITTIWAKE);
        command.args(line.split(' ')).env("KITTIWAKE_URL", &self.url).env("KITTIWAKE_TOKEN", format!("{who}-token"));
        Told::of(command.stdin(Stdio::null()).output().unwrap())
    }

    fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    /// Waits until what eve reads of the vehicle is as `is` wants it.
    #[track_caller]
    fn wait_until(&self, what: &str, is: impl Fn(&Value) -> bool) {
        wait_for(what, || is(&self.says("eve", "vehicle show --json").json()).then_some(()));
    }
}

const BACK: &str =
    "name = \"back\"\n[[objective]]\nname = \"home\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n";

#[test]
fn a_crew_flies_by_the_command_line() {
    let crew = Crew::start(&["--speed", "5", "--permissions", "silent", "--exit-when-done"]);
    // The gateway answers before it has heard of a vehicle.
    wait_for("the vehicle", || {
        crew.says("eve", "vehicle list").expect(0, "VEHICLE").stdout.contains("uav1").then_some(())
    });
    crew.wait_until("the flight", |it| it["aircraft"]["status"]["actualMode"] == "FLIGHT_MODE_OFFBOARD");

    // The tower decides what it is asked.
    crew.wait_until("a question to the tower", |it| it["permissions"][0]["state"] == "PERMISSION_STATE_REQUESTED");
    crew.says("tom", "permission pending").expect(0, "requested");
    crew.says("eve", "permission grant A").expect(3, "it takes the role tower");
    let granted = crew.says("tom", "permission grant A --valid-for-s 600 --reason clear --json").expect(0, "");
    assert_eq!(granted.json()["text"], "area A: granted");
    crew.wait_until("the grant", |it| it["permissions"][0]["state"] == "PERMISSION_STATE_GRANTED");
    let list = crew.says("tom", "permission list --json").expect(0, "").json();
    assert_eq!((&list["vehicle"], &list["permissions"][0]["area"]), (&"uav1".into(), &"A".into()));

    // Command is taken where it is free, and from nobody who has not offered it.
    let paused = crew.says("anna", "vehicle pause --json").expect(0, "took command of uav1");
    assert_eq!((&paused.json()["verb"], &paused.json()["text"]), (&"pause".into(), &"holds until resumed".into()));
    crew.says("anna", "vehicle pause").expect(3, "it holds already");
    let refused = crew.says("ben", "vehicle resume --json").expect(3, "anna holds command of uav1");
    assert_eq!(refused.json()["command"]["holder"], "anna");
    crew.says("anna", "vehicle hand-over ben").expect(0, "anna, offered to ben");
    crew.says("ben", "vehicle resume").expect(3, "offered to ben, who takes it with --hand-over");
    crew.says("ben", "vehicle resume --hand-over").expect(0, "goes on with a new plan");
    crew.says("eve", "vehicle show").expect(0, "command      ben");

    wait_for("the plan", || crew.says("eve", "mission plan").stdout.contains("land").then_some(()));

    // Another mission is looked at, refused, and put in the place of the present one, while the vehicle waits.
    crew.says("ben", "vehicle pause").expect(0, "holds until resumed");
    let reference = shipped().join("missions/reference.toml");
    let validated = crew.says("ben", &format!("mission validate {} --json", reference.display())).expect(0, "");
    assert_eq!(validated.json()["accepted"], true);
    assert!(validated.json()["forecast"][0]["lengthM"].as_f64().is_some_and(|it| 0.0 < it), "{}", validated.stdout);
    let wrong = crew.file("wrong.toml", &BACK.replace("east_m = 0", "east_m = \"far\""));
    crew.says("ben", &format!("mission upload {}", wrong.display())).expect(2, "wrong.toml:5:10: ");
    let back = crew.file("back.toml", BACK);
    crew.says("ben", &format!("mission upload {}", back.display())).expect(0, "`back` takes the place of `reference`");
    let mission = crew.says("eve", "mission show --json").expect(0, "").json();
    assert_eq!((&mission["mission"], &mission["objectives"][0]["name"]), (&"back".into(), &"home".into()));
    crew.says("ben", "mission insert 0 look 20 30 15").expect(0, "objective `look` inserted at 0");
    crew.says("ben", "mission skip look").expect(0, "objective `look` skipped");
    crew.says("ben", "mission remove nobody").expect(3, "there is no objective `nobody`");
    crew.says("ben", "mission approve").expect(3, "no plan waits for approval");

    // What has happened is told again.
    let events = crew.says("eve", "vehicle events --count 50 --json").expect(0, "");
    let told: Vec<Value> = events.stdout.lines().map(|it| serde_json::from_str(it).unwrap()).collect();
    assert_eq!(told.len(), 50);
    assert!(told.iter().any(|it| it["event"] == "audit" && it["data"]["what"] == "pause"), "{}", events.stdout);

    // The uploaded mission outlives the planner.
    crew.system.process("planner").signal(Signal::SIGKILL);
    crew.system.wait_for("planner ended by signal 9");
    wait_for("the planner", || {
        let shown = crew.says("eve", "mission show --json");
        (shown.code == Some(0)).then(|| assert_eq!(shown.json()["mission"], "back", "{}", shown.stdout))
    });
    crew.says("ben", "vehicle resume").expect(0, "goes on with a new plan");
    let Crew { system, .. } = crew;
    system.end().expect(3, &["FAILURE", "SUCCESS"]);
}

#[test]
fn what_was_ordered_and_ended_outlives_the_mission_manager() {
    let crew = Crew::start(&["--speed", "10"]);
    let kill = |nth| {
        crew.system.process("mcm").signal(Signal::SIGKILL);
        crew.system.wait_for_nth("mcm ended by signal 9", nth);
    };
    crew.system.wait_for("step 4 of 5");
    crew.wait_until("the flight", |it| it["aircraft"]["status"]["actualMode"] == "FLIGHT_MODE_OFFBOARD");
    crew.says("anna", "vehicle abort").expect(0, "lands here and ends the mission");
    kill(1);
    let over = "mission: over: `operator_abort`: ordered by anna";
    crew.system.wait_for_nth(over, 1);
    kill(2);
    crew.system.wait_for_nth(over, 2);
    crew.wait_until("the end", |it| {
        it["aircraft"]["status"]["armed"] != true && it["mission"]["phase"] == "MISSION_PHASE_OVER"
    });
    crew.says("anna", "vehicle start").expect(3, "the mission is over: `operator_abort`: ordered by anna");
}

#[test]
fn what_is_not_there_is_not_reachable_and_what_makes_no_sense_is_told() {
    let told = |line: &str| Told::of(kittiwake(&line.split(' ').collect::<Vec<_>>()));
    // A port that nobody listens on: it was free a moment ago.
    let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let refused =
        told(&format!("vehicle pause --json --vehicle uav1 --url http://{free}")).expect(5, "does not answer");
    assert!(refused.json()["detail"].as_str().unwrap().contains("does not answer"));
    told("vehicle pause --url nonsense").expect(2, "is no URL");
    told("mission validate /nowhere/m.toml").expect(2, "/nowhere/m.toml: cannot be read");
    told("vehicle pause --token-file /nowhere/token").expect(2, "/nowhere/token: cannot be read");
    told(&format!("vehicle show --url https://{free} --ca /nowhere/ca.pem")).expect(2, "ca.pem: cannot be read");
}

#[test]
fn over_tls_the_same_commands_find_the_system_and_trust_its_certificate() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let made = rcgen::generate_simple_self_signed(vec!["127.0.0.1".to_owned()]).unwrap();
    let other = rcgen::generate_simple_self_signed(vec!["127.0.0.1".to_owned()]).unwrap();
    let (certificate, key, wrong_key) = (path("gateway.pem"), path("gateway.key"), path("other.key"));
    write_private(certificate.as_ref(), &made.cert.pem());
    write_private(key.as_ref(), &made.signing_key.serialize_pem());
    write_private(wrong_key.as_ref(), &other.signing_key.serialize_pem());
    let told = |args: &[&str]| Told::of(kittiwake(args));

    // Refused before anything is started.
    told(&["up", "--tls-certificate", &certificate, "--tls-key", &wrong_key])
        .expect(2, "is not the key of the certificate");
    told(&["up", "--http", "0.0.0.0:0"]).expect(2, "would listen on 0.0.0.0:0 without TLS");
    told(&["gateway", "--http", "0.0.0.0:0"]).expect(2, "would listen on 0.0.0.0:0 without TLS");

    let system = System::up(&["--speed", "1", "--tls-certificate", &certificate, "--tls-key", &key], &[]);
    let link = system.link();
    let (url, _) = link.split_once("/#token=").unwrap();
    assert!(url.starts_with("https://127.0.0.1:"), "{link}");
    let pid = system.pid().to_string();
    wait_for("the run file", || (told(&["vehicle", "list", "--pid", &pid]).code == Some(0)).then_some(()));
    assert_eq!(system.status()["vehicle"], "uav1");
    let far = ["vehicle", "show", "--vehicle", "uav1", "--url"];
    let elsewhere = url.replace("127.0.0.1", "localhost");
    told(&[&far[..], &[&elsewhere]].concat()).expect(5, "is not trusted");
    let (token, wrong_ca) = (path("token"), path("other.pem"));
    write_private(token.as_ref(), link.split_once("#token=").unwrap().1);
    write_private(wrong_ca.as_ref(), &other.cert.pem());
    let with_ca = |ca: &str| told(&[&far[..], &[url, "--token-file", &token, "--ca", ca]].concat());
    with_ca(&wrong_ca).expect(5, "is not trusted");
    with_ca(&certificate).expect(0, "uav1");
}
