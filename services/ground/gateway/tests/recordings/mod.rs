//! Recorded missions: what is written into the folder, and what of it is shown over HTTP.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::http::Request;
use domain::time::Now;
use gateway::recording::config::Limits;
use gateway::recording::gauges::Gauges;
use gateway::recording::id::Id;
use gateway::recording::shelf::Shelf;
use gateway::recording::tracks::{Entry, Note, Take};
use gateway::recording::writer::Desk;
use http_body_util::BodyExt as _;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use serde_json::{Value, json};
use tower::ServiceExt as _;

use crate::world::{Answer, RECORDING, World};

const NO_LIMITS: Limits = Limits { files: 99, total: u64::MAX, each: u64::MAX };
const FLUSH: Duration = Duration::from_secs(1);
/// 2026-01-01.
const BEGAN: i64 = 1_767_225_600_000;

fn take(number: u64) -> Arc<Take> {
    let began = Now { utc_ms: BEGAN + 1000 * number as i64, ..Now::default() };
    Arc::new(Take { number, vehicle: "uav1".into(), began, speed: 1.0 })
}

fn entry(take: &Arc<Take>, message: impl Into<Message>) -> Note {
    let message = message.into();
    let (topic, bytes) = (message.topic(), message.encode());
    Note::Entry(take.clone(), Entry { topic, utc_ms: take.began.utc_ms + 500, bytes })
}

fn decision(take: &Arc<Take>, text: &str) -> Note {
    entry(take, v1::DecisionRecord { text: text.into(), ..Default::default() })
}

fn desk(folder: &Path, limits: Limits) -> (Desk, Arc<Gauges>) {
    let gauges = Arc::new(Gauges::default());
    (Desk::new(folder.to_owned(), limits, FLUSH, gauges.clone()), gauges)
}

/// Each recording's name without what they share, its state and its outcome.
#[track_caller]
fn check(folder: &Path, expected: &[(&str, &str, Value)]) {
    let list = Shelf::new(folder.to_owned()).list().unwrap();
    let text = |it: &Value| it.as_str().unwrap_or_default().replace("20260101T0000", "").replace("000Z-uav1", "");
    let shown: Vec<_> = list.iter().map(|it| (text(&it["id"]), text(&it["state"]), it["outcome"].clone())).collect();
    let shown: Vec<_> = shown.iter().map(|it| (it.0.as_str(), it.1.as_str(), it.2.clone())).collect();
    assert_eq!(shown, expected, "{list:#?}");
}

#[test]
fn a_mission_is_live_while_it_is_written_and_complete_with_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let (mut desk, gauges) = desk(folder.path(), NO_LIMITS);
    let (now, first) = (Instant::now(), take(1));
    check(folder.path(), &[]);
    desk.on(entry(&first, v1::PlannerStatus { mission: "reference".into(), ..Default::default() }), now);
    desk.on(decision(&first, "takeoff"), now);
    desk.flush_due(now + FLUSH);
    check(folder.path(), &[("01", "recording", Value::Null)]);
    let report = v1::MissionReport { outcome: v1::MissionOutcome::Success.into(), ..Default::default() };
    desk.on(entry(&first, v1::McmStatus { report: Some(report), ..Default::default() }), now);
    desk.on(Note::End(first.clone()), now);
    check(folder.path(), &[("01", "complete", json!("MISSION_OUTCOME_SUCCESS"))]);
    // The same moment again: another name.
    desk.on(decision(&first, "again"), now);
    check(folder.path(), &[("01-2", "recording", Value::Null), ("01", "complete", json!("MISSION_OUTCOME_SUCCESS"))]);
    assert_eq!((gauges.lost(), gauges.problem()), (0, None));
}

#[test]
fn what_a_killed_gateway_had_written_is_read_and_shown_as_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let (mut desk, _) = desk(folder.path(), NO_LIMITS);
    let (now, first) = (Instant::now(), take(1));
    desk.on(decision(&first, "takeoff"), now);
    desk.flush_due(now + FLUSH);
    desk.on(decision(&first, "lost"), now);
    // As a kill leaves it: what was collected is gone, and the lock with it.
    drop(desk);
    let id: Id = "20260101T000001000Z-uav1".parse().unwrap();
    let summary = Shelf::new(folder.path().to_owned()).summary(&id).unwrap();
    assert_eq!(summary["state"], "damaged");
    assert!(summary["problem"].as_str().unwrap().starts_with("it ends early"), "{summary}");
    assert_eq!((&summary["vehicle"], &summary["decisions"][0]["text"]), (&json!("uav1"), &json!("Takeoff.")));
    assert_eq!(summary["decisions"].as_array().unwrap().len(), 1);
}

#[test]
fn the_folder_keeps_to_its_limits_and_leaves_alone_what_is_not_its_own() {
    let folder = tempfile::tempdir().unwrap();
    for mine in ["flight.mcap", "notes.txt"] {
        std::fs::write(folder.path().join(mine), "mine").unwrap();
    }
    let (mut desk, _) = desk(folder.path(), Limits { files: 2, ..NO_LIMITS });
    for number in 1..=4 {
        desk.on(decision(&take(number), "x"), Instant::now());
        desk.on(Note::End(take(number)), Instant::now());
    }
    check(
        folder.path(),
        &[("flight", "damaged", Value::Null), ("04", "complete", Value::Null), ("03", "complete", Value::Null)],
    );
    assert!(folder.path().join("notes.txt").exists());
}

#[test]
fn a_recording_that_is_too_long_ends_and_takes_no_more_in() {
    let folder = tempfile::tempdir().unwrap();
    let (mut desk, gauges) = desk(folder.path(), Limits { each: 100_000, ..NO_LIMITS });
    let mut now = Instant::now();
    for _ in 0..200 {
        desk.on(decision(&take(1), &"x".repeat(1000)), now);
        now += FLUSH;
        desk.flush_due(now);
    }
    check(folder.path(), &[("01", "complete", Value::Null)]);
    let size = std::fs::metadata(folder.path().join("20260101T000001000Z-uav1.mcap")).unwrap().len();
    assert!(100_000 < size && size < 150_000, "{size}");
    let id: Id = "20260101T000001000Z-uav1".parse().unwrap();
    let kept = Shelf::new(folder.path().to_owned()).summary(&id).unwrap()["messages"].as_u64().unwrap();
    assert!(50 < kept, "{kept}");
    assert_eq!(kept + gauges.lost(), 200);
    // The next mission is recorded again.
    desk.on(Note::End(take(1)), now);
    desk.on(decision(&take(2), "x"), now);
    desk.on(Note::End(take(2)), now);
    check(folder.path(), &[("02", "complete", Value::Null), ("01", "complete", Value::Null)]);
}

#[test]
fn what_cannot_be_written_is_counted_told_and_tried_again() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("recordings");
    std::fs::write(&folder, "a file where the folder should be").unwrap();
    let (mut desk, gauges) = desk(&folder, NO_LIMITS);
    let (mut now, first) = (Instant::now(), take(1));
    (0..3).for_each(|_| desk.on(decision(&first, "lost"), now));
    assert_eq!(gauges.lost(), 3);
    assert!(gauges.problem().is_some());
    std::fs::remove_file(&folder).unwrap();
    now += Duration::from_secs(60);
    desk.on(decision(&first, "kept"), now);
    desk.flush_due(now + FLUSH);
    assert_eq!((gauges.lost(), gauges.problem()), (3, None));
    desk.on(Note::End(first), now);
    check(&folder, &[("01", "complete", Value::Null)]);
}

/// What the gateway answers once its recordings are as `ready` wants them.
async fn once(world: &World, path: &str, ready: impl Fn(&Value) -> bool) -> Value {
    answer_once(world, path, |it| ready(&it.body)).await.body
}

async fn answer_once(world: &World, path: &str, ready: impl Fn(&Answer) -> bool) -> Answer {
    let limit = Instant::now() + Duration::from_secs(20);
    loop {
        let answer = world.get(path, "observer").await;
        if ready(&answer) || limit <= Instant::now() {
            return answer;
        }
        tokio::task::yield_now().await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_mission_is_listed_told_and_downloaded() {
    let world = World::new();
    world.say(v1::PlannerStatus { mission: "reference".into(), ..Default::default() });
    world.say(v1::McmStatus::default());
    world.say(v1::DecisionRecord { topic: "step".into(), text: "takeoff".into(), ..Default::default() });
    let report =
        v1::MissionReport { outcome: v1::MissionOutcome::Failure.into(), reason: "fog".into(), ..Default::default() };
    world.say(v1::McmStatus { report: Some(report), ..Default::default() });
    // The test's clock passes with what is said.
    (0..20).for_each(|_| world.say(v1::VehicleStatus::default()));
    let of = |it: &Value| it["recordings"].as_array().unwrap().iter().find(|it| it["vehicle"] == "uav1").cloned();
    let list = once(&world, "/api/v1/recordings", |it| of(it).is_some_and(|it| it["state"] == "complete")).await;
    assert_eq!((&list["state"], &list["dropped"]), (&json!("ok"), &json!(0)));
    let recorded = of(&list).unwrap();
    assert_eq!((&recorded["mission"], &recorded["outcome"]), (&json!("reference"), &json!("MISSION_OUTCOME_FAILURE")));
    let path = format!("/api/v1/recordings/{}", recorded["id"].as_str().unwrap());
    let summary = world.get(&path, "observer").await.body;
    assert_eq!((&summary["reason"], &summary["decisions"][0]["text"]), (&json!("fog"), &json!("Takeoff.")));

    let request = Request::get(format!("{path}/file")).header("authorization", "Bearer observer-token");
    let response = world.router.clone().oneshot(request.body(Body::empty()).unwrap()).await.unwrap();
    let header = |name: &str| response.headers()[name].to_str().unwrap().to_owned();
    assert_eq!(
        (header("content-type"), header("content-length")),
        ("application/vnd.mcap".into(), recorded["bytes"].to_string())
    );
    let name = recorded["id"].as_str().unwrap();
    assert_eq!(header("content-disposition"), format!("attachment; filename=\"{name}.mcap\""));
    let file = response.into_body().collect().await.unwrap().to_bytes();
    assert_eq!(json!(file.len()), recorded["bytes"]);
    let bytes = file.len();
    for (range, status, extent, expected) in [
        ("bytes=0-0", 206, format!("bytes 0-0/{bytes}"), Some(&file[..1])),
        ("bytes=100-", 206, format!("bytes 100-{}/{bytes}", bytes - 1), Some(&file[100..])),
        (&format!("bytes={bytes}-"), 416, format!("bytes */{bytes}"), None),
    ] {
        let request = Request::get(format!("{path}/file")).header("authorization", "Bearer observer-token");
        let request = request.header("range", range).body(Body::empty()).unwrap();
        let response = world.router.clone().oneshot(request).await.unwrap();
        assert_eq!(response.status().as_u16(), status, "{range}");
        assert_eq!(response.headers()["content-range"].to_str().unwrap(), extent);
        let part = response.into_body().collect().await.unwrap().to_bytes();
        assert!(expected.is_none_or(|it| part == it), "{range}: {} bytes", part.len());
    }
    let topics: Vec<_> = mcap::MessageStream::new(&file).unwrap().map(|it| it.unwrap().channel.topic.clone()).collect();
    assert!(
        topics.iter().any(|it| it == "mcm/decision") && topics.iter().any(|it| it == "planner/status"),
        "{topics:?}"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn a_name_leads_to_recordings_and_to_nothing_else() {
    let world = World::new();
    std::fs::write(world.recordings.path().with_extension("mcap"), "outside").unwrap();
    std::os::unix::fs::symlink("/etc/passwd", world.recordings.path().join("link.mcap")).unwrap();
    std::fs::create_dir(world.recordings.path().join("folder.mcap")).unwrap();
    for (name, status) in [
        (RECORDING, 200),
        ("nothing", 404),
        ("link", 404),
        ("folder", 404),
        ("..%2f..%2fetc%2fpasswd", 400),
        ("%2e%2e", 400),
        ("not-a-recording.mcap", 400),
        ("%00", 400),
        ("%ff", 400),
    ] {
        for what in ["", "/file"] {
            let answer = world.get(&format!("/api/v1/recordings/{name}{what}"), "observer").await;
            assert_eq!(answer.status, status, "{name}{what}: {}", answer.text);
        }
    }
    std::fs::remove_file(world.recordings.path().with_extension("mcap")).unwrap();
    let list = world.get("/api/v1/recordings", "observer").await.body;
    let listed: Vec<_> = list["recordings"].as_array().unwrap().iter().map(|it| (&it["id"], &it["state"])).collect();
    assert_eq!(listed, [(&json!(RECORDING), &json!("damaged"))]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_folder_that_cannot_be_written_is_seen_in_health_and_metrics_and_stops_nothing() {
    let world = World::configured("most_files = 9", "most_files = 0");
    assert_eq!(world.get("/healthz", "").await.body["recordings"], "off");
    let world = World::new();
    let folder = world.recordings.path().to_owned();
    std::fs::remove_dir_all(&folder).unwrap();
    std::fs::write(&folder, "a file where the folder should be").unwrap();
    world.say(v1::McmStatus::default());
    let health = once(&world, "/healthz", |it| it["recordings"] == "failing").await;
    assert_eq!((&health["status"], &health["recordings"]), (&json!("ok"), &json!("failing")));
    // It fails with the first message that is lost; the second is a moment behind.
    let dropped = "kittiwake_recording_dropped{} 2.0";
    let metrics = answer_once(&world, "/metrics", |it| it.text.contains(dropped)).await.text;
    assert!(metrics.contains("kittiwake_recording_failing{} 1.0"), "{metrics}");
    assert!(metrics.contains(dropped), "{metrics}");
    assert_eq!(world.get("/api/v1/vehicles/uav1", "observer").await.status, 200);
    std::fs::remove_file(folder).unwrap();
}
