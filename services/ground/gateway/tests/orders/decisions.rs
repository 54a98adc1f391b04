//! The last decisions of a vehicle over HTTP.

#![expect(clippy::disallowed_methods, reason = "a test waits for what other threads do, up to a limit")]

use std::time::{Duration, Instant};

use kittiwake_proto::v1;
use serde_json::{Value, json};

use crate::stories::orders::UAV;
use crate::stories::world::World;

/// Whose clients may ask as often as they like.
fn patient_world() -> World {
    World::configured("requests_at_once = 1000.0", "requests_at_once = 1000000.0")
}

fn decision(sequence: u64) -> v1::DecisionRecord {
    v1::DecisionRecord { sequence, topic: "step".into(), text: format!("step {sequence}"), ..Default::default() }
}

/// The numbers in the answer to `query`.
async fn numbers(world: &World, query: &str) -> Vec<String> {
    let body = world.get(&format!("{UAV}/decisions{query}"), "observer").await.body;
    let entries = body["decisions"].as_array().expect("a list").iter();
    entries.map(|it| it["record"]["sequence"].as_str().expect("a number").to_owned()).collect()
}

/// Waits until the decision with this number is shown.
async fn shown(world: &World, number: u64) {
    let limit = Instant::now() + Duration::from_secs(20);
    while numbers(world, "?last=1").await != [number.to_string()] {
        assert!(Instant::now() < limit, "decision {number} is not shown");
        tokio::task::yield_now().await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_decision_is_shown_with_its_cause_its_alternatives_and_its_sentence() {
    let world = patient_world();
    assert_eq!(numbers(&world, "").await, Vec::<String>::new());
    world.say(v1::DecisionRecord {
        sequence: 7,
        kind: v1::DecisionKind::ContingencyRaised.into(),
        flag: "battery_low".into(),
        value: Some(0.248),
        threshold: Some(0.25),
        unit: "ratio".into(),
        text: "flag `battery_low` raised".into(),
        ..Default::default()
    });
    let rejected = vec![v1::RejectedAlternative { what: "home".into(), why: "the way needs 61 Wh".into() }];
    let text = "flies to site `field` to land".to_owned();
    world.say(v1::DecisionRecord { sequence: 8, parent: 7, text, rejected, ..Default::default() });
    shown(&world, 8).await;
    let body = world.get(&format!("{UAV}/decisions"), "observer").await.body;
    let sentences: Vec<&Value> = body["decisions"].as_array().unwrap().iter().map(|it| &it["sentence"]).collect();
    let expected =
        ["`battery_low`: 24.8 % is below 25 %.", "Flies to site `field` to land. Not home: the way needs 61 Wh."];
    assert_eq!(sentences, expected);
    let record = &body["decisions"][0]["record"];
    assert_eq!((&record["value"], &record["unit"]), (&json!(0.248), &json!("ratio")));
    assert_eq!(record["kind"], "DECISION_KIND_CONTINGENCY_RAISED");
    assert_eq!(body["decisions"][1]["record"]["parent"], "7");
    assert_eq!(body["decisions"][1]["record"].get("value"), None, "nothing was measured");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_asks_for_the_last_ones_or_for_those_after_a_number() {
    let world = patient_world();
    (1..=600).for_each(|number| world.say(decision(number)));
    shown(&world, 600).await;
    assert_eq!(numbers(&world, "?last=2").await, ["599", "600"]);
    assert_eq!(numbers(&world, "?after=597").await, ["598", "599", "600"]);
    assert_eq!(numbers(&world, "?last=2&after=597").await, ["599", "600"]);
    assert_eq!(numbers(&world, "?after=600").await, Vec::<String>::new());
    let kept = numbers(&world, "").await;
    assert_eq!((kept.len(), kept[0].as_str()), (500, "101"));
    assert_eq!(numbers(&world, "?last=9999").await, kept);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_query_that_makes_no_sense_is_refused_with_what_is_wrong() {
    let world = World::new();
    let wrong = [("?last=-1", "invalid digit"), ("?after=now", "invalid digit"), ("?lst=3", "unknown field `lst`")];
    for (query, part) in wrong {
        let answer = world.get(&format!("{UAV}/decisions{query}"), "observer").await;
        let detail = answer.body["detail"].as_str().unwrap_or_default();
        assert!(answer.status == 400 && detail.contains(part), "{query}: {} {}", answer.status, answer.text);
    }
    assert_eq!(world.get(&format!("{UAV}/decisions"), "").await.status, 401);
    assert_eq!(world.get("/api/v1/vehicles/uav9/decisions", "observer").await.status, 404);
}
