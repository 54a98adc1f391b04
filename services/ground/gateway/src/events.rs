//! One client's event stream: history, then what happens, with the whole state now and then.
//!
//! A stream holds a cursor into the journal and no queue beyond one batch: nothing is read ahead
//! of what the client's connection takes, so that a client that does not read costs nothing, and
//! is told with `resync` when the history has gone past it.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::response::sse::Event;
use futures_util::Stream;
use node::VehicleId;
use serde_json::json;
use tokio::sync::{OwnedSemaphorePermit, watch};
use tokio::time::{Interval, MissedTickBehavior};

use crate::helm::Helms;
use crate::journal::{Batch, Cursor, Journals, Record};
use crate::state::Snapshot;
use crate::status::Statuses;
use crate::view::{self, Ages};

/// Records read at a time.
const BATCH: usize = 64;

/// What a stream needs.
pub struct Client {
    /// Whose events.
    pub vehicle: VehicleId,
    /// How far the client has read.
    pub cursor: Cursor,
    /// Where it reads.
    pub journals: watch::Receiver<Journals>,
    /// Where `status` comes from.
    pub snapshot: watch::Receiver<Arc<Snapshot>>,
    /// Who holds command, and is told that the client is there.
    pub helms: Arc<Helms>,
    /// The client's name.
    pub who: Arc<str>,
    /// How `status` tells ages.
    pub ages: Ages,
    /// Made once for all clients.
    pub statuses: Arc<Statuses>,
    /// Its sender is dropped when the server stops.
    pub closing: watch::Receiver<()>,
    /// Wall time between two `status` events.
    pub status_period: Duration,
    /// Given back when the client leaves.
    pub permit: OwnedSemaphorePermit,
}

/// The client's events until it leaves, the server stops or the gateway's loop ends.
pub fn stream(client: Client) -> impl Stream<Item = Result<Event, Infallible>> {
    let mut status = tokio::time::interval(client.status_period);
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

/// What the client gets next; its text is made when the connection takes it.
enum Ready {
    /// Events were lost.
    Resync,
    /// Something happened.
    Happened(Arc<Record>),
}

impl Reader {
    async fn next(&mut self) -> Option<Event> {
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
            // The first status comes at once, after the history that was waiting.
            tokio::select! {
                _ = client.closing.changed() => return None,
                changed = client.journals.changed() => changed.ok()?,
                _ = self.status.tick() => return self.status(),
            }
        }
    }

    fn make_ready(&mut self, batch: Batch) {
        self.ready.extend(batch.lost.then_some(Ready::Resync));
        self.ready.extend(batch.records.into_iter().map(Ready::Happened));
    }

    fn event(&self, ready: &Ready) -> Event {
        match ready {
            Ready::Resync => {
                let now = self.client.snapshot.borrow().now;
                let advice = json!({ "detail": "events were lost; fetch the vehicle's state anew" });
                Event::default().event("resync").data(view::stamped(now, advice).to_string())
            }
            Ready::Happened(it) => Event::default().id(it.id.to_string()).event(it.kind).data(&it.data),
        }
    }

    /// Without an id: a client that comes back resumes after the last record it has seen.
    fn status(&self) -> Option<Event> {
        let snapshot = self.client.snapshot.borrow().clone();
        let (now, client) = (Instant::now(), &self.client);
        client.helms.heard(&client.who, now);
        let helm = client.helms.of(&client.vehicle, now);
        let text = client.statuses.text(&snapshot, &client.vehicle, client.ages, &helm)?;
        Some(Event::default().event("status").data(&*text))
    }
}
