//! What comes in: subscribers, queryables and liveliness, each with a callback that only decodes
//! and hands over.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard};

use kittiwake_proto::topics::{Message, Request, Service, Topic};
use kittiwake_proto::v1::Attachment;
use node::{Event, Node, Token, VehicleId};
use zenoh::pubsub::Subscriber;
use zenoh::query::{Query, Queryable};
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

use crate::calls::Outcome;
use crate::clock::monotonic_ns;
use crate::duplicates::DuplicateFilter;
use crate::freshness::{self, Clocks, Late};
use crate::losses::Loss;
use crate::mailbox::{Mail, Mailbox, Slot};
use crate::{BusError, Scope, keys, trace};

/// No message of ours comes near this, but for [`MAX_STATUS_PAYLOAD`] and [`MAX_MISSION_PAYLOAD`]; one that does is refused before it is
/// decoded.
const MAX_PAYLOAD: usize = 256 * 1024;
/// The planner's status names all areas: less than 4 MiB in the largest mission (`domain::mission::bounds`), and the plan.
const MAX_STATUS_PAYLOAD: usize = 8 * 1024 * 1024;
/// A request about the mission may have its text: at most 4 MiB come from the gateway, with the state of the vehicle beside it.
const MAX_MISSION_PAYLOAD: usize = 5 * 1024 * 1024;

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

/// Who waits for an answer.
pub(crate) enum Asker {
    /// Somebody over zenoh. Dropped without a word, it tells them that nobody answers.
    Zenoh(Query),
    /// Somebody over a direct link, by their own number of the request.
    Direct {
        /// The connection over which it came.
        connection: u64,
        /// The number.
        number: u64,
    },
    /// A node of this process. Dropped without a word, it tells them that nobody answers.
    Neighbour(Outcome),
}

/// Why a request does not reach the node.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// It is malformed, misdirected or late, as this says.
    Because(String),
    /// The mailbox is full: it may be sent again.
    NoRoom,
}

/// Requests that wait for the node's answer.
#[derive(Clone, Default)]
pub(crate) struct OpenQueries(Arc<Mutex<(u64, BTreeMap<Token, Asker>)>>);

impl OpenQueries {
    /// Takes out who waits, to be answered.
    pub(crate) fn take(&self, token: Token) -> Option<Asker> {
        self.lock().1.remove(&token)
    }

    fn keep(&self, asker: Asker) -> Token {
        let mut inner = self.lock();
        inner.0 += 1;
        let token = Token(inner.0);
        inner.1.insert(token, asker);
        // A node that never answers must not keep them for ever; each caller has a deadline of its own.
        if MOST_OPEN < inner.1.len() {
            inner.1.pop_first();
        }
        token
    }

    fn lock(&self) -> MutexGuard<'_, (u64, BTreeMap<Token, Asker>)> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

/// What takes in whatever arrives, whichever way: zenoh's threads and the loop each have one.
#[derive(Clone)]
pub(crate) struct Inbox {
    scope: Scope,
    mailbox: Mailbox,
    duplicates: DuplicateFilter,
    /// The number of the last message of each topic, by its publisher.
    last: Arc<Mutex<BTreeMap<(Topic, u64), u64>>>,
    open: OpenQueries,
}

/// Publishers and topics whose last number is remembered; beyond that all are forgotten, and heard by the router first.
const MOST_PUBLISHERS: usize = 1024;

/// What a node has declared that it wants to hear. It hears it for as long as this lives.
pub(crate) struct Declared {
    _subscribers: Vec<Subscriber<()>>,
    _queryables: Vec<Queryable<()>>,
}

/// Declares everything the node wants to hear.
pub(crate) fn declare(session: &Session, node: &dyn Node, inbox: &Inbox) -> Result<Declared, BusError> {
    let scope = inbox.scope();
    let mut subscribers = Vec::new();
    for &topic in node.subscriptions() {
        subscribers.push(subscribe(session, topic, &scope.listen(topic.key()), inbox)?);
        if topic == Topic::Heartbeat && *scope == Scope::Fleet {
            // Ground processes speak for themselves, outside any vehicle's namespace.
            subscribers.push(subscribe(session, topic, topic.key(), inbox)?);
        }
    }
    let queryables = node.serves().iter().map(|service| serve(session, *service, inbox)).collect::<Result<_, _>>()?;
    Ok(Declared { _subscribers: subscribers, _queryables: queryables })
}

/// Watches who is there, for the nodes with these mailboxes; also tells who was there before.
pub(crate) fn watch_peers(session: &Session, scope: &Scope, mailboxes: &[Mailbox]) -> Result<(), BusError> {
    let everyone = keys::alive("*", "*");
    let mut watched = vec![scope.listen(&everyone)];
    if *scope == Scope::Fleet {
        watched.push(everyone);
    }
    for key in watched {
        let (scope, mailboxes) = (scope.clone(), mailboxes.to_vec());
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
                    let event = Event::Peer { vehicle, service, instance, alive };
                    for mailbox in &mailboxes {
                        if !mailbox.push_newest(slot.clone(), Mail::Event(event.clone(), None)) {
                            dropped(mailbox, key);
                        }
                    }
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

fn subscribe(session: &Session, topic: Topic, key: &str, inbox: &Inbox) -> Result<Subscriber<()>, BusError> {
    let inbox = inbox.clone();
    session
        .declare_subscriber(key)
        .callback(move |sample| {
            let attachment = sample.attachment().map(|it| it.to_bytes());
            inbox.message(topic, sample.key_expr().as_str(), &sample.payload().to_bytes(), attachment.as_deref());
        })
        .wait()
        .map_err(|cause| BusError::Declare { key: key.to_owned(), cause: cause.to_string() })
}

fn serve(session: &Session, service: Service, inbox: &Inbox) -> Result<Queryable<()>, BusError> {
    let key = inbox.scope().listen(service.key());
    let inbox = inbox.clone();
    session
        .declare_queryable(&key)
        .complete(true)
        .callback(move |query| {
            let key = query.key_expr().as_str().to_owned();
            let payload = query.payload().map(|it| it.to_bytes().into_owned()).unwrap_or_default();
            let attachment = query.attachment().map(|it| it.to_bytes().into_owned());
            let asker = Asker::Zenoh(query);
            // Without room the query is dropped, which tells the caller at once that nobody answers.
            if let Some((Asker::Zenoh(query), Refusal::Because(why))) =
                inbox.request(service, &key, &payload, attachment.as_deref(), asker)
            {
                let _ = query.reply_err(why).wait();
            }
        })
        .wait()
        .map_err(|cause| BusError::Declare { key: key.clone(), cause: cause.to_string() })
}

impl Inbox {
    /// For what is heard in `scope`, into `mailbox`.
    pub(crate) fn new(scope: &Scope, mailbox: Mailbox) -> Inbox {
        let (duplicates, open) = (DuplicateFilter::default(), OpenQueries::default());
        Inbox { scope: scope.clone(), mailbox, duplicates, last: Arc::default(), open }
    }

    pub(crate) fn scope(&self) -> &Scope {
        &self.scope
    }

    pub(crate) fn mailbox(&self) -> &Mailbox {
        &self.mailbox
    }

    /// The requests that wait for the node.
    pub(crate) fn open(&self) -> &OpenQueries {
        &self.open
    }

    /// A message with this key has arrived. Of two copies the first counts.
    pub(crate) fn message(&self, topic: Topic, key: &str, payload: &[u8], attachment: Option<&[u8]>) {
        let most_bytes = if topic == Topic::MissionStatus { MAX_STATUS_PAYLOAD } else { MAX_PAYLOAD };
        if most_bytes < payload.len() {
            return self.refuse(key, &format!("{} bytes, at most {most_bytes} expected", payload.len()));
        }
        let message = match Message::decode(topic, payload) {
            Ok(message) => message,
            Err(malformed) => return self.refuse(key, &malformed.cause),
        };
        let attachment = attachment.and_then(trace::read).unwrap_or_default();
        if let Err(why) = said_here(&self.scope, key, &attachment) {
            return self.refuse(key, &why);
        }
        let vehicle = self.scope.vehicle_of(key);
        if topic.qos().keeps_newest_only() {
            return self.keep_newest(key, vehicle, message);
        }
        if let Err(late) = in_time(&self.scope, attachment.said_receiver_monotonic_ns) {
            return self.refuse_late(key, late);
        }
        // Held until the message is in the mailbox: a later one that comes another way waits for it.
        let mut last = self.last.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        // A refused message does not count as the first copy.
        if !self.duplicates.is_first(key, &attachment, payload) {
            return;
        }
        if attachment.publisher != 0 {
            if MOST_PUBLISHERS < last.len() {
                last.clear();
            }
            let number = last.entry((topic, attachment.publisher)).or_default();
            *number = attachment.sequence.max(*number);
        }
        let parent = Some(attachment.traceparent).filter(|it| !it.is_empty());
        let mail = mail_of(attachment.said_receiver_monotonic_ns, Event::Message { vehicle, message }, parent);
        let is_large = MAX_PAYLOAD < payload.len();
        let has_room =
            if is_large { self.mailbox.push_large_from(key, mail) } else { self.mailbox.push_from(key, mail) };
        if !has_room {
            self.dropped(key);
        }
    }

    /// A node of this process has published a message, which belongs to this trace, if it is not empty.
    pub(crate) fn message_of_neighbour(&self, vehicle: VehicleId, message: Message, traceparent: &str) {
        let topic = message.topic();
        if topic.qos().keeps_newest_only() {
            return self.keep_newest(topic.key(), vehicle, message);
        }
        let parent = Some(traceparent.to_owned()).filter(|it| !it.is_empty());
        if !self.mailbox.push_from(topic.key(), Mail::Event(Event::Message { vehicle, message }, parent)) {
            self.dropped(topic.key());
        }
    }

    fn keep_newest(&self, key: &str, vehicle: VehicleId, message: Message) {
        let slot = Slot::Sample(vehicle.clone(), message.topic());
        if !self.mailbox.push_newest(slot, Mail::Event(Event::Message { vehicle, message }, None)) {
            self.dropped(key);
        }
    }

    /// A message has arrived over a direct link. After one that did not (the link was full, or is new) it is left to the router, which
    /// brings both in their order.
    pub(crate) fn direct_message(&self, topic: Topic, key: &str, payload: &[u8], attachment: &[u8]) {
        let Some(it) = trace::read(attachment) else { return };
        let last =
            self.last.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).get(&(topic, it.publisher)).copied();
        if it.sequence.saturating_sub(1) <= last.unwrap_or(0) {
            self.message(topic, key, payload, Some(attachment));
        }
    }

    /// A request with this key has arrived. `None`: the node sees it; otherwise who asked, and why it does not.
    pub(crate) fn request(
        &self,
        service: Service,
        key: &str,
        payload: &[u8],
        attachment: Option<&[u8]>,
        asker: Asker,
    ) -> Option<(Asker, Refusal)> {
        let refused = |why: &str| {
            self.refuse(key, why);
            Refusal::Because(why.to_owned())
        };
        let most_bytes = if service == Service::Mission { MAX_MISSION_PAYLOAD } else { MAX_PAYLOAD };
        if most_bytes < payload.len() {
            return Some((asker, refused(&format!("{} bytes, at most {most_bytes}", payload.len()))));
        }
        let request = match Request::decode(service, payload) {
            Ok(request) => request,
            Err(malformed) => return Some((asker, refused(&malformed.cause))),
        };
        let attachment = attachment.and_then(trace::read).unwrap_or_default();
        if let Err(why) = said_here(&self.scope, key, &attachment) {
            return Some((asker, refused(&why)));
        }
        if let Err(late) = in_time(&self.scope, attachment.said_receiver_monotonic_ns) {
            self.refuse_late(key, late);
            return Some((asker, Refusal::Because(format!("{LATE}{late}"))));
        }
        let said = attachment.said_receiver_monotonic_ns;
        let asker = self.put_request(key, request, said, &attachment.traceparent, asker)?;
        Some((asker, Refusal::NoRoom))
    }

    /// A node of this process asks. Without room who asks is dropped, which tells them to ask again.
    pub(crate) fn request_of_neighbour(&self, key: &str, request: Request, traceparent: &str, outcome: Outcome) {
        drop(self.put_request(key, request, 0, traceparent, Asker::Neighbour(outcome)));
    }

    /// Leaves a request for the node; returns who asks if there is no room.
    fn put_request(&self, key: &str, request: Request, said: u64, traceparent: &str, asker: Asker) -> Option<Asker> {
        let parent = Some(traceparent.to_owned()).filter(|it| !it.is_empty());
        let token = self.open.keep(asker);
        let is_order = request.service().is_order();
        let mail = mail_of(said, Event::Request { vehicle: self.scope.vehicle_of(key), token, request }, parent);
        let has_room = if is_order { self.mailbox.push_order(mail) } else { self.mailbox.push_from(key, mail) };
        if has_room {
            return None;
        }
        self.dropped(key);
        self.open.take(token)
    }

    /// Counts a message that is not ours.
    pub(crate) fn refuse(&self, key: &str, why: &str) {
        if let Some(it) = self.mailbox.lose(Loss::Malformed, key) {
            tracing::warn!(
                key = it.sender,
                count = it.count,
                why,
                "message refused; further ones are counted for a while"
            );
        }
    }

    /// What has waited for its node for too long, as one that hangs in a write lets it.
    pub(crate) fn refuse_stale(&self, event: Event, late: Late) {
        match event {
            Event::Message { message, .. } => self.refuse_late(message.topic().key(), late),
            Event::Request { request, token, .. } => {
                self.refuse_late(request.service().key(), late);
                // Only over zenoh does anything come from the ground.
                if let Some(Asker::Zenoh(query)) = self.open.take(token) {
                    let _ = query.reply_err(format!("{LATE}{late}")).wait();
                }
            }
            Event::Reply { .. } | Event::Peer { .. } => {}
        }
    }

    fn refuse_late(&self, key: &str, late: Late) {
        if let Some(it) = self.mailbox.lose(Loss::Late, key) {
            tracing::warn!(key = it.sender, count = it.count, %late, "not obeyed; further ones are counted for a while");
        }
    }

    fn dropped(&self, key: &str) {
        dropped(&self.mailbox, key);
    }
}

/// Counts what there is no room for.
fn dropped(mailbox: &Mailbox, key: &str) {
    if let Some(it) = mailbox.lose(Loss::Dropped, key) {
        tracing::error!(
            key = it.sender,
            count = it.count,
            "too many at once: dropped; further ones are counted for a while"
        );
    }
}

/// Mail of what was said at `said` by our clock; 0: on our own side.
fn mail_of(said: u64, event: Event, parent: Option<trace::Parent>) -> Mail {
    if said == 0 { Mail::Event(event, parent) } else { Mail::Said(said, event, parent) }
}

/// Whether what is heard under `key` was said under it. Zenoh sends a number in place of a key, and for a moment two processes may mean
/// different keys by one: a connection that is made again while the former one is being closed may come into that one's place, with
/// numbers of its own (zenoh 1.10 says `Resource remapped. Remapping unsupported!`). Many payloads are a message of several topics.
fn said_here(scope: &Scope, key: &str, attachment: &Attachment) -> Result<(), String> {
    let said = &attachment.key;
    if said.is_empty() || *said == scope.whole(key) { Ok(()) } else { Err(format!("it was said under {said}")) }
}

/// Whether something may be obeyed. Only what comes from the ground is stamped, and by a vehicle's clock only.
fn in_time(scope: &Scope, said: u64) -> Result<(), Late> {
    match scope {
        Scope::Vehicle(_) => freshness::check(said, monotonic_ns()),
        Scope::Fleet => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wake::Wake;
    use kittiwake_proto::v1;
    use prost::Message as _;

    /// An order that was said under `said` and is heard by a vehicle's process under its own key.
    #[track_caller]
    fn check(said: &str, expected: Option<&str>) {
        let mailbox = Mailbox::new(&Wake::new().unwrap());
        let inbox = Inbox::new(&Scope::Vehicle("uav1".into()), mailbox.clone());
        let attachment = Attachment { key: said.into(), ..Default::default() }.encode_to_vec();
        let order = v1::OperatorCommand::default().encode_to_vec();
        let asker = Asker::Direct { connection: 1, number: 1 };
        let service = Service::OperatorCommand;
        let refused = inbox.request(service, service.key(), &order, Some(&attachment), asker).map(|(_, why)| why);
        assert_eq!(refused, expected.map(|it| Refusal::Because(it.to_owned())), "{said}");
        assert_eq!(mailbox.losses().malformed, u64::from(expected.is_some()), "{said}");
    }

    #[test]
    fn only_a_request_about_the_mission_may_be_large() {
        #[track_caller]
        fn check(service: Service, bytes: usize, expected: Option<&str>) {
            let inbox = Inbox::new(&Scope::Vehicle("uav1".into()), Mailbox::new(&Wake::new().unwrap()));
            let text = v1::MissionText { text: "x".repeat(bytes), wind: None };
            let request = Some(v1::mission_request::Request::Upload(text));
            let payload = v1::MissionRequest { request, ..Default::default() }.encode_to_vec();
            let asker = Asker::Direct { connection: 1, number: 1 };
            let refused = inbox.request(service, service.key(), &payload, None, asker).map(|(_, why)| why);
            let told = match &refused {
                Some(Refusal::Because(why)) => Some(why.as_str()),
                _ => None,
            };
            assert!(told == expected || told.zip(expected).is_some_and(|(it, end)| it.ends_with(end)), "{told:?}");
        }
        check(Service::Mission, 4 << 20, None);
        check(Service::Mission, 5 << 20, Some("bytes, at most 5242880"));
        check(Service::OperatorCommand, 300_000, Some("bytes, at most 262144"));
    }

    #[test]
    fn what_was_said_under_another_key_is_refused() {
        check("kw/uav1/mcm/command", None);
        // Of a client in another language, which need not say it.
        check("", None);
        check("kw/uav1/skill/cancel", Some("it was said under kw/uav1/skill/cancel"));
        check("kw/uav2/mcm/command", Some("it was said under kw/uav2/mcm/command"));
        check("mcm/command", Some("it was said under mcm/command"));
    }

    #[test]
    fn a_number_of_any_size_leaves_a_publisher_heard() {
        let mailbox = Mailbox::new(&Wake::new().unwrap());
        let inbox = Inbox::new(&Scope::Vehicle("uav1".into()), mailbox.clone());
        let (topic, key) = (Topic::FlagEvent, Topic::FlagEvent.key());
        let payload = v1::FlagEvent { name: "battery_low".into(), ..Default::default() }.encode_to_vec();
        let numbered = |sequence| Attachment { publisher: 7, sequence, ..Default::default() }.encode_to_vec();
        let heard = |sequence| {
            inbox.direct_message(topic, key, &payload, &numbered(sequence));
            let mut batch = Vec::new();
            mailbox.take(&mut batch);
            batch.len()
        };
        assert_eq!([1, 3, 2].map(heard), [1, 0, 1], "after a gap the router brings it");
        inbox.message(topic, key, &payload, Some(&numbered(u64::MAX)));
        mailbox.take(&mut Vec::new());
        assert_eq!([3, 4, u64::MAX].map(heard), [1, 1, 0], "each once");
    }

    #[test]
    fn no_message_counts_under_another_key_whatever_its_kind() {
        for topic in [Topic::Heartbeat, Topic::FlagEvent] {
            let mailbox = Mailbox::new(&Wake::new().unwrap());
            let inbox = Inbox::new(&Scope::Fleet, mailbox.clone());
            let payload = v1::FlagEvent { name: "battery_low".into(), ..Default::default() }.encode_to_vec();
            let payload = if topic == Topic::FlagEvent { payload } else { Vec::new() };
            let key = format!("kw/uav1/{}", topic.key());
            for said in [format!("kw/uav2/{}", topic.key()), "kw/uav1/mcm/status".into(), key.clone()] {
                assert!(!mailbox.has_mail());
                let attachment = Attachment { key: said, ..Default::default() }.encode_to_vec();
                inbox.message(topic, &key, &payload, Some(&attachment));
            }
            assert!(mailbox.has_mail(), "{topic:?}");
            assert_eq!(mailbox.losses().malformed, 2, "{topic:?}");
        }
    }
}
