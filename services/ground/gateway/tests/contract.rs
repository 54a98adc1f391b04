//! The contract of the gateway's verbs over HTTP, in each state of a flight, with all seven services.
//!
//! Requests go through the whole gateway except the socket; the virtual clock runs while they wait for their answers.

use std::path::{Path, PathBuf};
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::http::Request;
use control_tower::policy::Policy;
use domain::contingency::Contingencies;
use domain::file::Source;
use domain::time::Pace;
use gateway::access::{Role, Tokens, entry};
use gateway::audit::Audit;
use gateway::http::router;
use gateway::{AccessControl, Gateway};
use http_body_util::BodyExt as _;
use kittiwake_proto::v1::MissionOutcome;
use serde_json::Value;
use simulation::{Machine, Setup, Simulation};
use tokio::sync::watch;
use tower::ServiceExt as _;

use crate::stories::world::description::Description;

/// The section of the shipped configuration.
#[derive(serde::Deserialize)]
struct Shipped {
    gateway: gateway::config::Config,
}

/// The shipped configuration.
fn config() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../config")
}

const LIMIT: Duration = Duration::from_secs(1200);

/// A state that verbs are tried in.
#[derive(Debug, Clone, Copy)]
enum State {
    OnTheGround,
    InFlight,
    Paused,
    Returning,
    Ended,
}

/// A system in flight and an operator at its gateway.
struct World {
    simulation: Simulation<'static>,
    router: Router,
    runtime: tokio::runtime::Runtime,
    /// What the gateway says of its answers; each is compared with it.
    description: Description,
    keys: u32,
    _closing: watch::Sender<()>,
}

impl World {
    fn new() -> World {
        let config = config();
        let setup =
            Setup { config: &config, mission: None, permissions: Policy::Grant, seed: 1, machine: Machine::Ideal };
        World::of(&setup, |_| ())
    }

    /// The same with another configuration of the gateway.
    fn of(setup: &Setup<'_>, change: impl FnOnce(&mut gateway::config::Config)) -> World {
        let text = entry("anna", &[Role::Operator], "token");
        let tokens = Tokens::parse(&Source { path: "tokens".into(), text }).unwrap();
        let access = AccessControl { tokens, audit: Audit::in_memory() };
        let mut api = None;
        let gateway = |table: &Contingencies| {
            let shipped = include_str!("../../../../config/kittiwake.toml");
            let mut settings = toml::from_str::<Shipped>(shipped).unwrap().gateway;
            change(&mut settings);
            let (gateway, http) = Gateway::new(&settings, Pace::REAL_TIME, access, table, || {});
            api = Some(http);
            gateway
        };
        let simulation = Simulation::with_gateway(setup, gateway).unwrap();
        let (closing, closed) = watch::channel(());
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let router = router(api.unwrap(), closed);
        let request = Request::get("/openapi.json").body(Body::empty()).unwrap();
        let description = runtime.block_on(async {
            let body = router.clone().oneshot(request).await.unwrap().into_body();
            Description::new(serde_json::from_slice(&body.collect().await.unwrap().to_bytes()).unwrap())
        });
        World { simulation, router, runtime, description, keys: 0, _closing: closing }
    }

    /// With command of a vehicle in `state`.
    fn in_state(state: State) -> World {
        let mut world = World::new();
        let begun = if matches!(state, State::OnTheGround) { "step 1 of 5" } else { "step 2 of 5" };
        assert!(world.simulation.fly_until(begun, LIMIT));
        assert_eq!(world.ask("command/take", "").0, 200);
        let (verb, until) = match state {
            State::OnTheGround | State::InFlight => return world,
            State::Paused => ("pause", "`operator_pause`: stop"),
            State::Returning => ("return", "`operator_return`: "),
            State::Ended => ("abort", "mission: over"),
        };
        assert_eq!(world.ask(verb, "").0, 200, "{verb}");
        match state {
            State::Ended => assert!(world.simulation.fly(LIMIT).is_some()),
            _ => assert!(world.simulation.fly_until(until, LIMIT), "{}", world.simulation.decision_log()),
        }
        world
    }

    /// Posts; returns the status, and what happened or why nothing did.
    fn ask(&mut self, path: &str, body: &str) -> (u16, String) {
        let (status, body) = self.send("POST", &format!("/api/v1/vehicles/uav1/{path}"), body);
        let words = body["text"].as_str().or(body["detail"].as_str()).unwrap_or_default();
        (status, words.to_owned())
    }

    /// The answer to a request, which is as described.
    fn send(&mut self, method: &str, path: &str, body: &str) -> (u16, Value) {
        self.keys += 1;
        let request = Request::builder()
            .method(method)
            .uri(path)
            .header("authorization", "Bearer token")
            .header("idempotency-key", self.keys.to_string())
            .body(Body::from(body.to_owned()))
            .unwrap();
        let World { simulation, router, runtime, description, .. } = self;
        let answer = async {
            let response = router.clone().oneshot(request).await.unwrap();
            let status = response.status().as_u16();
            let media_type = response.headers()["content-type"].to_str().unwrap().split(';').next().unwrap().to_owned();
            if media_type == "text/event-stream" {
                return (status, Value::Null);
            }
            let bytes = response.into_body().collect().await.unwrap().to_bytes();
            let body: Value = serde_json::from_slice(&bytes).unwrap_or_default();
            description.check(method, path, status, &media_type, &body);
            (status, body)
        };
        let flying = async {
            loop {
                tokio::task::yield_now().await;
                simulation.pass(Duration::from_millis(10));
            }
        };
        runtime.block_on(async {
            tokio::select! {
                biased;
                answer = answer => answer,
                () = flying => unreachable!("it flies for ever"),
            }
        })
    }
}

/// With the data of a flight in them, in the air and after its end.
#[test]
fn every_document_is_as_described() {
    for state in [State::InFlight, State::Paused, State::Ended] {
        let mut world = World::in_state(state);
        let paths = world.description.paths("get");
        assert!(15 <= paths.len(), "{paths:?}");
        for path in paths {
            let path = path.replace("{id}", "uav1").replace("{recording}", "none").replace("{file}", "main.js");
            let (status, body) = world.send("GET", &path, "");
            assert!(status == 200 || status == 404 || status == 503, "{path}: {status} {body}");
        }
        let text = std::fs::read_to_string(config().join("missions/harbour.toml")).unwrap();
        let body = serde_json::json!({ "text": text }).to_string();
        world.send("POST", "/api/v1/vehicles/uav1/mission/validate", &body);
        world.send("POST", "/api/v1/vehicles/uav1/mission/validate", r#"{"text":"name = 7"}"#);
        let fault = r#"{"name":"wind","args":["5","0"]}"#;
        world.send("POST", "/api/v1/vehicles/uav1/simulation/faults", fault);
    }
}

const HERE: &str = r#"{"position":{"northM":0.0,"eastM":40.0}}"#;
const VERBS: [(&str, &str); 10] = [
    ("start", ""),
    ("pause", ""),
    ("resume", ""),
    ("replan", ""),
    ("return", ""),
    ("land-at", HERE),
    ("abort", ""),
    ("inspected", ""),
    ("contingencies/obstacle/acknowledge", ""),
    ("plan/decision", r#"{"revision":"1","approve":true}"#),
];

/// The answer to each verb in `state`; after each order that was carried out the next one gets a new flight.
#[track_caller]
fn check(state: State, expected: [(u16, &str); 10]) {
    let mut world = World::in_state(state);
    for ((verb, body), (status, words)) in VERBS.into_iter().zip(expected) {
        let answer = world.ask(verb, body);
        assert_eq!((answer.0, answer.1.as_str()), (status, words), "{verb}, {state:?}");
        if status == 200 {
            world = World::in_state(state);
        }
    }
}

const STARTED: (u16, &str) = (409, "the mission has started already");
const NO_HOLD: (u16, &str) = (409, "it does not hold for an operator");
const HOLDS: (u16, &str) = (200, "holds until resumed");
const ANEW: (u16, &str) = (200, "a new plan is made");
const HOME: (u16, &str) = (200, "flies home, lands and ends the mission");
const THERE: (u16, &str) = (200, "flies to (0, 40), lands there and ends the mission");
const DOWN: (u16, &str) = (200, "lands here and ends the mission");
const NO_CRASH: (u16, &str) = (409, "no crash of the vehicle waits for an inspection");
const NO_FLAG: (u16, &str) = (409, "`obstacle` is not up");
const NO_PLAN: (u16, &str) = (409, "no plan waits for approval");

#[test]
fn on_the_ground() {
    let ends = (200, "ends the mission on the ground");
    let stays = (200, "has not lifted off yet: stays, and ends the mission on the ground");
    check(State::OnTheGround, [STARTED, HOLDS, NO_HOLD, ANEW, stays, stays, ends, NO_CRASH, NO_FLAG, NO_PLAN]);
}

#[test]
fn in_flight() {
    check(State::InFlight, [STARTED, HOLDS, NO_HOLD, ANEW, HOME, THERE, DOWN, NO_CRASH, NO_FLAG, NO_PLAN]);
}

#[test]
fn paused() {
    let (twice, on) = ((409, "`operator_pause` is under way already"), (200, "goes on with a new plan"));
    let later = (409, "`operator_pause` is answered; a new plan is made when that is over");
    check(State::Paused, [STARTED, twice, on, later, HOME, THERE, DOWN, NO_CRASH, NO_FLAG, NO_PLAN]);
}

#[test]
fn returning() {
    let under_way = (409, "`operator_return` is under way already");
    let later = (409, "`operator_return` is answered; a new plan is made when that is over");
    let instead =
        "holds until resumed; `operator_return` no longer counts: order it again, or a resume flies the mission on";
    check(
        State::Returning,
        [STARTED, (200, instead), NO_HOLD, later, under_way, THERE, DOWN, NO_CRASH, NO_FLAG, NO_PLAN],
    );
}

#[test]
fn ended() {
    const OVER: (u16, &str) = (409, "the mission is over: `operator_abort`: ordered by anna");
    const NO_NEXT: (u16, &str) =
        (409, "the mission is over: `operator_abort`: ordered by anna; upload the next mission to fly again");
    check(State::Ended, [NO_NEXT, OVER, OVER, OVER, OVER, OVER, OVER, NO_CRASH, NO_FLAG, NO_PLAN]);
}

#[test]
fn a_record_that_cannot_be_written_raises_a_flag_and_decides_nothing() {
    let config = config();
    let setup = Setup { config: &config, mission: None, permissions: Policy::Grant, seed: 1, machine: Machine::Ideal };
    // A file is not a folder.
    let mut world = World::of(&setup, |it| it.recording.folder = Some(config.join("kittiwake.toml/recordings")));
    let raised = "flag `record_unwritable` raised: ground.record_fails true";
    assert!(world.simulation.fly_until(raised, LIMIT), "{}", world.simulation.decision_log());
    let report = world.simulation.fly(LIMIT).expect("the mission ends");
    assert_eq!(report.outcome(), MissionOutcome::Success, "{}", world.simulation.decision_log());
}
