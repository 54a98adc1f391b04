//! Who may give which order over HTTP, and what the outcome is.

#![expect(clippy::disallowed_methods, reason = "a test waits for what other threads do, up to a limit")]

use std::time::{Duration, Instant};

use axum::body::Body;
use axum::http::Request;
use futures_util::StreamExt as _;
use kittiwake_proto::topics::{Request as Call, Response};
use kittiwake_proto::v1;
use node::CallError;
use serde_json::{Value, json};

mod audit;
mod decisions;
mod recordings;
use crate::stories::world::{self, World};

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
            let filled = filled.replace("{recording}", world::RECORDING).replace("{file}", "main.js");
            let schema = &operation["requestBody"]["content"]["application/json"]["schema"]["$ref"];
            let body = match schema.as_str().and_then(|it| it.rsplit('/').next()) {
                None => "",
                Some("kittiwake.v1.HandOver") => r#"{"to":"ben"}"#,
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
async fn every_route_lets_in_the_roles_of_its_description_and_no_others() {
    let world = World::configured("requests_at_once = 1000.0", "requests_at_once = 9000.0");
    let operations = operations(&world).await;
    assert!(30 <= operations.len(), "{operations:?}");
    for (method, path, roles, body) in operations {
        let open = roles.is_empty();
        if open {
            assert!(!path.starts_with("/api") && path != "/metrics", "{path} is open to everybody");
        }
        let counts = || async {
            let orders =
                world.get("/api/v1/audit?limit=1000", "observer").await.body["records"].as_array().unwrap().len();
            let refusals = world.get("/api/v1/audit/refusals", "observer").await.body["counts"].clone();
            let count = |it: &Value| it["count"].as_str().unwrap().parse::<usize>().unwrap();
            (orders, refusals.as_array().unwrap().iter().map(count).sum::<usize>())
        };
        for token in ["", "wrong", "old", "observer", "operator", "tower", "safety"] {
            if token == "operator" {
                world.post(&format!("{UAV}/command/take"), "operator", "").await;
            }
            world.heard();
            let before = counts().await;
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
            let is_refused = status == 401 || status == 403;
            if is_refused {
                assert!(world.heard().is_empty(), "{what} reached the bus");
            }
            // The flag leaves after its answer: it must not count as the next order's.
            if path.ends_with("/simulation/flags") && status == 200 {
                assert_eq!(world.heard_at_last().await, ["monitor/flag"], "{what}");
            }
            let after = counts().await;
            let is_order = method != "GET" && !is_refused;
            assert_eq!(after.0, before.0 + usize::from(is_order), "an order leaves one record: {what}");
            assert_eq!(after.1, before.1 + usize::from(is_refused), "a refusal is counted: {what}");
        }
    }
}

/// The planner is beyond a radio link.
#[tokio::test(flavor = "multi_thread")]
async fn however_many_read_a_mission_the_planner_is_asked_once_a_second_and_whoever_changes_it_sees_that() {
    use v1::mission_request::Request::Upload;
    let mut mission = "first".to_owned();
    let world = World::with(move |call, _| {
        if let Call::Mission(v1::MissionRequest { request: Some(Upload(file)), .. }) = call {
            mission.clone_from(&file.text);
        }
        let status = Some(v1::MissionStatus { mission: mission.clone(), ..Default::default() });
        Ok(Response::Mission(v1::MissionReply { accepted: true, status, ..Default::default() }))
    });
    let path = format!("{UAV}/mission");
    let start = Instant::now();
    for _ in 0..200 {
        assert_eq!(world.get(&path, "observer").await.body["mission"], "first");
    }
    let asked = world.heard().len() as u64;
    assert!((1..=1 + start.elapsed().as_secs()).contains(&asked), "{asked} times");
    while world.get(&path, "operator").await.status == 200 && world.heard().is_empty() {
        assert!(start.elapsed() < Duration::from_secs(100), "it is never asked again");
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    world.post(&format!("{UAV}/command/take"), "operator", "").await;
    assert_eq!(world.send("PUT", &path, "operator", "k", r#"{"text":"second"}"#).await.status, 200);
    let read = world.get(&path, "observer").await;
    assert_eq!((&read.body["mission"], world.heard()), (&json!("second"), vec!["mission/request".to_owned(); 2]));
}

/// Gives each order, and compares what reached the bus.
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
        ("POST", "inspected", "operator", "", "mcm/command"),
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
        ("POST", "sites/wt12/report", "tower", r#"{"rotor":"ROTOR_STOPPED","windMS":6.0}"#, "site/report"),
        ("POST", "mission/validate", "operator", r#"{"text":"x"}"#, "mission/request"),
        ("PUT", "mission", "operator", r#"{"text":"x"}"#, "mission/request"),
        ("POST", "mission/airspace/validate", "operator", r#"{"text":"x"}"#, "mission/request"),
        ("PUT", "mission/airspace", "operator", r#"{"text":"x"}"#, "mission/request"),
        ("DELETE", "mission/objectives/x", "operator", "", "mission/request"),
        ("POST", "mission/objectives/x/skip", "operator", "", "mission/request"),
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
async fn an_order_carries_its_operator_its_content_and_its_trace() {
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
    assert_eq!(
        (command.verb, seen.as_str()),
        (Some(v1::operator_command::Verb::Abort(v1::AbortMission { overrides: false })), trace)
    );
    let record = &world.get("/api/v1/audit", "observer").await.body["records"][0];
    let facts = ["who", "vehicle", "what", "requestId", "outcome", "stage"].map(|it| record[it].as_str().unwrap());
    assert_eq!(facts, ["safety", "uav1", "abort", "k1", "done", "AUDIT_STAGE_ENDED"]);
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
async fn a_refusal_differs_from_a_call_without_a_reply() {
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
        details[1].starts_with("503 ") && details[1].contains("it is not known whether it was done"),
        "{}",
        details[1]
    );
    assert!(details[2].starts_with("503 ") && details[2].contains("nothing was done"), "{}", details[2]);
}

#[tokio::test(flavor = "multi_thread")]
async fn whoever_decides_without_an_answer_is_told_to_look_before_they_decide_again() {
    let world = World::with(move |_, _| Err(CallError::Unanswered));
    let decided = format!("{UAV}/permissions/A/decision");
    let answer = world.send("POST", &decided, "tower", "k1", r#"{"decision":"DECISION_GRANT"}"#).await;
    assert_eq!(answer.body["type"], "urn:kittiwake:problem:outcome-unknown");
    let detail = answer.body["detail"].as_str().unwrap();
    assert!(detail.ends_with("look at the permission before you decide again"), "{detail}");
    let answer = world.post(&format!("{UAV}/pause"), "safety", "k2").await;
    assert!(answer.body["detail"].as_str().unwrap().ends_with("repeat the order with the same key"), "{}", answer.text);
}

#[tokio::test(flavor = "multi_thread")]
async fn after_the_reply_of_another_service_nobody_knows_whether_an_order_was_carried_out() {
    let world = World::with(|call, _| match call {
        Call::Decide(_) => Ok(Response::OperatorCommand(v1::OperatorReply { done: true, ..Default::default() })),
        _ => Ok(Response::Decide(v1::DecideReply { accepted: true, ..Default::default() })),
    });
    let grant = r#"{"decision":"DECISION_GRANT"}"#;
    let asked = [
        ("POST", "pause", "safety", "", "outcome-unknown"),
        ("POST", "permissions/A/decision", "tower", grant, "outcome-unknown"),
        ("POST", "simulation/faults", "safety", r#"{"name":"wind"}"#, "outcome-unknown"),
        // Who only asks has changed nothing.
        ("GET", "mission", "observer", "", "invalid-reply"),
    ];
    for (method, path, who, body, kind) in asked {
        let answer = world.send(method, &format!("{UAV}/{path}"), who, "k1", body).await;
        let expected = json!(format!("urn:kittiwake:problem:{kind}"));
        assert_eq!((answer.status.as_u16(), &answer.body["type"]), (502, &expected), "{path}: {}", answer.text);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn nobody_says_that_nothing_was_done_of_an_order_whose_answer_takes_too_long() {
    let (answer, answers) = std::sync::mpsc::channel::<()>();
    let play = move |call: &Call, _: &str| {
        // Until the test has what it wants to know.
        let _ = answers.recv();
        Ok(world::obedient(call))
    };
    let world = World::configured_and_playing("request_timeout_s = 5.0", "request_timeout_s = 0.2", play);
    let late = world.post(&format!("{UAV}/pause"), "safety", "k1").await;
    assert_eq!((late.status.as_u16(), &late.body["type"]), (503, &json!("urn:kittiwake:problem:outcome-unknown")));
    drop(answer);
}

#[tokio::test(flavor = "multi_thread")]
async fn one_operator_has_command_at_a_time() {
    let world = World::new();
    let at = |path: &str| format!("{UAV}/{path}");
    let nobody = world.post(&at("pause"), "operator", "1").await;
    assert_eq!(
        (nobody.status.as_u16(), nobody.body["detail"].as_str()),
        (409, Some("nobody has command of uav1; take command first"))
    );
    assert_eq!(world.post(&at("command/take"), "operator", "").await.body["holder"], "operator");
    assert_eq!(world.post(&at("pause"), "operator", "1").await.status, 200);
    assert_eq!(world.post(&at("command/take"), "ben", "").await.body["detail"], "operator has command of uav1");
    assert_eq!(world.post(&at("resume"), "ben", "2").await.status, 409);
    // Only to somebody else who can take it: the observer may not command, and `old` has expired.
    for (to, refusal) in [
        ("operator", "operator has command of uav1: name somebody else"),
        ("nobody", "nobody cannot take command: no valid token has this name and the role `operator`"),
        ("observer", "observer cannot take command: no valid token has this name and the role `operator`"),
        ("old", "old cannot take command: no valid token has this name and the role `operator`"),
    ] {
        let body = format!(r#"{{"to":"{to}"}}"#);
        let refused = world.send("POST", &at("command/hand-over"), "operator", "", &body).await;
        assert_eq!((refused.status.as_u16(), refused.body["detail"].as_str()), (409, Some(refusal)));
    }
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
async fn invalid_bodies_are_refused() {
    let world = World::new();
    let land_at = format!("{UAV}/land-at");
    let long = format!(r#"{{"position":"{}"}}"#, "x".repeat(20_000));
    for (body, status) in [("", 400), ("{", 400), ("[]", 400), (r#"{"positon":{}}"#, 400), (long.as_str(), 413)] {
        let answer = world.send("POST", &land_at, "safety", "k", body).await;
        assert_eq!(answer.status.as_u16(), status, "{}", answer.text);
    }
    // A coordinate that is not named is not zero.
    for (body, pointer) in [
        (r#"{"position":{}}"#, "/position/northM"),
        (r#"{"position":{"northM":0}}"#, "/position/eastM"),
        (r#"{"position":{"northM":"NaN","eastM":1}}"#, "/position/northM"),
    ] {
        let answer = world.send("POST", &land_at, "safety", "k", body).await;
        assert!(answer.status == 400 && answer.text.contains(pointer), "{}", answer.text);
    }
    // A body of unknown length.
    let chunks = (0..100).map(|_| Ok::<_, std::io::Error>("x".repeat(1000)));
    let request = Request::post(&land_at).header("authorization", "Bearer safety-token").header("idempotency-key", "k");
    let body = Body::from_stream(futures_util::stream::iter(chunks));
    assert_eq!(world.request(request.body(body).unwrap()).await.status, 413);
    assert!(world.heard().is_empty());
}

/// A body of more than `max_body_bytes` takes memory that is shared.
#[tokio::test(flavor = "multi_thread")]
async fn the_text_of_a_mission_may_be_longer_and_two_of_them_at_a_time() {
    let (go, wait) = std::sync::mpsc::channel::<()>();
    let world = World::with(move |call, _| {
        let _ = wait.recv();
        Ok(world::obedient(call))
    });
    let validate = format!("{UAV}/mission/validate");
    let text = |bytes| format!(r#"{{"text":"{}"}}"#, "x".repeat(bytes));
    let (large, too_large) = (text(20_000), text(30_000));
    let answer = world.send("POST", &validate, "operator", "k", &too_large).await;
    let told = "the body has 30011 bytes, more than the limit of 30000";
    assert!(answer.status == 413 && answer.text.contains(told), "{}", answer.text);
    let asking = (0..3).map(|_| world.send("POST", &validate, "operator", "k", &large));
    let mut asking: futures_util::stream::FuturesUnordered<_> = asking.collect();
    let refused = asking.next().await.unwrap();
    assert!(refused.status == 429 && refused.text.contains("2 large missions"), "{}", refused.text);
    drop(go);
    while let Some(answer) = asking.next().await {
        assert_eq!(answer.status, 200, "{}", answer.text);
    }
    assert_eq!(world.send("POST", &validate, "operator", "k", &large).await.status, 200, "they were given back");
}

#[tokio::test(flavor = "multi_thread")]
async fn names_and_reasons_with_control_characters_are_refused() {
    let world = World::new();
    world.post(&format!("{UAV}/command/take"), "operator", "").await;
    for (path, who, body, expected) in [
        ("command/hand-over", "operator", r#"{"to":"\u001b[2J"}"#, "the body is invalid"),
        ("pause", "operator", r#"{"overridden":"a\nb"}"#, "the body is invalid"),
        ("permissions/A/decision", "tower", r#"{"decision":"DECISION_DENY","reason":"a\rb"}"#, "the body is invalid"),
        ("permissions/A%0D%1B%5B2KX/decision", "tower", r#"{"decision":"DECISION_DENY"}"#, "the path is invalid"),
        ("simulation/flags", "operator", r#"{"name":"x","raised":true,"reason":"\u009b2J"}"#, "the body is invalid"),
    ] {
        let answer = world.send("POST", &format!("{UAV}/{path}"), who, path, body).await;
        let detail = answer.body["detail"].as_str().unwrap_or_default();
        assert!(answer.status == 400 && detail.contains(expected), "{path}: {}", answer.text);
        assert!(detail.contains("may not have control characters"), "{detail}");
    }
    assert!(world.heard().is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_body_that_does_not_arrive_is_given_up() {
    let world = World::configured("request_timeout_s = 5.0", "request_timeout_s = 0.2");
    let request = Request::post(format!("{UAV}/land-at"));
    let request = request.header("authorization", "Bearer safety-token").header("idempotency-key", "k");
    let never = Body::from_stream(futures_util::stream::pending::<Result<String, std::io::Error>>());
    assert_eq!(world.request(request.body(never).unwrap()).await.status, 408);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_asks_too_often_has_to_wait_and_others_do_not() {
    let world = World::configured("requests_at_once = 1000.0", "requests_at_once = 5.0");
    let mut statuses = Vec::new();
    for _ in 0..7 {
        statuses.push(world.get(UAV, "observer").await.status.as_u16());
    }
    assert_eq!(statuses, [200, 200, 200, 200, 200, 429, 429]);
    assert_eq!(world.get(UAV, "tower").await.status, 200);
}

#[tokio::test(flavor = "multi_thread")]
async fn who_reads_too_often_can_still_order_and_not_without_end() {
    let world = World::configured("requests_at_once = 1000.0", "requests_at_once = 5.0");
    let order = async |number: usize| world.post(&format!("{UAV}/abort"), "safety", &format!("k{number}")).await.status;
    for _ in 0..7 {
        world.get(UAV, "safety").await;
    }
    assert_eq!(world.get(UAV, "safety").await.status, 429);
    let mut statuses = Vec::new();
    for number in 0..7 {
        statuses.push(order(number).await.as_u16());
    }
    assert_eq!(statuses, [200, 200, 200, 200, 200, 429, 429]);
    assert_eq!(world.heard().len(), 5);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_simulator_lists_the_faults_that_can_be_injected() {
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
async fn nothing_is_injected_where_the_vehicle_is_real() {
    let world = World::configured("simulation = true", "simulation = false");
    let flags = format!("{UAV}/simulation/flags");
    assert_eq!(world.send("POST", &flags, "safety", "k", r#"{"name":"x"}"#).await.status, 404);
    assert_eq!(world.get(&format!("{UAV}/simulation/faults"), "safety").await.status, 404);
    assert_eq!(world.get("/api/v1/session", "safety").await.body["simulation"], false);
}

/// The name `uav1` as a client may also escape it.
const ESCAPED: &str = "/api/v1/vehicles/uav%31";

#[tokio::test(flavor = "multi_thread")]
async fn guard_handler_and_record_see_the_same_vehicle_however_its_name_is_escaped() {
    let world = World::new();
    let taken = world.post(&format!("{ESCAPED}/command/take"), "operator", "").await;
    assert_eq!((taken.status.as_u16(), &taken.body["holder"]), (200, &json!("operator")));
    let paused = world.post(&format!("{ESCAPED}/pause"), "operator", "k1").await;
    assert_eq!((paused.status.as_u16(), &paused.body["vehicle"]), (200, &json!("uav1")), "{}", paused.text);
    assert_eq!(world.heard(), ["mcm/command"]);
    // The same order: it has its answer already.
    assert_eq!(world.post(&format!("{UAV}/pause"), "operator", "k1").await.text, paused.text);
    assert!(world.heard().is_empty());
    // Command of uav1 is what counts, under either spelling.
    assert_eq!(world.post(&format!("{ESCAPED}/resume"), "ben", "k2").await.body["command"]["holder"], "operator");
    assert_eq!(world.get(ESCAPED, "observer").await.body["command"]["holder"], "operator");
    let records = world.get("/api/v1/audit", "observer").await.body["records"].clone();
    let orders: Vec<_> = records.as_array().unwrap().iter().map(|it| (&it["vehicle"], &it["what"])).collect();
    let expected = ["command/take", "pause", "resume"].map(|what| (json!("uav1"), json!(what)));
    assert_eq!(orders, expected.each_ref().map(|(vehicle, what)| (vehicle, what)));
    // A vehicle that is unknown is unknown to all three.
    for name in ["uav2", "uav1%2f..", "%2e%2e", "uav1%00"] {
        let answer = world.post(&format!("/api/v1/vehicles/{name}/pause"), "safety", "k3").await;
        assert_eq!(answer.status, 404, "{name}: {}", answer.text);
    }
    assert!(world.heard().is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn the_pages_run_nothing_but_their_own_scripts() {
    use tower::ServiceExt as _;
    let world = World::new();
    for path in ["/", "/docs", "/page/docs.html", "/page/docs.js"] {
        let request = Request::get(path).body(Body::empty()).unwrap();
        let response = world.router.clone().oneshot(request).await.unwrap();
        assert_eq!(response.status(), 200);
        let policy = response.headers()["content-security-policy"].to_str().unwrap();
        assert!(policy.contains("default-src 'none'") && !policy.contains("unsafe"), "{path}: {policy}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn requests_without_a_valid_token_share_one_limit() {
    let world = World::configured("requests_at_once = 1000.0", "requests_at_once = 5.0");
    let mut statuses = Vec::new();
    for (method, token) in [("GET", ""), ("GET", "wrong"), ("POST", "old"), ("POST", ""), ("GET", "old")].repeat(2) {
        let path = if method == "GET" { UAV.to_owned() } else { format!("{UAV}/pause") };
        statuses.push(world.send(method, &path, token, "k", "").await.status.as_u16());
    }
    assert_eq!(statuses, [401, 401, 401, 401, 401, 429, 429, 429, 429, 429]);
    // A client with a token of its own is not limited by them, and a flood is counted and not recorded.
    let refused = world.get("/api/v1/audit/refusals", "observer").await.body;
    let counts: Vec<_> = refused["counts"].as_array().unwrap().iter().map(|it| (&it["reason"], &it["count"])).collect();
    assert_eq!(counts, [(&json!("Too Many Requests"), &json!("5")), (&json!("Unauthorized"), &json!("5"))]);
    assert_eq!(refused["records"].as_array().map(Vec::len), Some(5), "{refused}");
    assert_eq!(world.get("/api/v1/audit", "observer").await.body["records"], json!([]));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_has_the_configuration_that_a_client_needs() {
    let mut session = World::new().get("/api/v1/session", "operator").await.body;
    // A hash of the page.
    let page = session.as_object_mut().and_then(|it| it.remove("page"));
    assert!(page.as_ref().and_then(|it| it.as_str()).is_some_and(|it| it.len() == 16), "{page:?}");
    let expected = json!({
        "name": "operator", "roles": ["operator"], "simulation": true, "speed": 1.0, "statusRateHz": 2.0, "thresholds": [], "withoutContact": [], "waivers": [], "flags": [],
    });
    assert_eq!(session, expected);
}

#[tokio::test(flavor = "multi_thread")]
async fn every_answer_is_described() {
    let document = World::new().get("/openapi.json", "").await.body;
    let schemas = document["components"]["schemas"].as_object().unwrap();
    let text = document.to_string();
    for name in text.split("#/components/schemas/").skip(1).filter_map(|it| it.split('"').next()) {
        assert!(schemas.contains_key(name), "{name}");
    }
    for described in ["Vehicle", "Fleet", "Recording", "Session", "Problem", "AuditLog", "OrderDone"] {
        assert!(schemas.contains_key(&format!("kittiwake.v1.{described}")), "{described}");
    }
    let flags = &schemas["kittiwake.v1.Vehicle"]["properties"]["flags"];
    assert_eq!(flags["items"]["$ref"], "#/components/schemas/kittiwake.v1.Vehicle.Flag");
    // The page and the document itself are routes like any other.
    for path in ["/", "/page/{file}", "/openapi.json"] {
        assert!(document["paths"][path].is_object(), "{path}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn metrics_are_open_metrics() {
    let world = World::new();
    let text = world.get("/metrics", "observer").await.text;
    assert!(text.ends_with("# EOF\n"), "{text}");
    assert!(text.contains("kittiwake_source_age_wall_seconds{vehicle=\"uav1\",source=\"vehicle_status\"}"), "{text}");
    world.say(v1::Heartbeat { service: "mcm".into(), unanswered: 3, ..Default::default() });
    let unanswered = "kittiwake_process_unanswered_total{vehicle=\"uav1\",service=\"mcm\"} 3";
    let limit = Instant::now() + Duration::from_secs(20);
    while !world.get("/metrics", "observer").await.text.contains(unanswered) {
        assert!(Instant::now() < limit, "no {unanswered}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_thousand_clients_that_do_not_read_do_not_delay_the_others() {
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
