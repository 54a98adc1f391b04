//! One client's event stream: the journal, then events as they happen, and a `status` with the whole state at a
//! fixed rate.
//!
//! A stream holds a cursor into the journal and no queue beyond one batch, and sends texts that all streams share. Nothing
//! is read before the connection can take it, so that a client that does not read costs hardly any memory; when the journal
//! has dropped records after its cursor, the client gets a `resync`.

#![expect(clippy::disallowed_methods, reason = "requests and their limits are on the wall clock")]

use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Instant;

use axum::body::Bytes;
use futures_util::Stream;
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

/// Records read at a time: those that a stream keeps from being dropped with the journal's oldest.
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
    let mut status = tokio::time::interval(client.site.api.ages.status_period);
    status.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let reader = Reader { client, status, ready: VecDeque::new() };
    futures_util::stream::unfold(reader, |mut reader| async move {
        let event = reader.next().await?;
        Some((Ok(event), reader))
    })
}

struct Reader {
    client: Client,
    status: Interval,
    ready: VecDeque<Ready>,
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
            if let Some(ready) = self.ready.pop_front() {
                return Some(self.event(&ready));
            }
            let client = &mut self.client;
            let batch = client.journals.borrow_and_update().read(&client.vehicle, client.cursor, BATCH);
            client.cursor = batch.cursor;
            if !batch.records.is_empty() {
                self.make_ready(batch);
                continue;
            }
            // The first status comes at once, after the events that were waiting.
            tokio::select! {
                _ = client.site.closing.changed() => return None,
                changed = client.journals.changed() => changed.ok()?,
                _ = self.status.tick() => return self.status(),
            }
        }
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

    /// Without an id: a client that comes back resumes after the last record it has seen. None after the end of its token.
    fn status(&self) -> Option<Bytes> {
        let snapshot = self.client.snapshot.borrow().clone();
        let (now, client, api) = (Instant::now(), &self.client, &self.client.site.api);
        if !api.tokens.get().still_has(&client.who, utc_ms_now()) {
            return None;
        }
        // A client that reads the stream keeps its command.
        api.authorities.heard_from(&client.who.name, now);
        let authority = api.authorities.of(&client.vehicle, now);
        api.statuses.frame(&snapshot, &client.vehicle, api.ages, &authority)
    }
}
