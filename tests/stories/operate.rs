//! `kittiwake vehicle`, `mission`, `permission` and `site` against a system that flies.

use std::io::Write as _;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use gateway::access::{Role, entry};
use nix::sys::signal::Signal;
use serde_json::Value;

use crate::support::files::{Files, write_private};
use crate::support::http::{Http, answer};
use crate::support::{KITTIWAKE, System, kittiwake, shipped, wait_for};

/// A system with its own tokens, for four people.
struct Crew {
    system: System,
    url: String,
    folder: tempfile::TempDir,
}

/// The outcome of a command.
struct Said {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

impl Said {
    fn of(output: Output) -> Said {
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        Said { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
    }

    /// Fails unless the command ended with `code` and printed `part` on either output.
    #[track_caller]
    fn expect(self, code: i32, part: &str) -> Said {
        let printed = format!("{}{}", self.stdout, self.stderr);
        let fits = self.code == Some(code) && printed.contains(part);
        assert!(fits, "expected {code} and `{part}`: {:?} {printed}", self.code);
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

    /// Has somebody run `kittiwake line`.
    fn runs(&self, who: &str, line: &str) -> Said {
        self.runs_at(&self.url, who, line)
    }

    fn runs_at(&self, url: &str, who: &str, line: &str) -> Said {
        let mut command = Command::new(KITTIWAKE);
        command.args(line.split(' ')).env("KITTIWAKE_URL", url).env("KITTIWAKE_TOKEN", format!("{who}-token"));
        Said::of(command.stdin(Stdio::null()).output().unwrap())
    }

    fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    /// Waits until the vehicle's document, as eve reads it, satisfies `is`.
    #[track_caller]
    fn wait_until(&self, what: &str, is: impl Fn(&Value) -> bool) {
        wait_for(what, || is(&self.runs("eve", "vehicle show --json").json()).then_some(()));
    }
}

const BACK: &str =
    "name = \"back\"\n[[objective]]\nname = \"home\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n";

#[test]
fn a_crew_flies_by_the_command_line() {
    // The tower's silence must be longer than a dozen commands take on a crowded machine.
    let files = Files::shipped().with("kittiwake.toml", "permission_answer_s = 10.0", "permission_answer_s = 100.0");
    let config = files.config().to_string_lossy().into_owned();
    let crew = Crew::start(&["--config", &config, "--speed", "5", "--permissions", "silent", "--exit-when-done"]);
    // The gateway answers before it has seen a vehicle.
    wait_for("the vehicle", || {
        crew.runs("eve", "vehicle list").expect(0, "VEHICLE").stdout.contains("uav1").then_some(())
    });
    crew.wait_until("the flight", |it| it["aircraft"]["status"]["actualMode"] == "FLIGHT_MODE_OFFBOARD");

    // Who knows the gateway only injects over it.
    let elsewhere = crew.url.replace("127.0.0.1", "localhost");
    crew.runs_at(&elsewhere, "eve", "inject fault wind 1 0").expect(3, "it needs the role");
    crew.runs_at(&elsewhere, "anna", "inject fault wind 1 0").expect(0, "wind");
    crew.runs_at(&elsewhere, "anna", "inject flag obstcle").expect(2, "did you mean `obstacle`?");

    // The tower decides about a request.
    crew.wait_until("a question to the tower", |it| it["permissions"][0]["state"] == "PERMISSION_STATE_REQUESTED");
    crew.runs("tom", "permission pending").expect(0, "requested");
    crew.runs("eve", "permission grant A").expect(3, "it needs the role tower");
    let granted = crew.runs("tom", "permission grant A --valid-for-s 600 --reason clear --json").expect(0, "");
    assert_eq!(granted.json()["text"], "area A: granted");
    crew.wait_until("the grant", |it| it["permissions"][0]["state"] == "PERMISSION_STATE_GRANTED");
    let list = crew.runs("tom", "permission list --json").expect(0, "").json();
    assert_eq!((&list["vehicle"], &list["permissions"][0]["area"]), (&"uav1".into(), &"A".into()));

    // Command is taken when nobody has it, and otherwise only from a holder who offers it.
    let paused = crew.runs("anna", "vehicle pause --json").expect(0, "took command of uav1");
    assert_eq!((&paused.json()["verb"], &paused.json()["text"]), (&"pause".into(), &"holds until resumed".into()));
    crew.runs("anna", "vehicle pause").expect(3, "`operator_pause` is under way already");
    let refused = crew.runs("ben", "vehicle resume --json").expect(3, "anna has command of uav1");
    assert_eq!(refused.json()["command"]["holder"], "anna");
    crew.runs("anna", "vehicle hand-over ben").expect(0, "anna, offered to ben");
    crew.runs("ben", "vehicle resume").expect(3, "offered to ben, who takes it with --hand-over");
    crew.runs("ben", "vehicle resume --hand-over").expect(0, "goes on with a new plan");
    crew.runs("eve", "vehicle show").expect(0, "command      ben");

    wait_for("the plan", || crew.runs("eve", "mission plan").stdout.contains("land").then_some(()));

    // While the vehicle holds, missions are tried out, one with a mistake is refused, and one is uploaded.
    crew.runs("ben", "vehicle pause").expect(0, "holds until resumed");
    let reference = shipped().join("missions/reference.toml");
    let validated = crew.runs("ben", &format!("mission validate {} --json", reference.display())).expect(0, "");
    assert_eq!(validated.json()["accepted"], true);
    assert!(validated.json()["forecast"][0]["lengthM"].as_f64().is_some_and(|it| 0.0 < it), "{}", validated.stdout);
    let wrong = crew.file("wrong.toml", &BACK.replace("east_m = 0", "east_m = \"far\""));
    crew.runs("ben", &format!("mission upload {}", wrong.display())).expect(2, "wrong.toml:5:10: ");
    let back = crew.file("back.toml", BACK);
    crew.runs("ben", &format!("mission upload {}", back.display())).expect(0, "`back` takes the place of `reference`");
    let mission = crew.runs("eve", "mission show --json").expect(0, "").json();
    assert_eq!((&mission["mission"], &mission["objectives"][0]["name"]), (&"back".into(), &"home".into()));
    crew.runs("ben", "mission insert 0 look 20 30 15").expect(0, "objective `look` inserted at 0");
    crew.runs("ben", "mission skip look").expect(0, "objective `look` skipped");
    crew.runs("ben", "mission remove nobody").expect(3, "there is no objective `nobody`");
    crew.runs("ben", "mission approve").expect(3, "no plan waits for approval");

    // Events of the past are replayed.
    let events = crew.runs("eve", "vehicle events --count 50 --json").expect(0, "");
    let replayed: Vec<Value> = events.stdout.lines().map(|it| serde_json::from_str(it).unwrap()).collect();
    assert_eq!(replayed.len(), 50);
    assert!(replayed.iter().any(|it| it["event"] == "audit" && it["data"]["what"] == "pause"), "{}", events.stdout);

    // The uploaded mission survives a restart of the planner.
    crew.system.process("planner").signal(Signal::SIGKILL);
    crew.system.wait_for("planner ended by signal 9");
    wait_for("the planner", || {
        let shown = crew.runs("eve", "mission show --json");
        (shown.code == Some(0)).then(|| assert_eq!(shown.json()["mission"], "back", "{}", shown.stdout))
    });
    crew.runs("ben", "vehicle resume").expect(0, "goes on with a new plan");
    let Crew { system, .. } = crew;
    system.end().expect(3, &["FAILURE", "SUCCESS"]);
}

#[test]
fn the_party_at_a_site_reports_by_the_command_line_and_the_vehicle_waits_for_it() {
    // As above: the vehicle waits for longer than the commands take.
    let files = Files::shipped().with("kittiwake.toml", "permission_answer_s = 10.0", "permission_answer_s = 100.0");
    let config = files.config().to_string_lossy().into_owned();
    let mission = shipped().join("missions/turbine.toml").to_string_lossy().into_owned();
    let crew = Crew::start(&["--config", &config, "--mission", &mission, "--speed", "5", "--exit-when-done"]);
    wait_for("the report", || (crew.runs("tom", "site report wt12 --deck occupied").code == Some(0)).then_some(()));
    crew.runs("anna", "site report wt12 --deck clear").expect(3, "it needs the role tower");
    crew.runs("tom", "site report wt21 --deck clear").expect(3, "the control tower knows no site `wt21`");
    crew.wait_until("the request", |it| it["permissions"][0]["reason"] == "not ready: the deck is occupied");
    crew.runs("eve", "permission pending").expect(0, "not ready: the deck is occupied");
    let reported = crew.runs("tom", "site report wt12 --rotor stopped --deck clear --wind 6.5 --json").expect(0, "");
    assert_eq!(reported.json()["text"], "site wt12: the report is taken, for every vehicle");
    crew.wait_until("the grant", |it| it["permissions"][0]["state"] == "PERMISSION_STATE_GRANTED");
    let Crew { system, .. } = crew;
    system.end().expect(0, &["SUCCESS", "SUCCESS"]);
}

#[test]
fn an_order_and_the_end_of_the_mission_survive_a_restart_of_the_mission_manager() {
    // The rest of the flight must be longer than the commands take on a crowded machine.
    let crew = Crew::start(&["--speed", "3"]);
    let kill = |nth| {
        crew.system.process("mcm").signal(Signal::SIGKILL);
        crew.system.wait_for_nth("mcm ended by signal 9", nth);
    };
    crew.system.wait_for("step 4 of 5");
    crew.wait_until("the flight", |it| it["aircraft"]["status"]["actualMode"] == "FLIGHT_MODE_OFFBOARD");
    crew.runs("anna", "vehicle abort").expect(0, "lands here and ends the mission");
    kill(1);
    let over = "mission: over: `operator_abort`: ordered by anna";
    crew.system.wait_for_nth(over, 1);
    kill(2);
    crew.system.wait_for_nth(over, 2);
    crew.wait_until("the end", |it| {
        it["aircraft"]["status"]["armed"] != true && it["mission"]["phase"] == "MISSION_PHASE_OVER"
    });
    crew.runs("anna", "vehicle start").expect(3, "the mission is over: `operator_abort`: ordered by anna");
}

#[test]
fn a_gateway_that_is_not_there_is_unreachable_and_invalid_arguments_are_refused() {
    let run = |line: &str| Said::of(kittiwake(&line.split(' ').collect::<Vec<_>>()));
    // A port without a listener: it was free a moment ago.
    let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let refused = run(&format!("vehicle pause --json --vehicle uav1 --url http://{free}")).expect(5, "does not answer");
    assert!(refused.json()["detail"].as_str().unwrap().contains("does not answer"));
    run("vehicle pause --url nonsense").expect(2, "expected a URL");
    run("mission validate /nowhere/m.toml").expect(2, "/nowhere/m.toml: cannot be read");
    run(&format!("vehicle pause --url http://{free} --token-file /nowhere/token"))
        .expect(2, "/nowhere/token: cannot be read");
    run(&format!("vehicle show --url https://{free} --ca /nowhere/ca.pem")).expect(2, "ca.pem: cannot be read");
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
    let run = |args: &[&str]| Said::of(kittiwake(args));

    // Refused before any process starts.
    run(&["up", "--tls-certificate", &certificate, "--tls-key", &wrong_key])
        .expect(2, "is not the key of the certificate");
    run(&["up", "--http", "0.0.0.0:0"]).expect(2, "would listen on 0.0.0.0:0 without TLS");
    run(&["run", "gateway", "--http", "0.0.0.0:0"]).expect(2, "would listen on 0.0.0.0:0 without TLS");

    let system = System::up(&["--speed", "1", "--tls-certificate", &certificate, "--tls-key", &key], &[]);
    let link = system.link();
    let (url, _) = link.split_once("/#token=").unwrap();
    assert!(url.starts_with("https://127.0.0.1:"), "{link}");
    let pid = system.pid().to_string();
    wait_for("the run file", || (run(&["vehicle", "list", "--pid", &pid]).code == Some(0)).then_some(()));
    assert_eq!(system.status()["vehicle"], "uav1");
    let far = ["vehicle", "show", "--vehicle", "uav1", "--url"];
    let elsewhere = url.replace("127.0.0.1", "localhost");
    run(&[&far[..], &[&elsewhere]].concat()).expect(5, "is not trusted");
    let (token, wrong_ca) = (path("token"), path("other.pem"));
    write_private(token.as_ref(), link.split_once("#token=").unwrap().1);
    write_private(wrong_ca.as_ref(), &other.cert.pem());
    let with_ca = |ca: &str| run(&[&far[..], &[url, "--token-file", &token, "--ca", ca]].concat());
    with_ca(&wrong_ca).expect(5, "is not trusted");
    with_ca(&certificate).expect(0, "uav1");
}

#[test]
fn a_token_that_is_taken_away_in_flight_is_refused_and_its_stream_ends() {
    let crew = Crew::start(&["--speed", "1"]);
    wait_for("the vehicle", || {
        crew.runs("eve", "vehicle list").expect(0, "VEHICLE").stdout.contains("uav1").then_some(())
    });
    let address = crew.url["http://".len()..].parse().unwrap();
    let eve = Http { address, token: "eve-token".to_owned() };
    let mut stream = eve.connect();
    stream.write_all(eve.head("GET", "/api/v1/vehicles/uav1/events", "").as_bytes()).unwrap();
    let tokens = crew.folder.path().join("tokens.toml");
    let left = entry("anna", &[Role::Operator], "anna-token");
    // Nobody's token is taken away by a slip.
    write_private(&tokens, &left.replace("name", "nmae"));
    wait_for("the mistake", || {
        let health = eve.json("/healthz");
        let problem =
            health["problems"][0].as_str().is_some_and(|it| it.contains("tokens.toml:1:1: missing field `name`"));
        (health["status"] == "degraded" && problem).then_some(())
    });
    crew.runs("eve", "vehicle list").expect(0, "uav1");
    write_private(&tokens, &left);
    wait_for("eve to be refused", || (eve.get("/api/v1/vehicles").status == 401).then_some(()));
    assert!(answer(&mut stream).body.ends_with(b"0\r\n\r\n"), "the stream has an end");
    crew.runs("anna", "vehicle list").expect(0, "uav1");
    assert_eq!(eve.json("/healthz")["problems"], serde_json::json!([]));
}
