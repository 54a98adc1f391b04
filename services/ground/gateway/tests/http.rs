//! What a client gets over HTTP, from a gateway that the test feeds by hand.

use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::http::{Request, StatusCode};
use domain::file::Source;
use domain::time::{Now, Pace, Time};
use gateway::access::{Role, Tokens, entry};
use gateway::audit::Audit;
use gateway::config::Config;
use gateway::http::{Api, router};
use gateway::server::serve;
use gateway::{AccessControl, Gateway};
use http_body_util::BodyExt as _;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use node::{Event, Node};
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;
use tower::ServiceExt as _;

use crate::stories::world::description::Description;

mod restart;

/// Few records and few streams, so that their limits are reached soon; the second status comes late, so that only
/// events that the test causes follow the first one.
const CHANGES: [(&str, &str); 7] = [
    ("history_records = 100", "history_records = 8"),
    // One of them is kept for those who may order.
    ("max_event_streams = 2000", "max_event_streams = 3"),
    ("max_body_bytes = 10000", "max_body_bytes = 1000"),
    ("max_mission_bytes = 30000", "max_mission_bytes = 1000"),
    ("status_rate_hz = 2.0", "status_rate_hz = 0.001"),
    ("requests_per_s = 0.001", "requests_per_s = 1000.0"),
    ("most_files = 9", "most_files = 0"),
];

fn config() -> Config {
    let change = |config: String, (from, to): (&str, &str)| {
        assert!(config.contains(from), "{from}");
        config.replace(from, to)
    };
    let config = CHANGES.into_iter().fold(include_str!("world/config.toml").to_owned(), change);
    toml::from_str(&config).expect("it is a configuration")
}

/// Longer than any of these tests takes on a busy machine.
const LIMIT: Duration = Duration::from_secs(20);

/// A gateway, its clock and its routes.
struct World {
    gateway: Gateway,
    now: Now,
    api: Api,
    router: Router,
    /// Dropping it ends the streams.
    closing: watch::Sender<()>,
}

impl World {
    fn empty() -> World {
        World::of(&config())
    }

    fn of(config: &Config) -> World {
        let text = entry("eve", &[Role::Observer], "secret") + &entry("anna", &[Role::Operator], "order");
        let tokens = Tokens::parse(&Source { path: "tokens".into(), text }).unwrap();
        let access = AccessControl { tokens, audit: Audit::in_memory() };
        let (gateway, api) = Gateway::new(config, Pace::REAL_TIME, access, &Default::default(), || {});
        let (closing, closed) = watch::channel(());
        let router = router(api.clone(), closed);
        World { gateway, now: Now { time: Time::ZERO, utc_ms: 1_767_225_600_000 }, api, router, closing }
    }

    /// With uav1, whose autopilot has published a status.
    fn with_vehicle() -> World {
        let mut world = World::empty();
        world.say(v1::VehicleStatus { armed: true, ..Default::default() });
        world
    }

    /// uav1 publishes a message; a second passes.
    fn say(&mut self, message: impl Into<Message>) {
        self.event(Event::Message { vehicle: "uav1".into(), message: message.into() });
    }

    fn event(&mut self, event: Event) {
        self.now.time = self.now.time + Duration::from_secs(1);
        self.now.utc_ms += 1000;
        self.gateway.on(self.now, event, &mut Vec::new());
        self.gateway.act(self.now, &mut Vec::new());
    }

    fn decide(&mut self, text: &str) {
        self.say(v1::DecisionRecord { text: text.into(), ..Default::default() });
    }

    async fn get(&self, path: &str) -> Answer {
        self.send(Request::get(path).header("authorization", "Bearer secret").body(Body::empty()).unwrap()).await
    }

    async fn send(&self, request: Request<Body>) -> Answer {
        let response = self.router.clone().oneshot(request).await.unwrap();
        let status = response.status();
        let kind = response.headers()["content-type"].to_str().unwrap().to_owned();
        let body = response.into_body().collect().await.unwrap().to_bytes();
        Answer { status, kind, body: serde_json::from_slice(&body).unwrap_or(Value::Null) }
    }

    async fn events(&self, last_event_id: Option<&str>) -> Events {
        self.events_for("secret", last_event_id).await
    }

    async fn events_for(&self, token: &str, last_event_id: Option<&str>) -> Events {
        let authorization = format!("Bearer {token}");
        let request = Request::get("/api/v1/vehicles/uav1/events").header("authorization", authorization);
        let request = last_event_id.into_iter().fold(request, |it, id| it.header("Last-Event-ID", id));
        let response = self.router.clone().oneshot(request.body(Body::empty()).unwrap()).await.unwrap();
        assert_eq!(response.status(), StatusCode::OK);
        assert_eq!(response.headers()["content-type"], "text/event-stream");
        Events(response.into_body())
    }
}

struct Answer {
    status: StatusCode,
    kind: String,
    body: Value,
}

impl Answer {
    #[track_caller]
    fn is_problem(&self, status: u16, detail: &str) {
        assert_eq!(self.kind, "application/problem+json");
        assert_eq!((self.status.as_u16(), &self.body["status"]), (status, &json!(status)));
        assert_eq!(self.body["detail"], detail);
    }
}

/// A client that reads when the test has it read.
struct Events(Body);

#[derive(Debug)]
struct Sent {
    kind: String,
    id: String,
    data: Value,
}

impl Events {
    /// The next event; `None` at the end of the stream.
    async fn next(&mut self) -> Option<Sent> {
        let frame = tokio::time::timeout(LIMIT, self.0.frame()).await.expect("the next event is late")?;
        let bytes = frame.unwrap().into_data().unwrap();
        let text = std::str::from_utf8(&bytes).unwrap();
        let field = |name: &str| {
            let line = text.lines().find_map(|it| it.strip_prefix(name)?.strip_prefix(": "));
            line.unwrap_or_default().to_owned()
        };
        let data = serde_json::from_str(&field("data")).unwrap();
        Some(Sent { kind: field("event"), id: field("id"), data })
    }

    /// Reads events of these kinds, decisions with their text; the id of the last that has one.
    async fn expect(&mut self, expected: &[&str]) -> String {
        let mut id = String::new();
        for expected in expected {
            let sent = self.next().await.expect("the stream has ended");
            let text = sent.data["text"].as_str().map_or(String::new(), |it| format!(" {it}"));
            assert_eq!(format!("{}{text}", sent.kind), *expected);
            if !sent.id.is_empty() {
                id = sent.id;
            }
        }
        id
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_gateway_is_healthy_while_its_loop_runs() {
    let world = World::empty();
    let healthy = json!({ "status": "ok", "recordings": "off", "audit": "ok", "problems": [] });
    assert_eq!(world.get("/healthz").await.body, healthy);
    let World { gateway, router, .. } = world;
    drop(gateway);
    let response = router.oneshot(Request::get("/healthz").body(Body::empty()).unwrap()).await.unwrap();
    assert_eq!(response.status(), StatusCode::SERVICE_UNAVAILABLE);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_state_that_was_lost_or_cannot_be_saved_shows_in_the_health() {
    let mut world = World::empty();
    let loss = Some(v1::MemoryLoss { id: 1, why: "mcm.0 is garbled".into() });
    let memory = |loss, failing: &str| Some(v1::MemoryHealth { loss, failing: failing.into() });
    world.say(v1::McmStatus { memory: memory(loss, ""), ..Default::default() });
    let body = world.get("/healthz").await.body;
    let expected = ["uav1/mcm: waits for an operator, what was saved is unusable: mcm.0 is garbled"];
    assert_eq!((&body["status"], &body["problems"]), (&json!("degraded"), &json!(expected)));
    world.say(v1::McmStatus { memory: memory(None, ""), ..Default::default() });
    assert_eq!(world.get("/healthz").await.body["status"], "ok");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_gateway_is_ready_once_everything_was_seen_and_says_what_is_missing_until_then() {
    let mut world = World::empty();
    world.get("/readyz").await.is_problem(503, "no vehicle seen yet");
    let peer = |vehicle: &str, service: &str| Event::Peer {
        vehicle: vehicle.into(),
        service: service.into(),
        instance: "1".into(),
        alive: true,
    };
    world.say(v1::VehicleStatus::default());
    world.say(v1::Introspection::default());
    world.say(v1::MissionStatus::default());
    let answer = world.get("/readyz").await;
    answer.is_problem(503, "no vehicle's system is complete");
    let missing = ["vehicle-sim", "skill-manager", "monitor", "planner", "mcm", "control-tower"];
    let mut missing = missing.map(|it| format!("{it} not seen yet")).to_vec();
    missing.push("mission manager status not received yet".into());
    assert_eq!(answer.body["missing"], json!({ "uav1": missing }));
    world.say(v1::McmStatus::default());
    // In one moment, or the first would be stale when the last appears.
    let now = world.now;
    for service in ["vehicle-sim", "skill-manager", "monitor", "planner", "mcm"] {
        world.gateway.on(now, peer("uav1", service), &mut Vec::new());
    }
    world.event(peer("", "control-tower"));
    let answer = world.get("/readyz").await;
    assert_eq!(answer.body, json!({ "status": "ready", "vehicles": ["uav1"] }));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_vehicle_is_listed_and_shown_from_its_first_sign_on() {
    let mut world = World::empty();
    assert_eq!(world.get("/api/v1/vehicles").await.body["vehicles"], json!([]));
    world.say(v1::VehicleStatus { armed: true, ..Default::default() });
    assert_eq!(world.get("/api/v1/vehicles").await.body["vehicles"][0]["vehicle"], "uav1");
    let shown = world.get("/api/v1/vehicles/uav1").await.body;
    assert_eq!(shown["vehicle"], "uav1");
    assert_eq!(shown.get("missionTimeS"), None, "the gateway's own time is nobody's mission time");
    assert_eq!(shown["utc"], "2026-01-01T00:00:01.000Z");
    assert_eq!(shown["aircraft"]["status"]["armed"], true);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_request_for_what_is_not_there_is_answered_with_a_problem() {
    let world = World::with_vehicle();
    world.get("/api/v1/vehicles/uav2").await.is_problem(404, "vehicle `uav2` was never seen");
    world.get("/api/v1/vehicles/uav2/events").await.is_problem(404, "vehicle `uav2` was never seen");
    world.get("/api/v2").await.is_problem(404, "there is no `/api/v2`; `/docs` lists the routes");
    let request = Request::post("/healthz").body(Body::empty()).unwrap();
    world.send(request).await.is_problem(405, "`/healthz` does not take POST; `/docs` lists the routes");
    let request = Request::get("/healthz").header("content-length", 1001).body(Body::empty()).unwrap();
    world.send(request).await.is_problem(413, "the body has 1001 bytes, more than the limit of 1000");
    assert_eq!(world.get("/api/v1/vehicles/%ff").await.status, StatusCode::BAD_REQUEST);
    assert_eq!(world.get("/").await.kind, "text/html; charset=utf-8");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stream_replays_the_journal_and_goes_on_live() {
    let mut world = World::with_vehicle();
    world.decide("one");
    let mut events = world.events(None).await;
    events.expect(&["decision one", "status"]).await;
    world.decide("two");
    world.say(v1::SkillEvent { skill_id: 7, ..Default::default() });
    let flag = v1::RaisedFlag { name: "wind".into(), ..Default::default() };
    world.say(v1::Introspection::default());
    world.say(v1::Introspection { flags: vec![flag], ..Default::default() });
    world.say(v1::PermissionLedger {
        permissions: vec![v1::Permission { area: "a".into(), ..Default::default() }],
        ..Default::default()
    });
    world.say(v1::MissionStatus { objectives: vec![v1::Objective::default()], ..Default::default() });
    world.say(v1::McmStatus { report: Some(v1::MissionReport::default()), ..Default::default() });
    events.expect(&["decision two", "skill", "flag", "permission", "objective", "report"]).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_record_is_the_message_with_the_time_of_its_arrival() {
    let mut world = World::with_vehicle();
    world.decide("before its time is known");
    world.say(v1::McmStatus { mission_time_s: Some(100.0), ..Default::default() });
    world.say(v1::SkillEvent { skill_id: 7, state: v1::SkillState::Execute as i32, ..Default::default() });
    let mut events = world.events(None).await;
    assert_eq!(events.next().await.unwrap().data.get("missionTimeS"), None);
    let sent = events.next().await.unwrap();
    assert_eq!(sent.data["state"], "SKILL_STATE_EXECUTE");
    assert_eq!(sent.data["skillId"], "7");
    assert_eq!(sent.data["missionTimeS"], 101.0, "the vehicle's, a second after it was told");
    assert_eq!(sent.data["utc"], "2026-01-01T00:00:04.000Z");
    assert_eq!(world.get("/api/v1/vehicles/uav1").await.body["missionTimeS"], 101.0);
    assert_eq!(world.get("/api/v1/vehicles").await.body["vehicles"][0]["missionTimeS"], 101.0);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_comes_back_gets_what_it_missed_and_no_more() {
    let mut world = World::with_vehicle();
    world.decide("one");
    world.decide("two");
    let id = world.events(None).await.expect(&["decision one", "decision two"]).await;
    world.decide("three");
    world.events(Some(&id)).await.expect(&["decision three", "status"]).await;
    world.events(Some("of another gateway")).await.expect(&["decision one"]).await;
    world.events(Some("5-1")).await.expect(&["resync", "decision one"]).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_reads_too_slowly_gets_a_resync() {
    let mut world = World::with_vehicle();
    let mut events = world.events(None).await;
    events.expect(&["status"]).await;
    world.decide("one");
    events.expect(&["decision one"]).await;
    (2..=20).for_each(|n| world.decide(&n.to_string()));
    events.expect(&["resync", "decision 13", "decision 14"]).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn streams_are_counted_and_given_back_and_one_is_kept_for_those_who_may_order() {
    let world = World::with_vehicle();
    let first = world.events(None).await;
    let _second = world.events(None).await;
    world.get("/api/v1/vehicles/uav1/events").await.is_problem(503, "all 2 event streams for those who only watch are in use, and the rest is kept for those who may order; try again");
    world.events_for("order", None).await.expect(&["status"]).await;
    drop(first);
    world.events(None).await.expect(&["status"]).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stream_ends_when_the_server_or_the_loop_does() {
    let world = World::with_vehicle();
    let mut events = world.events(None).await;
    events.expect(&["status"]).await;
    drop(world.closing);
    assert!(events.next().await.is_none());

    let world = World::with_vehicle();
    let mut events = world.events(None).await;
    events.expect(&["status"]).await;
    drop(world.gateway);
    assert!(events.next().await.is_none());
}

#[tokio::test(flavor = "multi_thread")]
async fn the_server_stops_while_a_stream_is_open() {
    let world = World::with_vehicle();
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let (stop, stopped) = tokio::sync::oneshot::channel::<()>();
    let server = tokio::spawn(serve(
        listener,
        None,
        world.api.clone(),
        Box::pin(async {
            let _ = stopped.await;
        }),
    ));
    let mut client = TcpStream::connect(address).await.unwrap();
    client
        .write_all(b"GET /api/v1/vehicles/uav1/events HTTP/1.1\r\nhost: x\r\nauthorization: Bearer secret\r\n\r\n")
        .await
        .unwrap();
    let mut seen = Vec::new();
    while !String::from_utf8_lossy(&seen).contains("event: status") {
        let read = tokio::time::timeout(LIMIT, client.read_buf(&mut seen)).await.expect("the status is late").unwrap();
        assert_ne!(read, 0, "closed after {}", String::from_utf8_lossy(&seen));
    }
    stop.send(()).unwrap();
    tokio::time::timeout(LIMIT, server).await.expect("the server goes on").unwrap().unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn every_event_is_as_it_is_described() {
    let mut world = World::with_vehicle();
    let description = Description::new(world.get("/openapi.json").await.body);
    world.say(v1::McmStatus { mission_time_s: Some(1.0), report: Some(Default::default()), ..Default::default() });
    world.decide("one");
    world.say(v1::SkillEvent::default());
    world.say(v1::Introspection::default());
    world.say(v1::Introspection { flags: vec![v1::RaisedFlag::default()], ..Default::default() });
    let permissions = vec![v1::Permission::default()];
    world.say(v1::PermissionLedger { permissions, ..Default::default() });
    world.say(v1::MissionStatus { objectives: vec![v1::Objective::default()], ..Default::default() });
    let mut events = world.events(Some("5-1")).await;
    let mut kinds = Vec::new();
    while kinds.last().is_none_or(|it| it != "status") {
        let sent = events.next().await.unwrap();
        description.check_event(&sent.kind, &sent.data);
        kinds.push(sent.kind);
    }
    assert_eq!(kinds, ["resync", "report", "decision", "skill", "flag", "permission", "objective", "status"]);
}
