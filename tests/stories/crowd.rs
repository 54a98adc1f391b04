//! A hundred clients, some of them hostile, follow a mission; with `KITTIWAKE_SWEEP=all` a thousand.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::os::fd::AsFd;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use bus::{Link, Scope, Tap, Tapped};
use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1::DecisionRecord;
use nix::sys::socket::{setsockopt, sockopt};
use prost::Message as _;
use zenoh::Wait;

use crate::stories::bad_messages::stranger;
use crate::support::crowd::{Crowd, raise_socket_limit};
use crate::support::files::Files;
use crate::support::http::{Http, answer};
use crate::support::{System, wait_for};

/// A tenth of the crowd for a commit: the thousand take the machine for minutes, with each message a thousand times.
const FEW: usize = 100;
const MANY: usize = 1000;
const EVENTS: &str = "/api/v1/vehicles/uav1/events";
/// Number and size of decisions that are more than the journal keeps, and more than a stream takes out at a
/// time, for a client that does not read meanwhile.
const SHORT: (usize, usize) = (70, 1);
/// Number and size, in bytes, of decisions that are more than is on its way to a client before the gateway waits for
/// that client.
const LONG: (usize, usize) = (150, 20_000);
const HISTORY: &str = "history_records = 50";
/// Additional megabytes that the gateway may need for all clients: several times the measured figure.
const MAX_MB: u64 = 256;

/// With room for a thousand requests and streams of one token at once, a short journal, and patience with who does not read.
fn files() -> Files {
    let changes = [
        ("requests_at_once = 100.0", "requests_at_once = 5000.0"),
        // They all come before any of them has shown its token.
        ("strangers = 256", "strangers = 2000"),
        ("strangers_per_address = 64", "strangers_per_address = 2000"),
        ("connections_per_token = 128", "connections_per_token = 2000"),
        ("streams_per_token = 96", "streams_per_token = 2000"),
        ("write_timeout_s = 30.0", "write_timeout_s = 3600.0"),
        // On a busy machine a head waits as long for its turn as all the others take.
        ("head_timeout_s = 10.0", "head_timeout_s = 3600.0"),
        ("history_records = 4096", HISTORY),
        // Nor does it have to read a body within four seconds.
        ("request_timeout_s = 5.0", "request_timeout_s = 30.0"),
        // Nor is a gateway that a busy machine lets wait one that hangs: who is served would be cut off.
        ("hung_after_s = 3.0", "hung_after_s = 60.0"),
        // This process reads all the streams: on a busy machine two thousand states a second would take all of its time.
        ("status_rate_hz = 2.0", "status_rate_hz = 0.5"),
    ];
    changes.iter().fold(Files::shipped(), |files, (from, to)| files.with("kittiwake.toml", from, to))
}

/// Listens to the mission manager's status and to every heartbeat.
fn listen(system: &System) -> (Tap, Receiver<Tapped>) {
    let scope = Scope::Vehicle("uav1".into());
    let link = Link { connect: vec![system.locator()], scope, open_timeout: Duration::from_secs(10) };
    let (hear, heard) = channel();
    let tap = Tap::open(&link, &[Topic::McmStatus, Topic::Heartbeat], move |it| {
        let _ = hear.send(it);
    });
    (tap.expect("the router is there"), heard)
}

/// A client that asks for events, has room for hardly any of them, and does not read.
fn idle_client(http: &Http) -> TcpStream {
    let mut stream = http.connect();
    setsockopt(&stream.as_fd(), sockopt::RcvBuf, &4096).expect("a small buffer can be set");
    stream.write_all(http.head("GET", EVENTS, "").as_bytes()).expect("the gateway takes a request");
    stream
}

/// Publishes decisions of a size, each once somebody in the crowd has received the one before.
fn publish(system: &System, crowd: &Crowd, (count, size): (usize, usize)) {
    let (stranger, text) = (stranger(&system.locator()), "x".repeat(size));
    for sequence in 0..count as u64 {
        let before = crowd.decisions();
        let decision = DecisionRecord { topic: "load".into(), text: text.clone(), sequence, ..Default::default() };
        stranger.put("kw/uav1/mcm/decision", decision.encode_to_vec()).wait().unwrap();
        wait_for("the decision", || (before < crowd.decisions()).then_some(()));
    }
}

/// Resident memory of the gateway, in megabytes.
fn memory_mb(system: &System) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{}/status", system.process("gateway").id())).unwrap();
    let line = status.lines().find_map(|it| it.strip_prefix("VmRSS:")).expect("a process has memory");
    line.trim().trim_end_matches(" kB").parse::<u64>().expect("a number") / 1024
}

/// Every hostile request is refused with its reason.
fn send_hostile_requests(http: &Http) {
    let pause = "/api/v1/vehicles/uav1/pause";
    let with = |more: &str, body: &str| {
        // On a busy machine the gateway may rightly give up waiting for a body: it is sent again then.
        wait_for("an answer to a whole request", || {
            let status = http.send(&format!("{}{body}", http.head("POST", pause, more))).status;
            (status != 408).then_some(status)
        })
    };
    assert_eq!(with("Idempotency-Key: a\r\nContent-Length: 99999999999\r\n", ""), 413);
    let chunks = format!("{:x}\r\n{}\r\n", 200_000, "x".repeat(200_000));
    assert_eq!(with("Idempotency-Key: b\r\nTransfer-Encoding: chunked\r\n", &format!("{chunks}0\r\n\r\n")), 413);
    assert_eq!(with("Idempotency-Key: c\r\nContent-Length: 9\r\n", "{{{{{{{{{"), 400);
    let deep = "[".repeat(60_000);
    assert_eq!(with(&format!("Idempotency-Key: d\r\nContent-Length: {}\r\n", deep.len()), &deep), 400);
    assert_eq!(http.send("\u{1}\u{2} nonsense\r\n\r\n").status, 400);
}

#[test]
fn many_streams_and_one_that_never_reads_do_not_delay_the_mission() {
    let clients = if std::env::var("KITTIWAKE_SWEEP").is_ok_and(|it| it == "all") { MANY } else { FEW };
    let most = raise_socket_limit();
    assert!(clients as u64 + 200 < most, "this needs {clients} sockets, the system allows {most}");
    let files = files();
    let system = System::up(&["--config", files.config().to_str().unwrap(), "--speed", "2"], &[]);
    system.wait_for(" is up: ");
    let (tap, heard) = listen(&system);
    let http = system.http();
    wait_for("the gateway to know the vehicle", || (http.get("/api/v1/vehicles/uav1").status == 200).then_some(()));
    let before = memory_mb(&system);
    // Until the idle client's connection is full, and the journal has moved past what it has received.
    let mut idle = idle_client(&http);
    let witness = Crowd::gather(1, http.address, &http.head("GET", EVENTS, ""));
    wait_for("somebody to be served", || (witness.served() == 1).then_some(()));
    publish(&system, &witness, LONG);
    publish(&system, &witness, SHORT);
    drop(witness);
    // A head that never ends, and a body that does not arrive.
    let (mut half, mut trickle) = (http.connect(), http.connect());
    half.write_all(b"GET / HTTP/1.1\r\nHost: x\r\n").unwrap();
    let more = "Idempotency-Key: e\r\nContent-Length: 100\r\n";
    trickle.write_all(format!("{}{{", http.head("POST", "/api/v1/vehicles/uav1/pause", more)).as_bytes()).unwrap();

    let crowd = Crowd::gather(clients, http.address, &http.head("GET", EVENTS, ""));
    wait_for("everybody to be served", || {
        assert_eq!(crowd.gone(), None, "disconnected, {} are served", crowd.served());
        (crowd.served() == clients).then_some(())
    });
    send_hostile_requests(&http);
    let had = (crowd.statuses(), crowd.decisions());
    publish(&system, &crowd, SHORT);
    wait_for("everybody to go on", || {
        (had.0 + 2 * clients < crowd.statuses() && had.1 + clients < crowd.decisions()).then_some(())
    });
    system.wait_for("mission over: success");
    assert_eq!(answer(&mut trickle).status, 408);
    assert_eq!(crowd.gone(), None, "nobody was disconnected");
    let after = memory_mb(&system);
    eprintln!("gateway: {before} MB before, {after} MB with {clients} clients");
    assert!(after < before + MAX_MB, "the gateway took {before} MB before and {after} MB after");
    expect_resync(&mut idle);

    drop(tap);
    let heard: Vec<Tapped> = heard.into_iter().collect();
    // Not of introspections: they may be dropped while this process waits for its turn, by their quality of service.
    expect_no_gap(&heard, Topic::McmStatus);
    expect_ticks(&heard);
}

/// The idle client reads again: the events it has missed are no longer stored, and it gets a `resync`.
#[track_caller]
fn expect_resync(stream: &mut TcpStream) {
    let (mut seen, mut piece) = (Vec::new(), vec![0; 64 * 1024]);
    while !String::from_utf8_lossy(&seen).contains("\nevent: resync") {
        let read = stream.read(&mut piece).expect("the stream goes on");
        assert!(0 < read && seen.len() < 64 << 20, "no resync in {} bytes", seen.len());
        seen.extend_from_slice(&piece[..read]);
    }
}

#[track_caller]
fn expect_no_gap(heard: &[Tapped], topic: Topic) {
    let sequence: Vec<u64> = heard.iter().filter(|it| it.message.topic() == topic).map(|it| it.sequence).collect();
    assert!(50 < sequence.len(), "{} of {topic:?}", sequence.len());
    let gaps: Vec<_> = sequence.windows(2).filter(|it| it[1] != it[0] + 1).collect();
    assert!(gaps.is_empty(), "gaps in {} messages of {topic:?}: {gaps:?}", sequence.len());
}

/// The mission manager has continued to tick, and no process on board has lost a message.
#[track_caller]
fn expect_ticks(heard: &[Tapped]) {
    let mut last = 0;
    let mut processes = BTreeMap::new();
    for it in heard {
        match &it.message {
            Message::McmStatus(it) => {
                assert!(last <= it.ticks, "{last} ticks, then {}", it.ticks);
                last = it.ticks;
            }
            Message::Heartbeat(it) => {
                let first: &mut (String, u64) = processes.entry(it.service.clone()).or_insert((it.instance.clone(), 0));
                assert_eq!(first.0, it.instance, "{} was started again", it.service);
                first.1 = it.dropped;
            }
            _ => {}
        }
    }
    assert!(100 < last, "{last} ticks");
    for service in ["mcm", "monitor", "planner", "skill-manager", "vehicle-sim"] {
        assert_eq!(processes.get(service).map(|it| it.1), Some(0), "{service}: {processes:?}");
    }
}
