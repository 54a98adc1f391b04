//! What may be ordered over HTTP by whom, and what comes of it.

use std::time::{Duration, Instant};

use axum::body::Body;
use axum::http::Request;
use kittiwake_proto::topics::{Request as Call, Response};
use kittiwake_proto::v1;
use node::CallError;
use serde_json::{Value, json};

mod recordings;
mod world;
use world::World;

const ROLES: [&str; 4] = ["observer", "operator", "tower", "safety"];
const UAV: &str = "/api/v1/vehicles/uav1";

/// Every operation of the OpenAPI document: method, path with its parameters filled in, roles, body.
async fn operations(world: &World) -> Vec<(String, String, Vec<String>, String)> {
    let document = world.get("/openapi.json", "").await.body;
    assert_eq!(document["openapi"], "3.1.0");
    let mut all = Vec::new();
    for (path, operations) in document["paths"].as_object().unwrap() {
        for (method, operation) in operations.as_object().unwrap() {
            let roles =
                operation["security"].as_array().unwrap().iter().flat_map(|it| it["bearer"].as_array().unwrap());
            let roles = roles.map(|it| it.as_str().unwrap().to_owned()).collect();
            let filled =
                path.replace("{id}", "uav1").replace("{area}", "A").replace("{flag}", "f").replace("{name}", "n");
            let filled = filled.replace("{recording}", world::RECORDING);
            let schema = &operation["requestBody"]["content"]["application/json"]["schema"]["$ref"];
            let body = match schema.as_str().and_then(|it| it.rsplit('/').next()) {
                None => "",
                Some("HandOver") => r#"{"to":"ben"}"#,
                Some("kittiwake.v1.DecideRequest") => r#"{"decision":"DECISION_GRANT"}"#,
                Some("kittiwake.v1.FlagEvent") => r#"{"name":"obstacle","raised":true}"#,
                Some(_) => "{}",
            };
            all.push((method.to_uppercase(), filled, roles, body.to_owned()));
        }
    }
    all
}

#[tokio::test(flavor = "multi_thread")]
async fn every_route_lets_in_whom_its_document_says_and_nobody_else() {
    let world = World::new();
    let operations = operations(&world).await;
    assert!(30 <= operations.len(), "{operations:?}");
    for (method, path, roles, body) in operations {
        let open = roles.is_empty();
        if open {
            assert!(!path.starts_with("/api") && path != "/metrics", "{path} is open to everybody");
        }
        let mut expected_records = 0;
        for token in ["", "wrong", "old", "observer", "operator", "tower", "safety"] {
            if token == "operator" {
                world.post(&format!("{UAV}/command/take"), "operator", "").await;
            }
            world.heard();
            let before =
                world.get("/api/v1/audit?limit=1000", "observer").await.body["records"].as_array().unwrap().len();
            let answer = world.send(&method, &path, token, &format!("{token}{path}"), &body).await;
            let status = answer.status.as_u16();
            let what = format!("{method} {path} by `{token}`: {status} {}", answer.text);
            let role_fits = roles.iter().any(|it| it == token);
            match ROLES.contains(&token) {
                _ if open => assert!(status == 200 || status == 503, "{what}"),
                false => assert_eq!(status, 401, "{what}"),
                true if !role_fits => assert_eq!(status, 403, "{what}"),
                true => assert!(![401, 403, 404, 405].contains(&status), "{what}"),
            }
            if status == 401 || status == 403 {
                assert!(world.heard().is_empty(), "{what} reached the bus");
            }
            // It leaves after its answer: it must not be taken for the next one's.
            if path.ends_with("/simulation/flags") && status == 200 {
                assert_eq!(world.heard_at_last().await, ["monitor/flag"], "{what}");
            }
            let after =
                world.get("/api/v1/audit?limit=1000", "observer").await.body["records"].as_array().unwrap().len();
            if method != "GET" {
                expected_records += 1;
                assert_eq!(after, before + 1, "{what} left no record, or several");
            } else {
                assert_eq!(after, before, "{what}");
            }
        }
        assert!(method == "GET" || expected_records == 7);
    }
}

/// Orders each verb; what was heard on the bus.
#[tokio::test(flavor = "multi_thread")]
async fn each_order_reaches_the_service_it_is_for() {
    #[track_caller]
    fn check(answer: &world::Answer, heard: Vec<String>, service: &str) {
        assert_eq!((answer.status.as_u16(), heard), (200, vec![service.to_owned()]), "{}", answer.text);
    }
    let world = World::new();
    world.post(&format!("{UAV}/command/take"), "operator", "").await;
    world.heard();
    let mut key = 0;
    for (method, path, token, body, service) in [
        ("POST", "start", "operator", "", "mcm/command"),
        ("POST", "pause", "operator", "", "mcm/command"),
        ("POST", "pause", "safety", "", "mcm/command"),
        ("POST", "resume", "operator", "", "mcm/command"),
        ("POST", "replan", "operator", "", "mcm/command"),
        ("POST", "return", "safety", "", "mcm/command"),
        ("POST", "abort", "safety", "", "mcm/command"),
        ("POST", "land-at", "operator", r#"{"position":{"northM":1.0,"eastM":2.0}}"#, "mcm/command"),
        ("POST", "contingencies/obstacle/acknowledge", "safety", "", "mcm/command"),
        ("POST", "plan/decision", "operator", r#"{"revision":"3","approve":true}"#, "mcm/command"),
        (
            "POST",
            "permissions/A/decision",
            "tower",
            r#"{"decision":"DECISION_DENY","reason":"fog"}"#,
            "permission/decide",
        ),
        ("POST", "mission/validate", "operator", r#"{"text":"x"}"#, "planner/mission"),
        ("PUT", "mission", "operator", r#"{"text":"x"}"#, "planner/mission"),
        ("DELETE", "mission/objectives/x", "operator", "", "planner/mission"),
        ("POST", "mission/objectives/x/skip", "operator", "", "planner/mission"),
        ("POST", "simulation/flags", "safety", r#"{"name":"obstacle","raised":true}"#, "monitor/flag"),
        ("POST", "simulation/faults", "operator", r#"{"name":"wind","args":["5"]}"#, "sim/fault"),
    ] {
        key += 1;
        let answer = world.send(method, &format!("{UAV}/{path}"), token, &key.to_string(), body).await;
        check(&answer, world.heard_at_last().await, service);
    }
    assert_eq!(world.get(&format!("{UAV}/mission"), "observer").await.status, 200);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_order_says_who_what_and_under_which_trace() {
    let (sender, calls) = std::sync::mpsc::channel();
    let world = World::with(move |call, trace| {
        sender.send((call.clone(), trace.to_owned())).unwrap();
        Ok(world::obedient(call))
    });
    let trace = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01";
    let request = Request::post(format!("{UAV}/abort"))
        .header("authorization", "Bearer safety-token")
        .header("idempotency-key", "k1")
        .header("traceparent", trace);
    let answer = world.request(request.body(Body::empty()).unwrap()).await;
    assert_eq!((&answer.body["text"], &answer.body["requestId"]), (&json!("done"), &json!("k1")));
    let (call, seen) = calls.try_recv().unwrap();
    let Call::OperatorCommand(command) = call else { panic!("{call:?}") };
    assert_eq!((command.request_id.as_str(), command.operator.as_str()), ("safety:k1", "safety"));
    assert_eq!((command.verb, seen.as_str()), (Some(v1::operator_command::Verb::Abort(v1::AbortMission {})), trace));
    let record = &world.get("/api/v1/audit", "observer").await.body["records"][0];
    let told = ["who", "vehicle", "what", "requestId", "outcome"].map(|it| record[it].as_str().unwrap());
    assert_eq!(told, ["safety", "uav1", "abort", "k1", "done"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_repeated_key_gets_the_same_answer_and_does_nothing() {
    let mut count = 0;
    let world = World::with(move |_, _| {
        count += 1;
        Ok(Response::OperatorCommand(v1::OperatorReply { done: true, text: format!("done {count}") }))
    });
    let pause = format!("{UAV}/pause");
    let first = world.post(&pause, "safety", "k1").await;
    let again = world.post(&pause, "safety", "k1").await;
    assert_eq!(first.text, again.text);
    assert_eq!(world.heard().len(), 1);
    let misused = world.post(&format!("{UAV}/abort"), "safety", "k1").await;
    assert_eq!(
        (misused.status.as_u16(), misused.body["detail"].as_str()),
        (422, Some("the key was used for another request"))
    );
    assert_eq!(world.post(&pause, "safety", "k2").await.body["text"], "done 2");
    assert_eq!(world.post(&pause, "safety", "").await.status, 400);
    assert_eq!(world.post(&pause, "safety", &"k".repeat(65)).await.status, 400);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_refused_and_what_is_not_answered_are_told_apart() {
    let mut answers = vec![
        Ok(Response::OperatorCommand(v1::OperatorReply { done: false, text: "it holds already".into() })),
        Err(CallError::Unanswered),
        Err(CallError::Unavailable),
    ];
    let world = World::with(move |_, _| answers.remove(0));
    let mut details = Vec::new();
    for key in ["1", "2", "3"] {
        let answer = world.post(&format!("{UAV}/pause"), "safety", key).await;
        details.push(format!("{} {}", answer.status.as_u16(), answer.body["detail"].as_str().unwrap()));
    }
    assert_eq!(details[0], "409 it holds already");
    assert!(
        details[1].starts_with("503 ") && details[1].contains("whether it was done is not known"),
        "{}",
        details[1]
    );
    assert!(details[2].starts_with("503 ") && details[2].contains("nothing was done"), "{}", details[2]);
}

#[tokio::test(flavor = "multi_thread")]
async fn one_operator_holds_command_at_a_time() {
    let world = World::new();
    let at = |path: &str| format!("{UAV}/{path}");
    let nobody = world.post(&at("pause"), "operator", "1").await;
    assert_eq!(
        (nobody.status.as_u16(), nobody.body["detail"].as_str()),
        (409, Some("nobody holds command of uav1; take it first"))
    );
    assert_eq!(world.post(&at("command/take"), "operator", "").await.body["holder"], "operator");
    assert_eq!(world.post(&at("pause"), "operator", "1").await.status, 200);
    assert_eq!(world.post(&at("command/take"), "ben", "").await.body["detail"], "operator holds command of uav1");
    assert_eq!(world.post(&at("resume"), "ben", "2").await.status, 409);
    assert_eq!(
        world.send("POST", &at("command/hand-over"), "operator", "", r#"{"to":"ben"}"#).await.body["offeredTo"],
        "ben"
    );
    assert_eq!(world.post(&at("command/take"), "ben", "").await.body["holder"], "ben");
    assert_eq!(world.get(UAV, "observer").await.body["command"]["holder"], "ben");
    assert_eq!(world.post(&at("resume"), "ben", "3").await.status, 200);
    assert_eq!(world.post(&at("command/release"), "operator", "").await.status, 409);
    assert_eq!(world.post(&at("command/release"), "ben", "").await.body["holder"], Value::Null);
}

#[tokio::test(flavor = "multi_thread")]
async fn bodies_that_are_no_orders_are_refused() {
    let world = World::new();
    let land_at = format!("{UAV}/land-at");
    let long = format!(r#"{{"position":"{}"}}"#, "x".repeat(20_000));
    for (body, status) in [("", 400), ("{", 400), ("[]", 400), (r#"{"positon":{}}"#, 400), (long.as_str(), 413)] {
        let answer = world.send("POST", &land_at, "safety", "k", body).await;
        assert_eq!(answer.status.as_u16(), status, "{}", answer.text);
    }
    // Without saying beforehand how long it is.
    let chunks = (0..100).map(|_| Ok::<_, std::io::Error>("x".repeat(1000)));
    let request = Request::post(&land_at).header("authorization", "Bearer safety-token").header("idempotency-key", "k");
    let body = Body::from_stream(futures_util::stream::iter(chunks));
    assert_eq!(world.request(request.body(body).unwrap()).await.status, 413);
    assert!(world.heard().is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_body_that_never_comes_is_not_waited_for() {
    let world = World::configured("request_timeout_s = 5.0", "request_timeout_s = 0.2");
    let request = Request::post(format!("{UAV}/land-at"));
    let request = request.header("authorization", "Bearer safety-token").header("idempotency-key", "k");
    let never = Body::from_stream(futures_util::stream::pending::<Result<String, std::io::Error>>());
    assert_eq!(world.request(request.body(never).unwrap()).await.status, 408);
}

#[tokio::test(flavor = "multi_thread")]
async fn who_asks_too_often_is_told_to_wait_and_nobody_else_is() {
    let world = World::configured("requests_at_once = 1000.0", "requests_at_once = 5.0");
    let mut statuses = Vec::new();
    for _ in 0..7 {
        statuses.push(world.get(UAV, "observer").await.status.as_u16());
    }
    assert_eq!(statuses, [200, 200, 200, 200, 200, 429, 429]);
    assert_eq!(world.get(UAV, "tower").await.status, 200);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_faults_that_can_be_injected_are_asked_of_the_simulator() {
    let wind = v1::FaultKind { name: "wind".into(), arguments: "NORTH EAST [GUST]".into(), effect: "it blows".into() };
    let world = World::with(move |call, _| match call {
        Call::Fault(it) if it.name.is_empty() => {
            Ok(Response::Fault(v1::FaultReply { known: vec![wind.clone()], ..Default::default() }))
        }
        other => panic!("{other:?}"),
    });
    let list = world.get(&format!("{UAV}/simulation/faults"), "observer").await.body;
    assert_eq!(list["faults"], json!([{ "name": "wind", "arguments": "NORTH EAST [GUST]", "effect": "it blows" }]));
}

#[tokio::test(flavor = "multi_thread")]
async fn nothing_is_injected_where_something_real_flies() {
    let world = World::configured("simulation = true", "simulation = false");
    let flags = format!("{UAV}/simulation/flags");
    assert_eq!(world.send("POST", &flags, "safety", "k", r#"{"name":"x"}"#).await.status, 404);
    assert_eq!(world.get(&format!("{UAV}/simulation/faults"), "safety").await.status, 404);
    assert_eq!(world.get("/api/v1/session", "safety").await.body["simulation"], false);
}

#[tokio::test(flavor = "multi_thread")]
async fn metrics_are_open_metrics() {
    let world = World::new();
    let text = world.get("/metrics", "observer").await.text;
    assert!(text.ends_with("# EOF\n"), "{text}");
    assert!(text.contains("kittiwake_source_age_wall_seconds{vehicle=\"uav1\",source=\"vehicle_status\"}"), "{text}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_thousand_clients_that_do_not_read_hold_nobody_up() {
    use http_body_util::BodyExt as _;
    use tower::ServiceExt as _;
    let world = World::configured("requests_at_once = 1000.0", "requests_at_once = 5000.0");
    let open = || async {
        let request = Request::get(format!("{UAV}/events")).header("authorization", "Bearer observer-token");
        let response = world.router.clone().oneshot(request.body(Body::empty()).unwrap()).await.unwrap();
        assert_eq!(response.status(), 200);
        response.into_body()
    };
    let mut clients = Vec::new();
    for _ in 0..1000 {
        clients.push(open().await);
    }
    let start = Instant::now();
    for sequence in 0..2000 {
        world.say(v1::DecisionRecord { sequence, ..Default::default() });
    }
    let mut reader = open().await;
    let limit = Duration::from_secs(20);
    let mut seen = String::new();
    while !seen.contains("\"sequence\":\"1999\"") {
        let frame = tokio::time::timeout(limit, reader.frame()).await.expect("an event is late").unwrap().unwrap();
        seen.push_str(std::str::from_utf8(&frame.into_data().unwrap()).unwrap());
    }
    println!("2000 events past 1000 clients that do not read in {:?}", start.elapsed());
    drop(clients);
}
