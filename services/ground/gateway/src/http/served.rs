//! A gateway with uav1 whose routes a test asks without a network, and whose parts it reaches.

use std::os::unix::fs::PermissionsExt as _;
use std::path::PathBuf;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::http::Request;
use axum::http::request::Builder;
use axum::response::Response;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use node::{Event, Node as _};
use tokio::sync::watch;
use tower::ServiceExt as _;

use crate::access::{Identity, Role, Tokens, entry};
use crate::audit::Audit;
use crate::http::{Api, router};
use crate::{AccessControl, Gateway};

/// Who only watches, and who may order: their names, and their tokens.
pub(crate) const WATCHER: &str = "eve";
pub(crate) const OPERATOR: &str = "anna";

pub(crate) struct Served {
    pub(crate) api: Api,
    /// Dropping it ends the streams.
    pub(crate) closing: watch::Sender<()>,
    gateway: Gateway,
    router: Router,
    now: Now,
    tokens: PathBuf,
    _folder: tempfile::TempDir,
}

fn entry_of(name: &str) -> String {
    entry(name, &[if name == WATCHER { Role::Observer } else { Role::Operator }], name)
}

impl Served {
    /// With changes to the configuration of the tests.
    pub(crate) fn new(changes: &[(&str, &str)]) -> Served {
        let change = |config: String, (from, to): &(&str, &str)| {
            assert!(config.contains(from), "{from}");
            config.replace(from, to)
        };
        let config = changes.iter().fold(include_str!("../../tests/world/config.toml").to_owned(), change);
        let folder = tempfile::tempdir().unwrap();
        let tokens = folder.path().join("tokens.toml");
        std::fs::write(&tokens, entry_of(WATCHER) + &entry_of(OPERATOR)).unwrap();
        std::fs::set_permissions(&tokens, std::fs::Permissions::from_mode(0o600)).unwrap();
        let access = AccessControl { tokens: Tokens::read(&tokens).unwrap(), audit: Audit::in_memory() };
        let (gateway, api) =
            Gateway::new(&toml::from_str(&config).unwrap(), Pace::REAL_TIME, access, &Default::default(), || {});
        let (closing, closed) = watch::channel(());
        let (router, now) = (router(api.clone(), closed), Now { time: Time::ZERO, utc_ms: 0 });
        let mut served = Served { api, closing, gateway, router, now, tokens, _folder: folder };
        served.say(v1::VehicleStatus::default());
        served
    }

    /// uav1 publishes a message; a second passes.
    pub(crate) fn say(&mut self, message: impl Into<Message>) {
        self.now.time = self.now.time + Duration::from_secs(1);
        let event = Event::Message { vehicle: "uav1".into(), message: message.into() };
        self.gateway.on(self.now, event, &mut Vec::new());
        self.gateway.act(self.now, &mut Vec::new());
    }

    pub(crate) async fn get(&self, path: &str, who: &str) -> Response {
        self.send("GET", path, who).await
    }

    pub(crate) async fn send(&self, method: &str, path: &str, who: &str) -> Response {
        self.ask(Request::builder().method(method).uri(path), who).await
    }

    pub(crate) async fn ask(&self, request: Builder, who: &str) -> Response {
        let request = request.header("authorization", format!("bearer {who}"));
        self.router.clone().oneshot(request.body(Body::empty()).unwrap()).await.unwrap()
    }

    /// Who has this token.
    pub(crate) fn identity(&self, token: &str) -> Identity {
        self.api.tokens.get().identify(token, 0).unwrap().clone()
    }

    /// The token of one of the two is not valid any more.
    pub(crate) fn take_token_from(&self, name: &str) {
        let other = if name == WATCHER { OPERATOR } else { WATCHER };
        std::fs::write(&self.tokens, entry_of(other)).unwrap();
        // A change counts when it is seen twice.
        self.api.tokens.look();
        self.api.tokens.look();
    }
}
