//! Missions are recorded in files that any reader of MCAP reads.

use std::collections::BTreeSet;

use kittiwake_proto::topics::{Message, Topic};
use nix::sys::signal::Signal;
use serde_json::Value;

use crate::support::browser::watch;
use crate::support::files::Files;
use crate::support::http::Http;
use crate::support::{System, wait_for};

const LIST: &str = "/api/v1/recordings";

/// The recordings, newest first, once they are in these states.
#[track_caller]
fn recorded(http: &Http, states: &[&str]) -> Vec<Value> {
    wait_for(&format!("recordings that are {states:?}"), || {
        let list = http.json(LIST)["recordings"].as_array().cloned().unwrap_or_default();
        (list.iter().map(|it| it["state"].as_str().unwrap_or_default()).collect::<Vec<_>>() == states).then_some(list)
    })
}

/// The messages of the bus in a file, as any reader of MCAP finds them. The others are pictures for Foxglove, in JSON.
fn messages(file: &[u8]) -> Vec<Message> {
    let decode = |it: mcap::McapResult<mcap::Message>| {
        let it = it.expect("a whole file");
        if it.channel.message_encoding == "json" {
            return None;
        }
        let topic = Topic::ALL.iter().find(|topic| topic.key() == it.channel.topic).expect("a known topic");
        Some(Message::decode(*topic, &it.data).expect("a message of its topic"))
    };
    mcap::MessageStream::new(file).expect("an MCAP file").filter_map(decode).collect()
}

fn decisions(messages: &[Message]) -> BTreeSet<String> {
    let text = |it: &Message| if let Message::DecisionRecord(it) = it { Some(it.text.clone()) } else { None };
    messages.iter().filter_map(text).collect()
}

#[test]
fn a_mission_is_recorded_listed_downloaded_and_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path().join("recordings");
    // A recording is what the gateway heard: the mission begins once it hears the vehicle, however long it takes to start.
    let files = Files::begun_by_operator();
    let config = files.config();
    let args = ["--config", config.to_str().unwrap(), "--speed", "8", "--recordings", folder.to_str().unwrap()];
    let system = System::up(&args, &[]);
    system.wait_for(&format!("recordings: {}", folder.display()));
    let http = system.http();
    recorded(&http, &["recording"]);
    // The recorder hears a vehicle before the gateway knows what it waits for.
    wait_for("the manager to wait for the operator", || {
        let answer = http.get("/api/v1/vehicles/uav1");
        let vehicle: Value = serde_json::from_slice(&answer.body).ok()?;
        vehicle["operator"]["startAwaited"].as_bool()?.then_some(())
    });
    system.begin();
    system.wait_for("mission over: success");
    let list = recorded(&http, &["complete"]);
    assert_eq!((&list[0]["vehicle"], &list[0]["outcome"]), (&"uav1".into(), &"MISSION_OUTCOME_SUCCESS".into()));
    assert_eq!(list[0]["mission"], "reference");

    let id = list[0]["id"].as_str().unwrap();
    let answer = http.get(&format!("{LIST}/{id}/file"));
    assert!(answer.head.to_lowercase().contains("content-type: application/vnd.mcap"), "{}", answer.head);
    assert_eq!(std::fs::read(folder.join(format!("{id}.mcap"))).unwrap(), answer.body);

    let messages = messages(&answer.body);
    let summary = http.json(&format!("{LIST}/{id}"));
    let decided: Vec<_> =
        summary["decisions"].as_array().unwrap().iter().map(|it| it["text"].as_str().unwrap()).collect();
    assert!(decided.contains(&"Area A: granted."), "{decided:?}");
    let achieved = summary["objectives"].as_array().unwrap().iter().all(|it| it["state"] == "OBJECTIVE_STATE_SUCCESS");
    assert!(achieved, "{}", summary["objectives"]);
    // Some of the introspections, and every decision that the launcher has printed.
    let introspections = messages.iter().filter(|it| it.topic() == Topic::Introspection).count();
    let statuses = messages.iter().filter(|it| it.topic() == Topic::McmStatus).count();
    assert!(20 < introspections && introspections < 10 * statuses, "{introspections} beside {statuses} statuses");
    system.launcher().signal(Signal::SIGINT);
    let ending = system.end();
    let of_launcher: BTreeSet<String> =
        ["plan", "step", "permission", "mission"].iter().flat_map(|it| ending.story(it)).collect();
    assert!(10 < of_launcher.len());
    assert_eq!(of_launcher.difference(&decisions(&messages)).collect::<Vec<_>>(), Vec::<&String>::new());
}

#[test]
fn a_killed_gateway_leaves_what_it_had_written() {
    let folder = tempfile::tempdir().unwrap();
    let system = System::up(&["--speed", "4", "--recordings", folder.path().to_str().unwrap()], &[]);
    system.wait_for("step 4 of 5");
    let http = system.http();
    let live = recorded(&http, &["recording"]);
    assert_eq!(live[0]["vehicle"], "uav1");
    wait_for("the takeoff to be on the disk", || {
        let summary = http.json(&format!("{LIST}/{}", live[0]["id"].as_str().unwrap()));
        summary["decisions"].as_array().is_some_and(|it| 3 < it.len()).then_some(())
    });
    system.process("gateway").signal(Signal::SIGKILL);
    system.wait_for("gateway ended by signal 9");
    system.wait_for("mission over: success");
    // The launcher starts the gateway again at the same address.
    wait_for("the gateway to be back", || std::net::TcpStream::connect(http.address).ok());
    let list = recorded(&http, &["complete", "damaged"]);
    assert_eq!((&list[1]["id"], &list[0]["outcome"]), (&live[0]["id"], &"MISSION_OUTCOME_SUCCESS".into()));
    let summary = http.json(&format!("{LIST}/{}", live[0]["id"].as_str().unwrap()));
    assert!(3 < summary["decisions"].as_array().unwrap().len(), "{summary}");
    assert_eq!(summary["outcome"], Value::Null);
}

#[test]
fn a_gateway_that_is_killed_in_flight_knows_again_what_was_flown() {
    let folder = tempfile::tempdir().unwrap();
    let system = System::up(&["--speed", "2", "--recordings", folder.path().to_str().unwrap()], &[]);
    system.wait_for("step 4 of 5");
    let http = system.http();
    let live = recorded(&http, &["recording"]);
    wait_for("the takeoff to be on the disk", || {
        let summary = http.json(&format!("{LIST}/{}", live[0]["id"].as_str().unwrap()));
        summary["decisions"].as_array().is_some_and(|it| 3 < it.len()).then_some(())
    });
    let before = http.json("/api/v1/vehicles/uav1")["missionTimeS"].as_f64().expect("the time is known");
    system.process("gateway").signal(Signal::SIGKILL);
    system.wait_for("gateway ended by signal 9");
    wait_for("the gateway to be back", || std::net::TcpStream::connect(http.address).ok());
    let after = wait_for("the vehicle's time to be known again", || {
        let answer = http.get("/api/v1/vehicles/uav1");
        serde_json::from_slice::<Value>(&answer.body).ok()?["missionTimeS"].as_f64()
    });
    assert!(before <= after, "{after} s after {before} s");
    wait_for("the plan before the restart", || {
        let decisions = http.json("/api/v1/vehicles/uav1/decisions");
        let is_plan = |it: &Value| it["record"]["text"].as_str().is_some_and(|it| it.contains("takeoff by 10 m"));
        decisions["decisions"].as_array()?.iter().any(is_plan).then_some(())
    });
    wait_for("the track from before the restart", || {
        let track = http.json("/api/v1/vehicles/uav1/track");
        track["points"][0]["missionTimeS"].as_f64().filter(|first| *first < before)
    });
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored the_page_lists"]
fn the_page_lists_a_mission_and_downloads_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["--speed", "5", "--recordings", folder.path().to_str().unwrap()];
    let (system, browser) = watch(&args);
    browser.run("document.querySelector('#recordings').open = true", vec![]);
    browser.wait_for("#recordings [data-part=outcome]", "recording");
    browser.wait_for("#recordings [data-part=outcome]", "success");
    browser.wait_for("#recordings [data-part=what]", "uav1 reference");
    // A download changes nothing in the page: compare what the page gives to the browser.
    browser.run(
        "const make = URL.createObjectURL; URL.createObjectURL = (it) => { window.taken = it.size; return make(it); }",
        vec![],
    );
    browser.click("#recordings [data-part=download]");
    let list = recorded(&system.http(), &["complete"]);
    let bytes: u64 = list[0]["bytes"].as_str().and_then(|it| it.parse().ok()).expect("a size");
    wait_for("the download", || (browser.run("return window.taken", vec![]) == bytes).then_some(()));
    browser.picture("recordings");
    browser.expect_no_error();
}
