//! The audit trail of a real gateway: clients that hang up, a gateway that is killed, strangers, and hands in the files.

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::time::Duration;

use gateway::access::Role;
use nix::sys::signal::Signal;
use serde_json::Value;

use crate::support::files::Files;
use crate::support::http::answer;
use crate::support::people::People;
use crate::support::{System, kittiwake, wait_for};

/// Where the gateway of a system listens.
fn address(system: &System) -> String {
    let link = system.link_for("sam");
    link.trim_start_matches("http://").split('/').next().unwrap_or_default().to_owned()
}

/// A request of sam, without an answer yet.
fn send(address: &str, token: &str, path: &str, key: &str) -> TcpStream {
    let mut stream = wait_for("the gateway", || TcpStream::connect(address).ok());
    let head = format!(
        "POST /api/v1/vehicles/{path} HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {token}\r\nIdempotency-Key: {key}\r\n\
         Connection: close\r\nContent-Length: 0\r\n\r\n"
    );
    stream.write_all(head.as_bytes()).expect("the gateway takes a request");
    stream
}

/// Waits until the gateway has heard every service of the vehicle: an order that it reads before that is refused.
fn wait_until_ready(address: &str) {
    wait_for("the gateway to hear the vehicle's services", || {
        let mut stream = TcpStream::connect(address).ok()?;
        stream.write_all(b"GET /readyz HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n").ok()?;
        (answer(&mut stream).status == 200).then_some(())
    });
}

/// The records in the folder's files, as far as their lines are whole.
fn records(folder: &Path) -> Vec<Value> {
    let mut files = files(folder);
    files.sort();
    let text: String = files.iter().map(|it| std::fs::read_to_string(it).unwrap_or_default()).collect();
    text.lines().filter_map(|it| serde_json::from_str(it).ok()).collect()
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("the folder is there").flatten().map(|it| it.path());
    entries.filter(|it| it.file_name().is_some_and(|it| it.to_string_lossy().starts_with("audit-"))).collect()
}

/// What the records under a key say.
fn told(folder: &Path, key: &str) -> Vec<String> {
    let text = |it: &Value, name: &str| it[name].as_str().unwrap_or_default().to_owned();
    let of_key = |it: &Value| it["requestId"] == key;
    let words = |it: Value| format!("{} {} {}", text(&it, "stage"), text(&it, "vehicle"), text(&it, "what"));
    records(folder).into_iter().filter(of_key).map(words).collect()
}

/// `kittiwake audit verify` ends with this code and says this.
#[track_caller]
fn check(path: &Path, code: i32, part: &str) {
    let output = kittiwake(&["audit", "verify", path.to_str().expect("a plain name")]);
    let said = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(code), "{said}");
    assert!(said.contains(part), "expected `{part}`: {said}");
}

#[test]
fn every_order_that_is_obeyed_is_on_record_and_the_record_survives_kills_strangers_and_shows_changes() {
    let people = People::new(&[("sam", Role::Safety)]);
    let folder = Path::new(people.folder());
    let system = System::up(&["--access", people.folder(), "--speed", "1"], &[]);
    let address = address(&system);
    system.wait_for("step 1 of 5");
    wait_until_ready(&address);
    // Each client hangs up right after sending, until an order of one of them was read before that was noticed.
    let mut keys = Vec::new();
    let whole = ["AUDIT_STAGE_ASKED uav1 pause", "AUDIT_STAGE_ENDED uav1 pause"];
    wait_for("an order of somebody who has hung up", || {
        keys.push(format!("hung-up-{}", keys.len()));
        drop(send(&address, "sam", "uav%31/pause", keys.last()?));
        keys.iter().any(|key| told(folder, key) == whole).then_some(())
    });
    system.wait_for("`operator_pause`");
    for key in &keys {
        // A request given up with its client is not an order: an asked one has an end.
        wait_for("both records or none", || Some(told(folder, key)).filter(|it| it.is_empty() || it == &whole));
    }
    check(folder, 0, "intact: records 1 to ");

    // Strangers with long requests: neither the files of the orders grow, nor those of the refusals without a limit.
    for n in 0..30 {
        let path = format!("uav1/contingencies/{}/acknowledge", "x".repeat(10_000));
        assert_eq!(answer(&mut send(&address, "stranger", &path, &n.to_string())).status, 401);
    }
    let of_strangers = |it: &Value| it.to_string().contains("acknowledge");
    assert!(!records(folder).iter().any(of_strangers), "{:?}", records(folder));
    // They are written a moment later.
    let refused = wait_for("30 refusals in a file of their own", || {
        let text = std::fs::read_to_string(folder.join("refusals.jsonl")).ok()?;
        (30 <= text.lines().count()).then_some(text)
    });
    assert!(refused.lines().all(|it| it.len() < 1000), "{refused}");

    // Killed in the middle of a line.
    system.process("gateway").signal(Signal::SIGKILL);
    system.wait_for("gateway ended by signal 9");
    let newest = files(folder).into_iter().max().expect("a file");
    // The launcher starts it again at once; what it has written until then is whole, and so is what follows a cut.
    wait_for("an order after the restart", || {
        let answer = answer(&mut send(&address, "sam", "uav1/return", "after"));
        (answer.status == 200 || answer.status == 409).then_some(())
    });
    assert_eq!(told(folder, "after").first().map(String::as_str), Some("AUDIT_STAGE_ASKED uav1 return"));
    check(folder, 0, "intact: records 1 to ");
    drop(system);

    let text = std::fs::read_to_string(&newest).expect("it can be read");
    std::fs::write(&newest, &text[..text.len() - 10]).unwrap();
    check(folder, 1, "the last line is cut off");
    let (but_last, _) = text.trim_end().rsplit_once('\n').expect("there are several lines");
    std::fs::write(&newest, format!("{but_last}\n")).unwrap();
    check(folder, 1, "not intact, 1 record is missing");
    std::fs::write(&newest, text.replacen("pause", "abort", 1)).unwrap();
    let changed = text.lines().position(|it| it.contains("pause")).expect("it was ordered") + 1;
    check(folder, 1, &format!("{}:{changed}: it does not have the hash that it carries", newest.display()));
    check(&folder.join("nowhere"), 2, "No such file or directory");
}

#[test]
fn an_order_that_waited_while_the_gateway_stood_still_is_refused_and_obeyed_when_it_is_asked_again() {
    let people = People::new(&[("sam", Role::Safety)]);
    let folder = Path::new(people.folder());
    // Otherwise the launcher would start it again.
    let files = Files::shipped().with("kittiwake.toml", "hung_after_s = 3.0", "hung_after_s = 60.0");
    let config = files.config().to_string_lossy().into_owned();
    let system = System::up(&["--config", &config, "--access", people.folder(), "--speed", "1"], &[]);
    let address = address(&system);
    system.wait_for("step 1 of 5");
    wait_until_ready(&address);
    let gateway = system.process("gateway");
    gateway.signal(Signal::SIGSTOP);
    // On a busy machine its threads run on for some milliseconds, and what is read then did not wait.
    wait_for("every thread of the gateway to stand still", || {
        let threads = std::fs::read_dir(format!("/proc/{}/task", gateway.id())).ok()?.flatten();
        let mut stats = threads.map(|it| std::fs::read_to_string(it.path().join("stat")).unwrap_or_default());
        stats.all(|it| it.contains(") T ")).then_some(())
    });
    let mut waiting = send(&address, "sam", "uav1/pause", "waited");
    waiting.set_read_timeout(Some(Duration::from_secs(3))).expect("a limit can be set");
    let silence = waiting.read(&mut [0]).expect_err("nobody answers for three seconds");
    assert_eq!(silence.kind(), ErrorKind::WouldBlock, "{silence}");
    gateway.signal(Signal::SIGCONT);
    waiting.set_read_timeout(None).expect("a limit can be removed");
    let refused = answer(&mut waiting);
    let said = String::from_utf8_lossy(&refused.body).into_owned();
    assert!(refused.status == 503 && said.contains("the gateway stood still for "), "{} {said}", refused.status);
    let ended = wait_for("the record of the refusal", || {
        records(folder).into_iter().find(|it| it["requestId"] == "waited" && it["stage"] == "AUDIT_STAGE_ENDED")
    });
    assert_eq!(ended["status"], 503, "{ended}");
    wait_for("the order to be obeyed", || {
        (answer(&mut send(&address, "sam", "uav1/pause", "waited")).status == 200).then_some(())
    });
    system.wait_for("`operator_pause`");
}
