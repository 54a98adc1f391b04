//! What comes in: subscribers, queryables and liveliness, each with a callback that only decodes
//! and hands over.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard};

use kittiwake_proto::topics::{Message, Request, Service, Topic};
use kittiwake_proto::v1::Attachment;
use node::{Event, Node, Token, VehicleId};
use zenoh::query::Query;
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

use crate::clock::monotonic_ns;
use crate::duplicates::DuplicateFilter;
use crate::freshness::{self, Clocks, Late};
use crate::losses::Loss;
use crate::mailbox::{Mail, Mailbox, Slot};
use crate::outbox::goes_directly;
use crate::{BusError, Scope, keys, trace};

/// No message of ours comes near this; one that does is refused before it is decoded.
const MAX_PAYLOAD: usize = 256 * 1024;

/// More requests than this never wait for a node that works.
const MOST_OPEN: usize = 256;

/// Refusals of what came too late begin with this, so that their caller knows them.
pub(crate) const LATE: &str = "late: ";

/// The clocks of the vehicles, kept by zenoh's threads and read by the loop.
#[derive(Clone, Default)]
pub(crate) struct SharedClocks(Arc<Mutex<Clocks>>);

impl SharedClocks {
    /// `said`, a moment of our clock, by the vehicle's; `None` if the vehicle is not heard.
    pub(crate) fn theirs(&self, vehicle: &VehicleId, said: u64) -> Option<u64> {
        self.lock().theirs(vehicle, said, monotonic_ns())
    }

    fn lock(&self) -> MutexGuard<'_, Clocks> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

/// Queries that wait for the node's answer.
#[derive(Clone, Default)]
pub(crate) struct OpenQueries(Arc<Mutex<(u64, BTreeMap<Token, Query>)>>);

impl OpenQueries {
    /// Takes the query out, to be answered.
    pub(crate) fn take(&self, token: Token) -> Option<Query> {
        self.lock().1.remove(&token)
    }

    fn keep(&self, query: Query) -> Token {
        let mut inner = self.lock();
        inner.0 += 1;
        let token = Token(inner.0);
        inner.1.insert(token, query);
        // A node that never answers must not keep queries for ever; a dropped one tells its caller.
        if MOST_OPEN < inner.1.len() {
            inner.1.pop_first();
        }
        token
    }

    fn lock(&self) -> MutexGuard<'_, (u64, BTreeMap<Token, Query>)> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

/// Declares everything the node wants to hear; the declarations live as long as the session.
pub(crate) fn declare(
    session: &Session,
    direct: Option<&Session>,
    scope: &Scope,
    node: &dyn Node,
    mailbox: &Mailbox,
) -> Result<OpenQueries, BusError> {
    let duplicates = DuplicateFilter::default();
    for &topic in node.subscriptions() {
        for session in direct.filter(|_| goes_directly(topic)).into_iter().chain([session]) {
            subscribe(session, scope, topic, &scope.listen(topic.key()), mailbox, &duplicates)?;
        }
        if topic == Topic::Heartbeat && *scope == Scope::Fleet {
            // Ground processes speak for themselves, outside any vehicle's namespace.
            subscribe(session, scope, topic, topic.key(), mailbox, &duplicates)?;
        }
    }
    let queries = OpenQueries::default();
    for &service in node.serves() {
        for session in direct.into_iter().chain([session]) {
            serve(session, scope, service, &queries, mailbox)?;
        }
    }
    Ok(queries)
}

/// Watches who is there; also tells who was there before.
pub(crate) fn watch_peers(session: &Session, scope: &Scope, mailbox: &Mailbox) -> Result<(), BusError> {
    let everyone = keys::alive("*", "*");
    let mut watched = vec![scope.listen(&everyone)];
    if *scope == Scope::Fleet {
        watched.push(everyone);
    }
    for key in watched {
        let (scope, mailbox) = (scope.clone(), mailbox.clone());
        session
            .liveliness()
            .declare_subscriber(&key)
            .history(true)
            .callback(move |sample| {
                let key = sample.key_expr().as_str();
                if let Some((service, instance)) = keys::parse_alive(key) {
                    let vehicle = scope.vehicle_of(key);
                    let (service, instance) = (service.to_owned(), instance.to_owned());
                    let alive = sample.kind() == SampleKind::Put;
                    let slot =
                        Slot::Peer { vehicle: vehicle.clone(), service: service.clone(), instance: instance.clone() };
                    mailbox.push_newest(slot, Mail::Event(Event::Peer { vehicle, service, instance, alive }, None));
                }
            })
            .background()
            .wait()
            .map_err(|cause| BusError::Declare { key: key.clone(), cause: cause.to_string() })?;
    }
    Ok(())
}

/// On the ground: reckons the clocks of all vehicles from their heartbeats.
pub(crate) fn listen_to_clocks(session: &Session, scope: &Scope) -> Result<SharedClocks, BusError> {
    let clocks = SharedClocks::default();
    if *scope == Scope::Fleet {
        let key = scope.listen(Topic::Heartbeat.key());
        let (scope, heard) = (scope.clone(), clocks.clone());
        session
            .declare_subscriber(&key)
            .callback(move |sample| {
                let now = monotonic_ns();
                if let Some(it) = sample.attachment().and_then(|it| trace::read(&it.to_bytes())) {
                    let vehicle = scope.vehicle_of(sample.key_expr().as_str());
                    heard.lock().heard(&vehicle, it.source_monotonic_ns, now);
                }
            })
            .background()
            .wait()
            .map_err(|cause| BusError::Declare { key: key.clone(), cause: cause.to_string() })?;
    }
    Ok(clocks)
}

fn subscribe(
    session: &Session,
    scope: &Scope,
    topic: Topic,
    key: &str,
    mailbox: &Mailbox,
    duplicates: &DuplicateFilter,
) -> Result<(), BusError> {
    let (scope, mailbox, duplicates) = (scope.clone(), mailbox.clone(), duplicates.clone());
    session
        .declare_subscriber(key)
        .callback(move |sample| {
            let key = sample.key_expr().as_str();
            let payload = sample.payload();
            if MAX_PAYLOAD < payload.len() {
                return refuse(&mailbox, key, &format!("{} bytes, at most {MAX_PAYLOAD} expected", payload.len()));
            }
            let attachment = match topic.qos().keeps_newest_only() {
                true => Attachment::default(),
                false => sample.attachment().and_then(|it| trace::read(&it.to_bytes())).unwrap_or_default(),
            };
            let payload = payload.to_bytes();
            let message = match Message::decode(topic, &payload) {
                Ok(message) => message,
                Err(malformed) => return refuse(&mailbox, key, &malformed.cause),
            };
            let vehicle = scope.vehicle_of(key);
            if topic.qos().keeps_newest_only() {
                let event = Event::Message { vehicle: vehicle.clone(), message };
                mailbox.push_newest(Slot::Sample(vehicle, topic), Mail::Event(event, None));
            } else {
                if let Err(late) = in_time(&scope, attachment.said_receiver_monotonic_ns) {
                    return refuse_late(&mailbox, key, late);
                }
                // Last: what is refused is no first copy.
                if !duplicates.is_first(key, &attachment, &payload) {
                    return;
                }
                let parent = Some(attachment.traceparent).filter(|it| !it.is_empty());
                if !mailbox.push_from(key, Mail::Event(Event::Message { vehicle, message }, parent)) {
                    dropped(&mailbox, key);
                }
            }
        })
        .background()
        .wait()
        .map_err(|cause| BusError::Declare { key: key.to_owned(), cause: cause.to_string() })
}

fn serve(
    session: &Session,
    scope: &Scope,
    service: Service,
    queries: &OpenQueries,
    mailbox: &Mailbox,
) -> Result<(), BusError> {
    let key = scope.listen(service.key());
    let (scope, mailbox, queries) = (scope.clone(), mailbox.clone(), queries.clone());
    session
        .declare_queryable(&key)
        .complete(true)
        .callback(move |query| {
            let key = query.key_expr().as_str().to_owned();
            let payload = query.payload().map(|it| it.to_bytes().into_owned()).unwrap_or_default();
            if MAX_PAYLOAD < payload.len() {
                return refuse_query(&mailbox, query, &format!("{} bytes, at most {MAX_PAYLOAD}", payload.len()));
            }
            let request = match Request::decode(service, &payload) {
                Ok(request) => request,
                Err(malformed) => return refuse_query(&mailbox, query, &malformed.cause),
            };
            let attachment = query.attachment().and_then(|it| trace::read(&it.to_bytes())).unwrap_or_default();
            if let Err(late) = in_time(&scope, attachment.said_receiver_monotonic_ns) {
                refuse_late(&mailbox, &key, late);
                let _ = query.reply_err(format!("{LATE}{late}")).wait();
                return;
            }
            let parent = Some(attachment.traceparent).filter(|it| !it.is_empty());
            let token = queries.keep(query);
            let event = Event::Request { vehicle: scope.vehicle_of(&key), token, request };
            if !mailbox.push_from(&key, Mail::Event(event, parent)) {
                dropped(&mailbox, &key);
                // Dropping the query tells the caller at once that nobody answers.
                drop(queries.take(token));
            }
        })
        .background()
        .wait()
        .map_err(|cause| BusError::Declare { key: key.clone(), cause: cause.to_string() })
}

/// Whether something may be obeyed. Only what comes from the ground is stamped, and by a vehicle's clock only.
fn in_time(scope: &Scope, said: u64) -> Result<(), Late> {
    match scope {
        Scope::Vehicle(_) => freshness::check(said, monotonic_ns()),
        Scope::Fleet => Ok(()),
    }
}

fn refuse_late(mailbox: &Mailbox, key: &str, late: Late) {
    if let Some(it) = mailbox.lose(Loss::Late, key) {
        tracing::warn!(key = it.sender, count = it.count, %late, "not obeyed; further ones are counted for a while");
    }
}

fn refuse(mailbox: &Mailbox, key: &str, why: &str) {
    if let Some(it) = mailbox.lose(Loss::Malformed, key) {
        tracing::warn!(key = it.sender, count = it.count, why, "message refused; further ones are counted for a while");
    }
}

fn dropped(mailbox: &Mailbox, key: &str) {
    if let Some(it) = mailbox.lose(Loss::Dropped, key) {
        tracing::error!(
            key = it.sender,
            count = it.count,
            "too many at once: dropped; further ones are counted for a while"
        );
    }
}

fn refuse_query(mailbox: &Mailbox, query: Query, why: &str) {
    refuse(mailbox, query.key_expr().as_str(), why);
    let _ = query.reply_err(why.to_owned()).wait();
}
