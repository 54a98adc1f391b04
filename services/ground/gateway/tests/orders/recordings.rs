//! Recorded missions over HTTP.

#![expect(clippy::disallowed_methods, reason = "a test waits for what other threads do, up to a limit")]

use std::time::{Duration, Instant};

use axum::body::Body;
use axum::http::Request;
use http_body_util::BodyExt as _;
use kittiwake_proto::v1;
use serde_json::{Value, json};
use tower::ServiceExt as _;

use crate::stories::world::{Answer, RECORDING, World};

/// What the gateway answers once the answer is `ready`.
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
async fn a_mission_is_listed_summarised_and_downloaded() {
    let world = World::new();
    world.say(v1::MissionStatus { mission: "reference".into(), ..Default::default() });
    world.say(v1::McmStatus::default());
    world.say(v1::DecisionRecord { topic: "step".into(), text: "takeoff".into(), ..Default::default() });
    let report =
        v1::MissionReport { outcome: v1::MissionOutcome::Failure.into(), reason: "fog".into(), ..Default::default() };
    world.say(v1::McmStatus { report: Some(report), ..Default::default() });
    // Each message lets the test's clock pass.
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
    let size = recorded["bytes"].as_str().unwrap();
    assert_eq!((header("content-type"), header("content-length")), ("application/vnd.mcap".into(), size.to_owned()));
    let name = recorded["id"].as_str().unwrap();
    assert_eq!(header("content-disposition"), format!("attachment; filename=\"{name}.mcap\""));
    let file = response.into_body().collect().await.unwrap().to_bytes();
    assert_eq!(file.len().to_string(), size);
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
        topics.iter().any(|it| it == "mcm/decision") && topics.iter().any(|it| it == "mission/status"),
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
async fn a_folder_that_cannot_be_written_shows_in_health_and_metrics_and_stops_nothing() {
    let world = World::configured("most_files = 9", "most_files = 0");
    assert_eq!(world.get("/healthz", "").await.body["recordings"], "off");
    let world = World::new();
    let folder = world.recordings.path().to_owned();
    std::fs::remove_dir_all(&folder).unwrap();
    std::fs::write(&folder, "a file where the folder should be").unwrap();
    world.say(v1::McmStatus::default());
    let health = once(&world, "/healthz", |it| it["recordings"] == "failing").await;
    assert_eq!((&health["status"], &health["recordings"]), (&json!("ok"), &json!("failing")));
    // The first lost message makes it fail; the second follows a moment later.
    let dropped = "kittiwake_recording_dropped_total{} 2";
    let metrics = answer_once(&world, "/metrics", |it| it.text.contains(dropped)).await.text;
    assert!(metrics.contains("kittiwake_recording_failing{} 1.0"), "{metrics}");
    assert!(metrics.contains(dropped), "{metrics}");
    assert_eq!(world.get("/api/v1/vehicles/uav1", "observer").await.status, 200);
    std::fs::remove_file(folder).unwrap();
}

/// A client that asks, leaves and asks again has no more readings waiting for the disk than there are for one token.
#[test]
fn readings_that_wait_for_the_disk_are_limited_although_their_clients_have_left() {
    let runtime = tokio::runtime::Builder::new_multi_thread().max_blocking_threads(1).enable_all().build().unwrap();
    runtime.block_on(async {
        let world = World::new();
        let path = format!("/api/v1/recordings/{RECORDING}");
        let (free, is_free) = std::sync::mpsc::sync_channel::<()>(0);
        let busy = tokio::task::spawn_blocking(move || is_free.recv());
        for path in ["/api/v1/recordings", &path] {
            let left = tokio::time::timeout(Duration::ZERO, world.get(path, "observer")).await;
            assert!(left.is_err(), "the disk is busy");
        }
        for path in ["/api/v1/recordings", &path] {
            let refused = world.get(path, "observer").await;
            let why = "observer has 2 readings of recordings open, the most that one token may have; close one of them or wait";
            assert_eq!((refused.status.as_u16(), &refused.body["detail"]), (429, &json!(why)));
        }
        drop(free);
        assert!(busy.await.unwrap().is_err());
        assert_eq!(answer_once(&world, &path, |it| it.status == 200).await.status, 200);
    });
}
