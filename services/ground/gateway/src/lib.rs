//! HTTP for the operator: each vehicle's live state as JSON, and what happens as an event stream.
//!
//! Two halves that meet in two `watch` channels. [`Gateway`] is a node like any other: it folds
//! what arrives into the state of each vehicle and is the only writer. The HTTP half, [`http`],
//! reads: the newest [`state::Snapshot`], and the [`journal`] of what happened. A client, however
//! slow or many, never holds up the loop.
//!
//! What an operator orders goes the other way through a bounded channel (`orders`): the node makes
//! a call of it, and the answer goes back to whoever asked. Everybody needs a token ([`access`]), and
//! every order leaves a record ([`audit`]).

use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::Topic;
use node::{Effect, Event, Node};
use tokio::net::TcpListener;
use tokio::sync::watch;

use crate::access::Tokens;
use crate::audit::Audit;
use crate::config::Config;
use crate::contact::Contacts;
use crate::helm::Helms;
use crate::http::Api;
use crate::journal::Journals;
use crate::orders::{Desk, Wish};
use crate::recording::Recorder;
use crate::server::Entrance;
use crate::state::{Fleet, Snapshot};
use crate::view::Ages;

pub mod access;
pub mod audit;
mod commands;
pub mod config;
mod contact;
pub mod events;
pub mod flags;
mod guard;
pub mod helm;
pub mod http;
pub mod journal;
pub mod limit;
mod metrics;
pub mod occurrence;
mod orders;
pub mod page;
pub mod problem;
pub mod process;
pub mod readiness;
pub mod recording;
pub mod routes;
mod server;
pub mod skills;
pub mod state;
mod status;
pub mod tls;
mod trace;
pub mod view;

/// The half that listens to the fleet.
pub struct Gateway {
    fleet: Fleet,
    snapshot: watch::Sender<Arc<Snapshot>>,
    journals: watch::Sender<Journals>,
    /// Mission time between two snapshots: while things arrive, and while nothing does.
    busy_period: Duration,
    idle_period: Duration,
    last_snapshot: Option<Time>,
    changed: bool,
    desk: Desk,
    contacts: Contacts,
    recorder: Recorder,
}

/// What is shared by everybody who comes in.
pub struct Door {
    /// Who is let in.
    pub tokens: Tokens,
    /// Where orders are recorded.
    pub audit: Audit,
    /// Where missions are recorded; nowhere, if `None`.
    pub recordings: Option<PathBuf>,
}

impl Gateway {
    /// A gateway that has seen nothing, and the half to serve with [`serve`]. `wake` has the node act
    /// soon: HTTP calls it when there is something to do.
    pub fn new(config: &Config, pace: Pace, door: Door, wake: impl Fn() + Send + Sync + 'static) -> (Gateway, Api) {
        // Shorter than HTTP's own patience, so that its caller learns what became of the call.
        let patience = config.request_timeout_s.seconds().mul_f64(0.6);
        let (orders, desk) = orders::channel(pace.wall(patience), wake);
        let (snapshot, snapshots) = watch::channel(Arc::default());
        let (journals, histories) = watch::channel(Journals::new(usize::from(config.history_records.get())));
        let (recorder, recordings) = Recorder::start(&config.recording, door.recordings, pace);
        // Heartbeats keep to the wall clock, so the limit on their absence does too.
        let ages = Ages { pace, stale_after: pace.wall(config.heartbeat_stale_s.seconds()) };
        let gateway = Gateway {
            fleet: Fleet::default(),
            snapshot,
            journals,
            busy_period: pace.wall(config.snapshot_rate_hz.period()),
            idle_period: pace.wall(config.status_rate_hz.period()),
            last_snapshot: None,
            changed: false,
            desk,
            contacts: Contacts::new(pace),
            recorder,
        };
        let api = Api {
            config: config.clone(),
            ages,
            snapshot: snapshots,
            journals: histories,
            tokens: Arc::new(door.tokens),
            audit: Arc::new(door.audit),
            helms: Arc::new(Helms::new(config.command_lease_s.seconds())),
            orders,
            recordings,
            statuses: Arc::default(),
        };
        (gateway, api)
    }

    /// When the next snapshot is due.
    fn due(&self) -> Time {
        let period = if self.changed { self.busy_period } else { self.idle_period };
        self.last_snapshot.map_or(Time::ZERO, |last| last + period)
    }
}

impl Node for Gateway {
    fn name(&self) -> &'static str {
        "gateway"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[
            Topic::VehicleStatus,
            Topic::Introspection,
            Topic::SkillEvent,
            Topic::SkillFeedback,
            Topic::FlagEvent,
            Topic::PermissionLedger,
            Topic::PlannerStatus,
            Topic::McmStatus,
            Topic::DecisionRecord,
            Topic::TreeSnapshot,
            Topic::TransponderReport,
            Topic::WindEstimate,
            Topic::Heartbeat,
        ]
    }

    fn on(&mut self, now: Now, event: Event, _: &mut Vec<Effect>) {
        let event = match event {
            Event::Reply { call, result } => return self.desk.answered(call, result),
            event => event,
        };
        if let Event::Message { vehicle, message } = &event {
            self.contacts.hear(now.time, vehicle, message);
            self.recorder.heard(now, vehicle, message);
        }
        let mut happened = Vec::new();
        self.fleet.fold(now, event, &mut happened);
        self.changed = true;
        for (vehicle, occurrence) in happened {
            let data = view::occurrence(now, &occurrence).to_string();
            self.journals.send_modify(|it| it.push(now.utc_ms, &vehicle, occurrence.kind(), data));
        }
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        while let Some(wish) = self.desk.next() {
            match wish {
                Wish::Call { vehicle, request, trace, answer } => {
                    effects.push(self.desk.call(vehicle, request, trace, answer));
                }
                Wish::Publish { vehicle, message } => {
                    // The bus does not bring back to a node what it said itself.
                    self.on(now, Event::Message { vehicle: vehicle.clone(), message: message.clone() }, effects);
                    effects.push(Effect::Publish { vehicle: Some(vehicle), message });
                }
                Wish::Tell { vehicle, kind, record } => {
                    let data = view::stamped(now, record).to_string();
                    self.journals.send_modify(|it| it.push(now.utc_ms, &vehicle, kind, data));
                }
            }
        }
        self.contacts.tell(now.time, &self.fleet.vehicles, effects);
        self.recorder.tick(now);
        if self.due() <= now.time {
            self.snapshot.send_replace(Arc::new(Snapshot { fleet: self.fleet.clone(), now }));
            self.last_snapshot = Some(now.time);
            self.changed = false;
        }
    }

    fn deadline(&self) -> Option<Time> {
        Some(self.due().min(self.contacts.due()))
    }
}

/// Answers on `listener` until `shutdown` completes; open event streams are then ended. Connections are
/// encrypted with `tls`, if there is any.
///
/// # Errors
/// When the listener fails for good.
pub async fn serve(
    listener: TcpListener,
    tls: Option<Arc<rustls::ServerConfig>>,
    api: Api,
    shutdown: impl Future<Output = ()> + Send + 'static,
) -> io::Result<()> {
    let (close, closing) = watch::channel(());
    let entrance = Entrance {
        tls,
        head_limit: api.config.head_timeout_s.seconds(),
        most: usize::from(api.config.max_connections.get()),
    };
    let router = http::router(api, closing);
    let stopping = async move {
        shutdown.await;
        drop(close);
    };
    server::serve(listener, router, entrance, stopping).await
}

#[cfg(test)]
mod tests {
    use super::*;
    use kittiwake_proto::v1;

    const CONFIG: &str = "
        snapshot_rate_hz = 20.0
        status_rate_hz = 2.0
        heartbeat_stale_s = 2.0
        history_records = 8
        max_event_streams = 2
        request_timeout_s = 5.0
        max_body_bytes = 1000
        requests_per_s = 50.0
        requests_at_once = 100.0
        command_lease_s = 60.0
        simulation = true
        max_connections = 10
        head_timeout_s = 5.0
        [recording]
        most_files = 0
        most_total_mb = 1
        most_each_mb = 1
        flush_s = 1.0
        most_hz = {}
    ";

    /// Counts the snapshots of ten wall seconds at `speed`, with a message every ten wall milliseconds or none.
    #[track_caller]
    fn check(speed: f64, messages: bool, expected: usize) {
        let pace = Pace::new(speed).unwrap();
        let door = Door { tokens: Tokens::default(), audit: Audit::in_memory(), recordings: None };
        let (mut gateway, api) = Gateway::new(&toml::from_str(CONFIG).unwrap(), pace, door, || {});
        let mut snapshots = api.snapshot.clone();
        let mut count = 0;
        for tick in 0..1000 {
            let now = Now { time: Time::after(pace.wall(Duration::from_millis(10 * tick))), utc_ms: 0 };
            if messages {
                let message = v1::Introspection::default().into();
                gateway.on(now, Event::Message { vehicle: "uav1".into(), message }, &mut Vec::new());
            }
            gateway.act(now, &mut Vec::new());
            count += usize::from(snapshots.has_changed().unwrap());
            snapshots.mark_unchanged();
        }
        assert_eq!(count, expected);
    }

    #[test]
    fn snapshots_keep_to_the_wall_clock_and_go_on_when_nothing_arrives() {
        check(1.0, true, 200);
        check(20.0, true, 200);
        check(1.0, false, 20);
        check(20.0, false, 20);
    }
}
