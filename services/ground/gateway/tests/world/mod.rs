//! A gateway whose loop runs in a thread of its own; the test plays the services that it calls.

#![expect(clippy::disallowed_methods, reason = "a test waits for what other threads do, up to a limit")]
#![expect(unreachable_pub, reason = "no other crate uses a test: here `pub` means outside of the module")]

use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, SystemTime};

use axum::Router;
use axum::body::Body;
use axum::http::{Request, StatusCode};
use domain::file::Source;
use domain::time::{Now, Pace};
use gateway::access::{Role, Tokens, entry};
use gateway::audit::Audit;
use gateway::config::Config;
use gateway::http::{Api, router};
use gateway::{AccessControl, Gateway};
use http_body_util::BodyExt as _;
use kittiwake_proto::topics::{Message, Request as Call, Response};
use kittiwake_proto::v1;
use node::{CallError, Effect, Event, Node};
use serde_json::Value;
use tokio::sync::watch;
use tower::ServiceExt as _;

pub mod certificates;
pub mod description;

use crate::stories::world::description::Description;

pub const CONFIG: &str = include_str!("config.toml");

/// A file in the folder of the recordings that is not a recording.
pub const RECORDING: &str = "not-a-recording";

/// For how long the token `brief-token` is valid, from a second less.
const BRIEF: Duration = Duration::from_secs(4);

/// Plays the services: gets a call with its trace, and returns the reply.
type Play = Box<dyn FnMut(&Call, &str) -> Result<Response, CallError> + Send>;

enum Input {
    Nudge,
    Say(Message),
}

pub struct World {
    pub router: Router,
    /// To serve on a socket.
    pub api: Api,
    inputs: Sender<Input>,
    /// What the gateway says of its answers; each is compared with it.
    description: tokio::sync::OnceCell<Description>,
    /// The keys of what reached the bus: calls, and messages published.
    pub heard: Arc<Mutex<Vec<String>>>,
    /// The folder of the recordings.
    pub recordings: tempfile::TempDir,
    _closing: watch::Sender<()>,
}

pub struct Answer {
    pub status: StatusCode,
    pub body: Value,
    pub text: String,
}

impl World {
    /// With uav1 seen, whose services carry out every order.
    pub fn new() -> World {
        World::playing(CONFIG, Box::new(|call, _| Ok(obedient(call))))
    }

    /// With services that reply as `play` does.
    pub fn with(play: impl FnMut(&Call, &str) -> Result<Response, CallError> + Send + 'static) -> World {
        World::playing(CONFIG, Box::new(play))
    }

    /// With one change to the configuration.
    pub fn configured(from: &str, to: &str) -> World {
        assert!(CONFIG.contains(from), "{from}");
        World::playing(&CONFIG.replace(from, to), Box::new(|call, _| Ok(obedient(call))))
    }

    /// With one change, and services that reply as `play` does.
    pub fn configured_and_playing(
        from: &str,
        to: &str,
        play: impl FnMut(&Call, &str) -> Result<Response, CallError> + Send + 'static,
    ) -> World {
        assert!(CONFIG.contains(from), "{from}");
        World::playing(&CONFIG.replace(from, to), Box::new(play))
    }

    /// With several changes.
    pub fn configured_with(changes: &[(&str, &str)]) -> World {
        let change = |config: String, (from, to): &(&str, &str)| {
            assert!(config.contains(from), "{from}");
            config.replace(from, to)
        };
        World::playing(&changes.iter().fold(CONFIG.to_owned(), change), Box::new(|call, _| Ok(obedient(call))))
    }

    fn playing(config: &str, mut play: Play) -> World {
        let mut config: Config = toml::from_str(config).unwrap();
        let entries = Role::ALL.map(|it| entry(it.name(), &[it], &format!("{}-token", it.name())));
        let text = format!("{}{}", entries.concat(), entry("ben", &[Role::Operator], "ben-token"));
        let expiring = |name: &str, at: &str| {
            entry(name, &Role::ALL, &format!("{name}-token")) + &format!("expires_utc = \"{at}\"\n")
        };
        let soon = humantime::format_rfc3339_seconds(SystemTime::now() + BRIEF).to_string();
        let text = [text, expiring("old", "2020-01-01T00:00:00Z"), expiring("brief", &soon)].concat();
        let tokens = Tokens::parse(&Source { path: "tokens".into(), text }).unwrap();
        let (inputs, received) = channel();
        let nudge = inputs.clone();
        let wake = move || {
            let _ = nudge.send(Input::Nudge);
        };
        let recordings = tempfile::tempdir().unwrap();
        std::fs::write(recordings.path().join(format!("{RECORDING}.mcap")), "not at all").unwrap();
        config.recording.folder = Some(recordings.path().to_owned());
        let access = AccessControl { tokens, audit: Audit::in_memory() };
        let (mut gateway, api) = Gateway::new(&config, Pace::REAL_TIME, access, &Default::default(), wake);
        let (closing, closed) = watch::channel(());
        let router = router(api.clone(), closed);
        let heard = Arc::new(Mutex::new(Vec::new()));
        let log = heard.clone();
        let mut turn = move |input: Input, now: Now| {
            let mut effects = Vec::new();
            if let Input::Say(message) = input {
                gateway.on(now, Event::Message { vehicle: "uav1".into(), message }, &mut effects);
            }
            gateway.act(now, &mut effects);
            for effect in effects {
                match effect {
                    Effect::Call { call, request, trace, vehicle, .. } => {
                        assert_eq!(vehicle.as_deref(), Some("uav1"));
                        log.lock().unwrap().push(request.service().key().to_owned());
                        let result = play(&request, trace.as_deref().unwrap_or("none"));
                        gateway.on(now, Event::Reply { call, result }, &mut Vec::new());
                    }
                    // Published whether or not something is ordered.
                    Effect::Publish { message: Message::GroundContact(_), .. } => {}
                    Effect::Publish { message, .. } => log.lock().unwrap().push(message.topic().key().to_owned()),
                    Effect::Reply { .. } => panic!("the gateway serves nothing"),
                    Effect::Refused { what, why } => panic!("refused {what:?}: {why}"),
                }
            }
        };
        turn(Input::Say(v1::VehicleStatus::default().into()), Now::default());
        std::thread::spawn(move || {
            let mut now = Now::default();
            while let Ok(input) = received.recv() {
                now.time = now.time + Duration::from_millis(100);
                turn(input, now);
            }
        });
        World { router, api, inputs, description: Default::default(), heard, recordings, _closing: closing }
    }

    /// uav1 publishes a message.
    pub fn say(&self, message: impl Into<Message>) {
        self.inputs.send(Input::Say(message.into())).unwrap();
    }

    pub async fn get(&self, path: &str, token: &str) -> Answer {
        self.send("GET", path, token, "", "").await
    }

    /// Posts without a body, under a key.
    pub async fn post(&self, path: &str, token: &str, key: &str) -> Answer {
        self.send("POST", path, token, key, "").await
    }

    pub async fn send(&self, method: &str, path: &str, token: &str, key: &str, body: &str) -> Answer {
        let mut request = Request::builder().method(method).uri(path);
        for (name, value) in [("authorization", token), ("idempotency-key", key)] {
            let value = if name == "authorization" { format!("Bearer {value}-token") } else { value.to_owned() };
            if value != "Bearer -token" && !value.is_empty() {
                request = request.header(name, value);
            }
        }
        self.request(request.body(Body::from(body.to_owned())).unwrap()).await
    }

    pub async fn request(&self, request: Request<Body>) -> Answer {
        let (method, path) = (request.method().to_string(), request.uri().path().to_owned());
        let (media_type, answer) = self.answer(request).await;
        let description = self.description.get_or_init(|| async {
            let request = Request::get("/openapi.json").body(Body::empty()).unwrap();
            Description::new(self.answer(request).await.1.body)
        });
        description.await.check(&method, &path, answer.status.as_u16(), &media_type, &answer.body);
        answer
    }

    async fn answer(&self, request: Request<Body>) -> (String, Answer) {
        let response = self.router.clone().oneshot(request).await.unwrap();
        let status = response.status();
        let media_type = response.headers().get("content-type").and_then(|it| it.to_str().ok()).unwrap_or_default();
        let media_type = media_type.split(';').next().unwrap_or_default().to_owned();
        if media_type == "text/event-stream" {
            return (media_type, Answer { status, body: Value::Null, text: String::new() });
        }
        let bytes = response.into_body().collect().await.unwrap().to_bytes();
        let text = String::from_utf8_lossy(&bytes).into_owned();
        (media_type, Answer { status, body: serde_json::from_str(&text).unwrap_or(Value::Null), text })
    }

    /// The same, once there is something: a published message leaves after its answer.
    pub async fn heard_at_last(&self) -> Vec<String> {
        let limit = std::time::Instant::now() + std::time::Duration::from_secs(20);
        loop {
            let heard = self.heard();
            if !heard.is_empty() || limit <= std::time::Instant::now() {
                return heard;
            }
            tokio::task::yield_now().await;
        }
    }

    pub fn heard(&self) -> Vec<String> {
        std::mem::take(&mut self.heard.lock().unwrap())
    }
}

/// The reply of a service that carries out the order.
pub fn obedient(call: &Call) -> Response {
    match call {
        Call::OperatorCommand(_) => Response::OperatorCommand(v1::OperatorReply { done: true, text: "done".into() }),
        Call::Mission(_) => Response::Mission(v1::MissionReply {
            accepted: true,
            status: Some(v1::MissionStatus::default()),
            ..Default::default()
        }),
        Call::Decide(_) => Response::Decide(v1::DecideReply { accepted: true, ..Default::default() }),
        Call::AcceptLoss(_) => Response::AcceptLoss(v1::AcceptLossReply { accepted: true, ..Default::default() }),
        Call::SiteReport(_) => Response::SiteReport(v1::SiteReportReply { accepted: true, ..Default::default() }),
        Call::Fault(_) => {
            Response::Fault(v1::FaultReply { accepted: true, detail: "done".into(), ..Default::default() })
        }
        other => panic!("the gateway does not call {other:?}"),
    }
}
