//! Which requests leave a record, and when.

#![expect(clippy::disallowed_methods, reason = "a test waits for what other threads do, up to a limit")]

use std::time::{Duration, Instant};

use axum::body::Body;
use axum::http::Request;
use serde_json::{Value, json};

use crate::stories::orders::UAV;
use crate::stories::world::{self, World};

/// The record of the newest order, once it is at this stage.
async fn record_at(world: &World, stage: &str) -> Value {
    let limit = Instant::now() + Duration::from_secs(20);
    loop {
        let records = world.get("/api/v1/audit?limit=1", "observer").await.body["records"].clone();
        if records[0]["stage"] == stage {
            return records[0].clone();
        }
        assert!(Instant::now() < limit, "no record at {stage}: {records}");
        tokio::task::yield_now().await;
    }
}

/// The service answers only when the test lets it: the order is recorded before it is sent, the client leaves, the order is
/// carried out, and its outcome is recorded.
#[tokio::test(flavor = "multi_thread")]
async fn an_order_whose_client_leaves_is_recorded_before_it_is_sent_and_after_it_was_carried_out() {
    use tower::ServiceExt as _;
    let (answer, answers) = std::sync::mpsc::channel();
    let (asked, was_asked) = std::sync::mpsc::channel();
    let world = World::with(move |call, _| {
        asked.send(()).unwrap();
        answers.recv().unwrap();
        Ok(world::obedient(call))
    });
    let request = Request::post(format!("{UAV}/pause"))
        .header("authorization", "Bearer safety-token")
        .header("idempotency-key", "k1")
        .body(Body::empty())
        .unwrap();
    let client = tokio::spawn(world.router.clone().oneshot(request));
    tokio::task::spawn_blocking(move || was_asked.recv_timeout(Duration::from_secs(20)).unwrap()).await.unwrap();
    let record = record_at(&world, "AUDIT_STAGE_ASKED").await;
    assert_eq!((&record["who"], &record["what"], &record["status"]), (&json!("safety"), &json!("pause"), &json!(0)));
    client.abort();
    assert!(client.await.unwrap_err().is_cancelled());
    answer.send(()).unwrap();
    let ended = record_at(&world, "AUDIT_STAGE_ENDED").await;
    assert_eq!(
        (&ended["asked"], &ended["status"], &ended["outcome"]),
        (&record["number"], &json!(200), &json!("done"))
    );
    // A client that comes back with its key gets the answer.
    let again = world.post(&format!("{UAV}/pause"), "safety", "k1").await;
    assert_eq!((again.status.as_u16(), world.heard().len()), (200, 1), "{}", again.text);
}

/// The last orders show that neither the loop nor the journal has ended meanwhile.
#[tokio::test(flavor = "multi_thread")]
async fn arguments_that_are_nested_deep_are_recorded_by_size_and_hash_and_stop_nothing() {
    let world = World::new();
    let pause = format!("{UAV}/pause");
    for depth in [15, 16, 17, 49, 50, 51, 127] {
        for (open, inner, close) in [("[", "", "]"), (r#"{"a":"#, "1.5", "}")] {
            let body = format!("{}{inner}{}", open.repeat(depth), close.repeat(depth));
            let answer = world.send("POST", &pause, "safety", &format!("{depth}{open}"), &body).await;
            assert_eq!(answer.status, 400, "{body}: {}", answer.text);
            let record = record_at(&world, "AUDIT_STAGE_ENDED").await;
            assert_eq!((&record["what"], &record["status"]), (&json!("pause"), &json!(400)), "{body}");
            let recorded = &record["arguments"];
            if depth <= 16 {
                assert_eq!(*recorded, serde_json::from_str::<Value>(&body).unwrap());
            } else {
                assert_eq!(recorded["bytes"].as_f64(), Some(body.len() as f64), "{record}");
                assert_eq!(recorded["sha256"].as_str().map(str::len), Some(64), "{record}");
            }
            assert_eq!(world.post(&pause, "safety", &format!("{depth}{open} again")).await.status, 200);
        }
    }
}

/// The parser repeats the name of a field that it does not know.
#[tokio::test(flavor = "multi_thread")]
async fn what_is_said_of_a_body_is_short_in_the_answer_and_in_the_record() {
    let world = World::new();
    let body = json!({ "x".repeat(9000): 1 }).to_string();
    let answer = world.send("POST", &format!("{UAV}/pause"), "safety", "k1", &body).await;
    let detail = answer.body["detail"].as_str().unwrap();
    assert_eq!((answer.status.as_u16(), detail.chars().count()), (400, 1001), "{detail}");
    assert!(detail.starts_with("the body is invalid: ") && detail.ends_with("x…"), "{detail}");
    let record = record_at(&world, "AUDIT_STAGE_ENDED").await;
    let outcome = record["outcome"].as_str().unwrap();
    assert_eq!((outcome.chars().count(), outcome.ends_with("x…")), (501, true), "{outcome}");
    assert!(record.to_string().len() < 2000, "{record}");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_strangers_send_displaces_no_order() {
    let world = World::new();
    world.post(&format!("{UAV}/pause"), "safety", "k1").await;
    let (long, key) = ("x".repeat(60_000), "k".repeat(5000));
    for n in 0..900 {
        let path = format!("{UAV}/contingencies/{}/acknowledge?{n}", &long[..5000]);
        assert_eq!(world.send("POST", &path, "wrong", &key, &long).await.status, 401);
    }
    let orders = world.get("/api/v1/audit", "observer").await;
    assert_eq!(
        orders.body["records"].as_array().map(|it| it.iter().map(|it| &it["what"]).collect()),
        Some(vec![&json!("pause")])
    );
    let refused = world.get("/api/v1/audit/refusals?limit=1000", "observer").await;
    assert_eq!(refused.body["counts"][0]["count"], "900");
    assert!(refused.text.len() < 200_000, "{} bytes", refused.text.len());
    let metrics = world.get("/metrics", "observer").await.text;
    assert!(metrics.contains("kittiwake_refused_requests_total{reason=\"Unauthorized\"} 900"), "{metrics}");
}
