//! The fake PX4 as a Zenoh client of its own, as PX4's module is one.

use std::net::TcpListener;
use std::process::Command;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use domain::time::Time;
use fake_px4::FakePx4;
use px4_bridge::port::Arrival;
use serde::Deserialize;
use zenoh::{Session, Wait};

use crate::px4::support::{KITTIWAKE, SHORT, System, mission};

#[derive(Deserialize)]
struct Sections {
    vehicle_sim: vehicle_sim::config::Config,
}

/// A locator at which nothing listens yet.
fn endpoint() -> String {
    let socket = TcpListener::bind("127.0.0.1:0").expect("a port");
    format!("tcp/{}", socket.local_addr().expect("its address"))
}

/// A client of the router at `endpoint`, tried until it is there.
fn client(endpoint: &str) -> Session {
    let mut config = zenoh::Config::default();
    let settings = [
        ("mode", "\"client\"".to_owned()),
        ("connect/endpoints", format!("[\"{endpoint}\"]")),
        ("connect/timeout_ms", "120000".to_owned()),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("scouting/gossip/enabled", "false".to_owned()),
    ];
    for (key, value) in settings {
        config.insert_json5(key, &value).expect("a setting of zenoh");
    }
    zenoh::open(config).wait().expect("the bridge's router")
}

/// Flies the fake in real time until `stop` is dropped.
fn fly(endpoint: &str, stop: &Receiver<()>) {
    let text = std::fs::read_to_string("config/kittiwake.toml").expect("the shipped configuration");
    let sections: Sections = toml::from_str(&text).expect("the shipped configuration");
    let mut px4 = FakePx4::new(&sections.vehicle_sim, 1);
    let session = client(endpoint);
    let (sender, inputs) = channel();
    let subscriber = session.declare_subscriber("0/fmu/in/**").callback(move |sample| {
        // Fails only at the end.
        let _ = sender.send((sample.key_expr().as_str().to_owned(), sample.payload().to_bytes().into_owned()));
    });
    let _subscriber = subscriber.wait().expect("a subscriber");
    let tokens: Vec<_> = px4.tokens().iter().map(|it| session.liveliness().declare_token(it.clone()).wait()).collect();
    assert!(tokens.iter().all(Result::is_ok));
    let start = Instant::now();
    let now = || Time::after(start.elapsed());
    while matches!(stop.try_recv(), Err(std::sync::mpsc::TryRecvError::Empty)) {
        for arrival in px4.advance(now()) {
            if let Arrival::Sample { key, payload } = arrival {
                session.put(key, payload).wait().expect("it is sent");
            }
        }
        let next = px4.deadline().map_or(Duration::from_millis(10), |it| it - now());
        match inputs.recv_timeout(next.min(Duration::from_millis(10))) {
            Ok((key, payload)) => px4.take_in(&key, &payload, now()),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}

#[test]
fn a_mission_is_flown_over_zenoh_and_nothing_of_the_bus_is_heard_at_px4s_endpoint() {
    let endpoint = endpoint();
    let mission = mission("px4-short", SHORT);
    let mut command = Command::new(KITTIWAKE);
    command.args(["up", "--vehicle", "px4", "--px4-endpoint", &endpoint, "--exit-when-done"]);
    command.arg("--mission").arg(&mission);
    let mut system = System::start(command);
    system.wait_for(&format!("vehicle: px4, awaited at {endpoint}"));
    let (stop, stopped) = channel();
    let flown = endpoint.clone();
    let px4 = std::thread::spawn(move || fly(&flown, &stopped));
    let stranger = client(&endpoint);
    let keys = Arc::new(Mutex::new(Vec::new()));
    let heard = keys.clone();
    let subscriber = stranger.declare_subscriber("**").callback(move |sample| {
        let key = sample.key_expr().as_str().to_owned();
        let mut keys = heard.lock().expect("nobody panics with it");
        if !key.starts_with("0/fmu/") && keys.len() < 100 {
            keys.push(key);
        }
    });
    let _subscriber = subscriber.wait().expect("a subscriber");
    let (code, said) = system.end();
    drop(stop);
    px4.join().expect("the fake flies to the end");
    assert_eq!(code, Some(0), "{said}");
    assert_eq!(keys.lock().expect("nobody panics with it").as_slice(), [] as [String; 0]);
}

#[test]
fn without_a_px4_nothing_takes_off_and_it_is_said_why() {
    let endpoint = endpoint();
    let mut command = Command::new(KITTIWAKE);
    command.args(["up", "--vehicle", "px4", "--px4-endpoint", &endpoint]);
    let mut system = System::start(command);
    system.wait_for(&format!("px4-bridge: PX4 is awaited at {endpoint}"));
    system.wait_for("is up: speed 1");
}

#[test]
fn a_launcher_that_cannot_record_what_may_be_in_the_air_already_says_so_and_starts() {
    let no_folder = tempfile::NamedTempFile::new().expect("a file");
    let mut command = Command::new(KITTIWAKE);
    command.args(["up", "--vehicle", "px4", "--px4-endpoint", &endpoint(), "--record-inputs"]).arg(no_folder.path());
    let mut system = System::start(command);
    for process in ["uav1-mcm-", "uav1-planner-"] {
        assert!(system.wait_for(process).ends_with("nothing more is recorded"));
    }
    system.wait_for("is up: speed 1");
}

#[test]
fn a_real_vehicle_has_its_own_time_and_an_endpoint_is_one() {
    #[track_caller]
    fn check(args: &[&str], said: &str) {
        let output = Command::new(KITTIWAKE).arg("up").args(args).output().expect("it starts");
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(text.contains(said), "{text}");
    }
    check(&["--vehicle", "px4", "--speed", "4"], "found speed 4, expected 1");
    check(&["--vehicle", "px4", "--px4-endpoint", "here"], "expected `tcp/HOST:PORT`");
}

#[test]
fn parameters_the_wrong_way_round_are_warned_of() {
    let path = mission("px4-params", "1\t1\tCOM_OBL_RC_ACT\t0\t6\n1\t1\tCOM_LOW_BAT_ACT\t3\t6\n");
    let output = Command::new(KITTIWAKE)
        .args(["px4-check", "--listen-s", "0", "--params"])
        .arg(&path)
        .output()
        .expect("it starts");
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("WRONG: COM_OBL_RC_ACT = 0; expected 5 (Hold)"), "{text}");
    assert!(text.contains("ok: COM_LOW_BAT_ACT = 3"), "{text}");
    let nowhere =
        Command::new(KITTIWAKE).args(["px4-check", "--listen-s", "1", "--px4-endpoint", &endpoint()]).output();
    let nowhere = nowhere.expect("it starts");
    assert_eq!(nowhere.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&nowhere.stdout).contains("PX4: not heard"));
}
