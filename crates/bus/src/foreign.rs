//! The keys of somebody else, over a router of their own: for a bridge between them and Kittiwake.
//!
//! It is another session than the bus's, with another router, and nothing passes between the two but what the bridge lets through:
//! a client of the foreign endpoint is not on the bus. Zenoh's threads only hand over into a bounded mailbox and wake
//! the loop.

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use zenoh::bytes::Encoding;
use zenoh::liveliness::LivelinessToken;
use zenoh::qos::CongestionControl;
use zenoh::query::Query;
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Config, Session, Wait};

use crate::session::{config, open, set};
use crate::{BusError, Link, Nudge, Scope};

/// Samples and tokens that wait; more than arrives in any burst that a loop lets pile up.
const CAPACITY: usize = 1024;
/// A flight controller sends no larger sample.
const LARGEST: usize = 64 * 1024;
/// Requests without a reply; more than clients that wait for one action. Each has at most zenoh's largest message.
const MOST_REQUESTS: usize = 64;
/// Others who take nothing for this long are disconnected, and may connect again. In microseconds of wall time. (PX4 counts setpoints
/// as lost after 1 s; ENG: half of that, so that the loop that sends them hangs for no longer.)
const BLOCKED_US: u64 = 500_000;
/// Messages that wait for the others, each in a batch of its own. (Zenoh's most; ENG: 0.4 s of setpoints.)
const QUEUED: u64 = 16;

/// Where clients connect, and what is received from them.
#[derive(Debug, Clone)]
pub struct ForeignLink {
    /// Where their router listens, such as `tcp/127.0.0.1:7447`.
    pub listen: String,
    /// The key expression of what is received.
    pub receive: String,
    /// The key expression of their liveliness tokens.
    pub tokens: String,
    /// Whether of this key only the newest sample counts.
    pub keeps_newest_only: fn(&str) -> bool,
}

/// Something that arrived.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ForeignMail {
    /// A sample.
    Sample {
        /// Its key.
        key: String,
        /// Its bytes.
        payload: Vec<u8>,
    },
    /// A liveliness token appeared or vanished.
    Token {
        /// Its key.
        key: String,
        /// Whether it is there.
        alive: bool,
    },
    /// Somebody asks for something that is served here, and waits for [`Foreign::reply`].
    Request {
        /// Stands for it in the reply.
        number: u64,
        /// The key that it asks.
        key: String,
        /// Its bytes.
        payload: Vec<u8>,
    },
}

/// The session with the others.
pub struct Foreign {
    session: Session,
    mailbox: Arc<Mutex<Mailbox>>,
    listens: Vec<String>,
    nudge: Nudge,
    tokens: Vec<LivelinessToken>,
}

#[derive(Default)]
struct Mailbox {
    queue: VecDeque<Entry>,
    newest: HashMap<String, Vec<u8>>,
    dropped: u64,
    /// Requests without a reply, and the number of the newest one.
    requests: HashMap<u64, Query>,
    requested: u64,
}

enum Entry {
    Mail(ForeignMail),
    /// Stands for the newest sample of a key, in the place of the first unread one.
    Newest(String),
}

impl Foreign {
    /// Listens; `nudge` is woken by what arrives.
    ///
    /// # Errors
    /// If the endpoint is taken, or zenoh refuses a declaration.
    pub fn open(link: &ForeignLink, nudge: &Nudge) -> Result<Foreign, BusError> {
        let foreign = Foreign::listen(&link.listen, nudge)?;
        foreign.hear(link)?;
        Ok(foreign)
    }

    /// Listens, and hears nothing but requests.
    ///
    /// # Errors
    /// If the endpoint is taken.
    pub fn listen(endpoint: &str, nudge: &Nudge) -> Result<Foreign, BusError> {
        let refused = |cause: String| BusError::Listen { locators: endpoint.to_owned(), cause };
        crate::router::try_out(endpoint)?;
        let mut config = config("router")?;
        set(&mut config, "listen/endpoints", &serde_json::json!([endpoint]).to_string())?;
        set(&mut config, "listen/exit_on_failure", "true")?;
        set(&mut config, "scouting/delay", "0")?;
        do_not_hang(&mut config)?;
        let session = zenoh::open(config).wait().map_err(|cause| refused(cause.to_string()))?;
        let listens: Vec<_> = session.info().locators().wait().iter().map(|it| it.to_string()).collect();
        if listens.is_empty() {
            return Err(refused("nothing was bound".into()));
        }
        Ok(Foreign::new(session, listens, nudge))
    }

    /// Connects to a router of the others, and hears nothing but requests. It connects again by itself when the router comes back.
    ///
    /// # Errors
    /// If nothing answers there within `limit`.
    pub fn connect(endpoint: &str, limit: Duration, nudge: &Nudge) -> Result<Foreign, BusError> {
        let link = Link { connect: vec![endpoint.to_owned()], scope: Scope::Fleet, open_timeout: limit };
        Ok(Foreign::new(open(&link)?, Vec::new(), nudge))
    }

    fn new(session: Session, listens: Vec<String>, nudge: &Nudge) -> Foreign {
        Foreign { session, mailbox: Arc::default(), listens, nudge: nudge.clone(), tokens: Vec::new() }
    }

    fn hear(&self, link: &ForeignLink) -> Result<(), BusError> {
        let (into, wake, keeps_newest_only) = (self.mailbox.clone(), self.nudge.clone(), link.keeps_newest_only);
        let on_sample = move |sample: Sample| {
            if sample.kind() == SampleKind::Put && sample.payload().len() <= LARGEST {
                let (key, payload) = (sample.key_expr().as_str().to_owned(), sample.payload().to_bytes().into_owned());
                lock(&into).take_in(key, payload, keeps_newest_only);
                wake.wake();
            }
        };
        let subscriber = self.session.declare_subscriber(link.receive.as_str()).callback(on_sample);
        subscriber.background().wait().map_err(|cause| declare(&link.receive, cause))?;
        let (into, wake) = (self.mailbox.clone(), self.nudge.clone());
        let on_token = move |sample: Sample| {
            let (key, alive) = (sample.key_expr().as_str().to_owned(), sample.kind() == SampleKind::Put);
            lock(&into).push(Entry::Mail(ForeignMail::Token { key, alive }));
            wake.wake();
        };
        let tokens = self.session.liveliness().declare_subscriber(link.tokens.as_str());
        let tokens = tokens.history(true).callback(on_token);
        tokens.background().wait().map_err(|cause| declare(&link.tokens, cause))
    }

    /// From now on requests with this key arrive.
    ///
    /// # Errors
    /// If zenoh refuses the declaration.
    pub fn serve(&self, key: &str) -> Result<(), BusError> {
        let (into, wake, served) = (self.mailbox.clone(), self.nudge.clone(), key.to_owned());
        let on_query = move |query: Query| {
            // A query with wildcards asks for whatever is there: it does not mean this service, and gets no reply.
            if query.key_expr().as_str() == served {
                lock(&into).ask(query);
                wake.wake();
            }
        };
        let queryable = self.session.declare_queryable(key).complete(true).callback(on_query);
        queryable.background().wait().map_err(|cause| declare(key, cause))
    }

    /// Tells the others that this token is alive, until the session ends.
    ///
    /// # Errors
    /// If zenoh refuses the declaration.
    pub fn announce(&mut self, key: &str) -> Result<(), BusError> {
        let token = self.session.liveliness().declare_token(key.to_owned()).wait();
        self.tokens.push(token.map_err(|cause| declare(key, cause))?);
        Ok(())
    }

    /// The session's own name, in hexadecimal digits.
    pub fn id(&self) -> String {
        self.session.zid().to_string()
    }

    /// Where it listens; port 0 has become a free one.
    pub fn locators(&self) -> &[String] {
        &self.listens
    }

    /// Everything that has arrived, in order.
    pub fn take(&self) -> Vec<ForeignMail> {
        let mut inner = lock(&self.mailbox);
        let dropped = std::mem::take(&mut inner.dropped);
        let entries = std::mem::take(&mut inner.queue);
        let mut newest = std::mem::take(&mut inner.newest);
        drop(inner);
        if 0 < dropped {
            tracing::warn!(dropped, "the mailbox of the foreign keys was full");
        }
        let open = |entry| match entry {
            Entry::Mail(mail) => Some(mail),
            Entry::Newest(key) => newest.remove(&key).map(|payload| ForeignMail::Sample { key, payload }),
        };
        entries.into_iter().filter_map(open).collect()
    }

    /// Sends a sample; what nobody listens to is dropped. It waits for the others to take it, for a moment.
    ///
    /// It must not be droppable: on a link without priorities, as zenoh-pico's is, zenoh (1.10) drops everything that may be dropped, for
    /// as long as the link lasts, after it has dropped one message. (A PX4 on a busy machine heard no setpoint any more.)
    pub fn put(&self, key: &str, payload: Vec<u8>, attachment: Option<Vec<u8>>) {
        let put = self.session.put(key, payload).encoding(Encoding::ZENOH_BYTES).attachment(attachment);
        if let Err(cause) = put.congestion_control(CongestionControl::Block).express(true).wait() {
            tracing::warn!(key, %cause, "not sent");
        }
    }

    /// Answers a request; once. The answer has the attachment of the request, as ROS 2 expects it.
    pub fn reply(&self, number: u64, payload: Vec<u8>) {
        let Some(query) = lock(&self.mailbox).requests.remove(&number) else { return };
        let attachment = query.attachment().cloned();
        if let Err(cause) = query.reply(query.key_expr().clone(), payload).attachment(attachment).wait() {
            tracing::warn!(key = %query.key_expr(), %cause, "not answered");
        }
    }

    /// Ends the session.
    pub fn close(self) {
        // Whatever it answers: the process ends.
        let _ = self.session.close().wait();
    }
}

impl Mailbox {
    fn take_in(&mut self, key: String, payload: Vec<u8>, keeps_newest_only: fn(&str) -> bool) {
        if !keeps_newest_only(&key) {
            self.push(Entry::Mail(ForeignMail::Sample { key, payload }));
        } else if let Some(older) = self.newest.get_mut(&key) {
            *older = payload;
        } else if self.push(Entry::Newest(key.clone())) {
            self.newest.insert(key, payload);
        }
    }

    fn ask(&mut self, query: Query) {
        let payload = query.payload().map_or(Vec::new(), |it| it.to_bytes().into_owned());
        if MOST_REQUESTS <= self.requests.len() {
            self.dropped += 1;
            return;
        }
        let (number, key) = (self.requested + 1, query.key_expr().as_str().to_owned());
        if self.push(Entry::Mail(ForeignMail::Request { number, key, payload })) {
            self.requested = number;
            self.requests.insert(number, query);
        }
    }

    fn push(&mut self, entry: Entry) -> bool {
        if CAPACITY <= self.queue.len() {
            self.dropped += 1;
            return false;
        }
        self.queue.push_back(entry);
        true
    }
}

fn declare(key: &str, cause: zenoh::Error) -> BusError {
    BusError::Declare { key: key.to_owned(), cause: cause.to_string() }
}

/// Others who take nothing do not hold up the loop that sends.
fn do_not_hang(config: &mut Config) -> Result<(), BusError> {
    set(config, "transport/link/tx/queue/congestion_control/block/wait_before_close", &BLOCKED_US.to_string())?;
    set(config, "transport/link/tx/queue/size/data", &QUEUED.to_string())
}

/// A thread that panicked while it held the lock left plain data behind: go on with it.
fn lock(mailbox: &Mutex<Mailbox>) -> MutexGuard<'_, Mailbox> {
    mailbox.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(key: &str, byte: u8) -> ForeignMail {
        ForeignMail::Sample { key: key.to_owned(), payload: vec![byte] }
    }

    #[test]
    fn of_some_keys_only_the_newest_is_kept_and_the_rest_is_bounded() {
        let mut mailbox = Mailbox::default();
        let newest: fn(&str) -> bool = |key| key == "position";
        for byte in 0..3 {
            mailbox.take_in("position".into(), vec![byte], newest);
            mailbox.take_in("status".into(), vec![byte], newest);
        }
        assert_eq!((mailbox.queue.len(), mailbox.newest.get("position")), (4, Some(&vec![2])));
        for _ in 0..2 * CAPACITY {
            mailbox.take_in("status".into(), vec![9], newest);
            mailbox.take_in("attitude".into(), vec![9], |_| true);
        }
        assert_eq!(mailbox.queue.len(), CAPACITY);
        assert!(0 < mailbox.dropped && mailbox.newest.len() <= 2);
        assert_eq!(sample("a", 1), sample("a", 1));
    }
}
