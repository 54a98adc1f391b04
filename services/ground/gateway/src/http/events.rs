//! One client's event stream: the journal, then events as they happen, and a `status` with the whole state at a
//! fixed rate.
//!
//! A stream holds a cursor into the journal and no queue beyond one batch, and sends texts that all streams share. Nothing
//! is read before the connection can take it, so that a client that does not read costs hardly any memory; when the journal
//! has dropped records after its cursor, the client gets a `resync`. However much waits for it, its stream ends with its token, and a
//! status that is due waits for no more than a batch.

#![expect(clippy::disallowed_methods, reason = "requests and their limits are on the wall clock")]

use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Instant;

use axum::body::Bytes;
use futures_util::{FutureExt as _, Stream};
use kittiwake_proto::json::to_json;
use kittiwake_proto::v1;
use node::VehicleId;
use tokio::sync::watch;
use tokio::time::{Interval, MissedTickBehavior};

use crate::access::{Identity, utc_ms_now};
use crate::fleet::Snapshot;
use crate::http::site::Site;
use crate::journal::{Batch, Cursor, Journals, Record};
use crate::shares::Share;
use crate::view;

/// The media type of server-sent events.
pub(crate) const EVENT_STREAM: &str = "text/event-stream";

/// Records read at a time: those that a stream keeps from being dropped with the journal's oldest, and that go before a status that is due.
const BATCH: usize = 8;

/// What a stream needs.
pub(crate) struct Client {
    /// The vehicle whose events are sent.
    pub(crate) vehicle: VehicleId,
    /// Who it is: the stream ends with its token.
    pub(crate) who: Identity,
    /// How far the client has read.
    pub(crate) cursor: Cursor,
    /// Its own receivers: each remembers what this client has seen.
    pub(crate) journals: watch::Receiver<Journals>,
    pub(crate) snapshot: watch::Receiver<Arc<Snapshot>>,
    pub(crate) site: Site,
    /// The client's share of all streams, given back when it leaves.
    pub(crate) _share: Share,
}

/// The client's events until it leaves, its token is no longer valid, the server stops or the gateway's loop ends.
pub(crate) fn stream(client: Client) -> impl Stream<Item = Result<Bytes, Infallible>> {
    let mut period = tokio::time::interval(client.site.api.ages.status_period);
    period.set_missed_tick_behavior(MissedTickBehavior::Delay);
    // The first status does not wait for it.
    period.reset();
    let reader = Reader { client, period, status: Status::First, last: Sent::Nothing, ready: VecDeque::new() };
    futures_util::stream::unfold(reader, |mut reader| async move {
        let event = reader.next().await?;
        Some((Ok(event), reader))
    })
}

struct Reader {
    client: Client,
    /// From one status to the next.
    period: Interval,
    status: Status,
    last: Sent,
    ready: VecDeque<Ready>,
}

/// When the client gets its next status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Status {
    /// It had none: it gets one after the events that are waiting, and then one in each period.
    First,
    /// Once the period is over.
    Later,
    /// The period is over.
    Due,
}

/// What the client got last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sent {
    Nothing,
    Event,
    Status,
}

/// An event as server-sent events have it. `data` has no line feed, and so is one line.
pub(crate) fn frame(id: Option<&str>, kind: &str, data: &str) -> Bytes {
    let id = id.map(|it| format!("id: {it}\n")).unwrap_or_default();
    format!("{id}event: {kind}\ndata: {data}\n\n").into()
}

/// The same event under another id.
pub(crate) fn under_id(frame: &[u8], id: &str) -> Bytes {
    let without_id = match frame.starts_with(b"id: ") {
        true => frame.iter().position(|it| *it == b'\n').map_or(frame, |end| &frame[end + 1..]),
        false => frame,
    };
    [format!("id: {id}\n").as_bytes(), without_id].concat().into()
}

/// What the client gets next.
enum Ready {
    /// Events were lost.
    Resync,
    Happened(Arc<Record>),
}

impl Reader {
    async fn next(&mut self) -> Option<Bytes> {
        loop {
            if self.is_over() {
                return None;
            }
            if self.period.tick().now_or_never().is_some() {
                self.status = Status::Due;
            }
            if let Some(ready) = self.ready.pop_front() {
                self.last = Sent::Event;
                return Some(self.event(&ready));
            }
            // Before what waits, or a storm of events would keep the state from the client. But after a whole batch: where a status takes
            // as long as its period, one is always due, and what has waited for long would take hours.
            if self.status == Status::Due && self.last == Sent::Event {
                return self.status();
            }
            let client = &mut self.client;
            let batch = client.journals.borrow_and_update().read(&client.vehicle, client.cursor, BATCH);
            client.cursor = batch.cursor;
            if !batch.records.is_empty() {
                self.make_ready(batch);
                continue;
            }
            if self.status != Status::Later {
                return self.status();
            }
            tokio::select! {
                _ = client.site.closing.changed() => return None,
                changed = client.journals.changed() => changed.ok()?,
                _ = self.period.tick() => self.status = Status::Due,
            }
        }
    }

    /// Whether the server stops, or the client has no valid token any more.
    fn is_over(&self) -> bool {
        let (who, site) = (&self.client.who, &self.client.site);
        site.closing.has_changed().is_err() || !site.api.tokens.get().still_has(who, utc_ms_now())
    }

    fn make_ready(&mut self, batch: Batch) {
        self.ready.extend(batch.lost.then_some(Ready::Resync));
        self.ready.extend(batch.records.into_iter().map(Ready::Happened));
    }

    fn event(&self, ready: &Ready) -> Bytes {
        match ready {
            Ready::Resync => {
                let detail = "events were lost; fetch the vehicle's state again".to_owned();
                let (snapshot, advice) = (self.client.snapshot.borrow(), to_json(&v1::Resync { detail }));
                let stamped = view::stamped(snapshot.mission_time_s(&self.client.vehicle), snapshot.now.utc_ms, advice);
                frame(None, "resync", &stamped.to_string())
            }
            Ready::Happened(record) => record.frame.clone(),
        }
    }

    /// Without an id: a client that comes back resumes after the last record it has seen.
    fn status(&mut self) -> Option<Bytes> {
        (self.status, self.last) = (Status::Later, Sent::Status);
        let snapshot = self.client.snapshot.borrow().clone();
        let (now, client, api) = (Instant::now(), &self.client, &self.client.site.api);
        // A client that reads the stream keeps its command.
        api.authorities.heard_from(&client.who.name, now);
        let authority = api.authorities.of(&client.vehicle, now);
        api.statuses.frame(&snapshot, &client.vehicle, api.ages, &authority)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use axum::body::{Body, HttpBody as _};
    use kittiwake_proto::v1;

    use super::BATCH;
    use crate::http::served::{Served, WATCHER};

    const SELDOM: (&str, &str) = ("status_rate_hz = 2.0", "status_rate_hz = 0.001");
    const OFTEN: (&str, &str) = ("status_rate_hz = 2.0", "status_rate_hz = 1000.0");
    /// Longer than anything takes on a busy machine.
    const LIMIT: Duration = Duration::from_secs(20);

    async fn stream(served: &Served) -> Body {
        served.get("/api/v1/vehicles/uav1/events", WATCHER).await.into_body()
    }

    /// The kind of the next event; `None` at the end.
    async fn next(body: &mut Body) -> Option<String> {
        let frame = std::future::poll_fn(|context| std::pin::Pin::new(&mut *body).poll_frame(context));
        let frame = tokio::time::timeout(LIMIT, frame).await.expect("the next event is late")?;
        let text = String::from_utf8(frame.unwrap().into_data().unwrap().to_vec()).unwrap();
        text.lines().find_map(|it| it.strip_prefix("event: ")).map(str::to_owned)
    }

    fn decide(served: &mut Served, count: u64) {
        (0..count).for_each(|sequence| served.say(v1::DecisionRecord { sequence, ..Default::default() }));
    }

    #[tokio::test]
    async fn a_stream_ends_with_its_token_although_much_waits_for_its_client() {
        let mut served = Served::new(&[SELDOM]);
        decide(&mut served, 50);
        let mut watching = stream(&served).await;
        assert_eq!(next(&mut watching).await.as_deref(), Some("decision"));
        served.take_token_from(WATCHER);
        assert_eq!(next(&mut watching).await, None);
    }

    #[tokio::test]
    async fn a_stream_ends_with_the_server_although_much_waits_for_its_client() {
        let mut served = Served::new(&[SELDOM]);
        decide(&mut served, 50);
        let mut watching = stream(&served).await;
        assert_eq!(next(&mut watching).await.as_deref(), Some("decision"));
        drop(served.closing);
        assert_eq!(next(&mut watching).await, None);
    }

    #[tokio::test]
    async fn events_without_end_keep_no_status_back() {
        let mut served = Served::new(&[OFTEN]);
        decide(&mut served, 50);
        let mut watching = stream(&served).await;
        let limit = tokio::time::Instant::now() + LIMIT;
        // More happens than it reads.
        while next(&mut watching).await.unwrap() != "status" {
            assert!(tokio::time::Instant::now() < limit, "no status");
            decide(&mut served, 2);
            // A connection that writes yields now and then, and time passes only meanwhile.
            tokio::task::yield_now().await;
        }
    }

    #[tokio::test]
    async fn statuses_that_are_always_due_keep_no_event_back() {
        let mut served = Served::new(&[OFTEN]);
        decide(&mut served, 20);
        let mut watching = stream(&served).await;
        let mut seldom = tokio::time::interval(Duration::from_millis(3));
        let mut kinds = Vec::new();
        for _ in 0..23 {
            seldom.tick().await;
            kinds.push(next(&mut watching).await.unwrap());
        }
        let between: Vec<_> = kinds.split(|it| it == "status").map(<[String]>::len).collect();
        assert_eq!(between, [BATCH, BATCH, 20 - 2 * BATCH, 0], "{kinds:?}");
    }
}
