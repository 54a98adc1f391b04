//! HTTP for operators: each vehicle's live state as JSON, its events as a stream, and orders.
//!
//! It has two halves, connected by two `watch` channels. [`Gateway`] is a node like any other: it
//! folds messages into the state of each vehicle, and is the only writer. The HTTP half, [`http`],
//! reads the newest snapshot and the journal of events. Neither a slow client nor a thousand of
//! them delay the node's loop.
//!
//! Orders go the other way, through a bounded channel: the node makes a call of each order and
//! hands the reply back. Every client needs a token ([`access`]), and every order leaves an audit
//! record ([`audit`]).

use std::sync::Arc;
use std::time::Duration;

use domain::contingency::Contingencies;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Message, Topic};
use node::{Effect, Event, Node, VehicleId};
use tokio::sync::watch;

use crate::access::{CurrentTokens, Tokens};
use crate::audit::Audit;
use crate::config::Config;
use crate::contact::GroundContacts;
use crate::fleet::occurrence::Occurrence;
use crate::fleet::{FleetState, Snapshot};
use crate::http::command_authority::CommandAuthorities;
use crate::http::documents::Documents;
use crate::http::standstill::Standstill;
use crate::http::{Api, session};
use crate::journal::Journals;
use crate::orders::{Order, OrderReceiver};
use crate::recording::Recorder;
use crate::recording::refill::{Past, Refill};
use crate::view::Ages;

pub mod access;
pub mod audit;
pub mod config;
mod connection;
mod contact;
mod file_watch;
mod fleet;
pub mod http;
mod in_place;
mod journal;
mod orders;
pub mod process;
pub mod recorded;
mod recording;
mod seats;
pub mod server;
mod shares;
pub mod sockets;
pub mod tls;
mod view;

/// The half that listens to the fleet.
pub struct Gateway {
    fleet: FleetState,
    snapshot: watch::Sender<Arc<Snapshot>>,
    journals: watch::Sender<Journals>,
    /// Mission time between two snapshots while messages arrive, and while none do.
    busy_period: Duration,
    idle_period: Duration,
    last_snapshot: Option<Time>,
    changed: bool,
    orders: OrderReceiver,
    contacts: GroundContacts,
    recorder: Recorder,
    refill: Refill,
    /// What waits to be recorded is written before the gateway ends, which ends the threads that answer requests first.
    audit: Arc<Audit>,
}

/// Who may do what, and where orders are recorded.
pub struct AccessControl {
    /// The tokens that are valid at the start; those that were read from a file are replaced with it.
    pub tokens: Tokens,
    /// Where orders are recorded.
    pub audit: Audit,
}

impl Gateway {
    /// A gateway that has seen nothing, and its HTTP half. Clients receive the thresholds of `contingencies`, most
    /// urgent first. HTTP calls `wake` when there is an order, so that the node handles it soon.
    pub fn new(
        config: &Config,
        pace: Pace,
        access: AccessControl,
        contingencies: &Contingencies,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> (Gateway, Api) {
        // Shorter than the limit of the request itself, so that the client gets the outcome of the call.
        let call_timeout = config.request_timeout_s.seconds().mul_f64(0.6);
        let (sender, receiver) = orders::channel(pace.wall(call_timeout), wake);
        let (snapshot, snapshots) = watch::channel(Arc::default());
        let capacity = usize::from(config.history_records.get());
        let (journals, histories) = watch::channel(Journals::new(capacity));
        let refill = Refill::start(config.recording.folder.clone(), pace, capacity);
        let (recorder, recordings) = Recorder::start(&config.recording, pace);
        let ages = Ages {
            pace,
            // Heartbeats keep to the wall clock, so the limit on their absence does too.
            stale_after: pace.wall(config.heartbeat_stale_s.seconds()),
            status_period: config.status_rate_hz.period(),
        };
        let gateway = Gateway {
            fleet: FleetState::default(),
            snapshot,
            journals,
            busy_period: pace.wall(config.snapshot_rate_hz.period()),
            idle_period: pace.wall(config.status_rate_hz.period()),
            last_snapshot: None,
            changed: false,
            orders: receiver,
            contacts: GroundContacts::new(pace),
            recorder,
            refill,
            audit: Arc::new(access.audit),
        };
        let api = Api {
            config: config.clone(),
            of_table: session::of_table(contingencies).into(),
            ages,
            snapshot: snapshots,
            journals: histories,
            tokens: Arc::new(CurrentTokens::new(access.tokens)),
            audit: gateway.audit.clone(),
            authorities: Arc::new(CommandAuthorities::new(config.command_lease_s.seconds())),
            orders: sender,
            recordings,
            statuses: Arc::default(),
            documents: Arc::new(Documents::start()),
            standstill: Standstill::default(),
            certificate: None,
        };
        (gateway, api)
    }

    fn journal(&self, now: Now, vehicle: &VehicleId, occurrence: &Occurrence) {
        let mission_time_s = self.fleet.vehicles.get(vehicle).and_then(|it| it.mission_time_s(now.time));
        self.journals.send_modify(|journals| journals.push(now, mission_time_s, vehicle, occurrence));
    }

    /// Takes in what an earlier gateway has recorded of a mission that is still flown.
    fn go_on_from(&mut self, past: Past) {
        let Past { vehicle, state, journals: before } = past;
        let is_same = self.fleet.vehicles.get_mut(&vehicle).and_then(|it| it.go_on_from(state)).is_some();
        if is_same {
            self.journals.send_modify(|journals| journals.go_on_from(&vehicle, before));
            self.changed = true;
        }
    }

    /// When the next snapshot is due.
    fn due(&self) -> Time {
        let period = if self.changed { self.busy_period } else { self.idle_period };
        self.last_snapshot.map_or(Time::ZERO, |last| last + period)
    }
}

impl Drop for Gateway {
    fn drop(&mut self) {
        self.audit.close();
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
            Topic::PermissionLedger,
            Topic::MissionStatus,
            Topic::McmStatus,
            Topic::DecisionRecord,
            Topic::TreeSnapshot,
            Topic::TransponderReport,
            Topic::WindEstimate,
            Topic::Picture,
            Topic::Heartbeat,
        ]
    }

    fn on(&mut self, now: Now, event: Event, _: &mut Vec<Effect>) {
        let event = match event {
            Event::Reply { call, result } => return self.orders.replied(call, result),
            event => event,
        };
        if let Event::Message { vehicle, message } = &event {
            self.contacts.on_message(now.time, vehicle, message);
            self.recorder.on_message(now, vehicle, message);
        }
        let mut occurrences = Vec::new();
        if let Event::Message { vehicle, message: Message::McmStatus(status) } = &event
            && status.began_utc_ms != 0
        {
            self.refill.on_mission(vehicle, status.began_utc_ms);
        }
        self.fleet.fold(now, event, &mut occurrences);
        self.changed = true;
        for (vehicle, occurrence) in occurrences {
            self.journal(now, &vehicle, &occurrence);
        }
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        while let Some(order) = self.orders.next() {
            match order {
                Order::Call { vehicle, request, trace, reply_to } => {
                    effects.push(self.orders.call(vehicle, request, trace, reply_to));
                }
                Order::Publish { vehicle, message } => {
                    // The bus does not bring a node's own messages back to it.
                    self.on(now, Event::Message { vehicle: vehicle.clone(), message: message.clone() }, effects);
                    effects.push(Effect::Publish { vehicle: Some(vehicle), message });
                }
                Order::Journal { vehicle, occurrence } => self.journal(now, &vehicle, &occurrence),
            }
        }
        while let Some(past) = self.refill.next() {
            self.go_on_from(past);
        }
        self.contacts.publish_due(now.time, &self.fleet.vehicles, || self.recorder.trouble(), effects);
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

#[cfg(test)]
mod tests {
    use super::*;
    use kittiwake_proto::v1;

    const CONFIG: &str = include_str!("../tests/world/config.toml");

    /// Counts the snapshots of ten wall seconds at `speed`, with a message every ten wall milliseconds or none.
    #[track_caller]
    fn check(speed: f64, messages: bool, expected: usize) {
        let pace = Pace::new(speed).unwrap();
        let access = AccessControl { tokens: Tokens::default(), audit: Audit::in_memory() };
        let (mut gateway, api) =
            Gateway::new(&toml::from_str(CONFIG).unwrap(), pace, access, &Default::default(), || {});
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

// The stories use this crate as others do, in the program of its unit tests: one program links faster than two.
#[cfg(test)]
extern crate self as gateway;
#[cfg(test)]
#[path = "../tests/main.rs"]
mod stories;
