//! Who is at the other end of the link, shown to others as liveliness tokens, and reported when it changes.

#![expect(clippy::disallowed_methods, reason = "links are watched on the wall clock")]

use std::collections::BTreeMap;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

use zenoh::liveliness::LivelinessToken;
use zenoh::{Session, Wait};

use super::link::Connection;
use super::obstacle::Inquiry;
use super::second_way;
use super::{LinkEnd, News};
use crate::BusError;

/// A link that is down is reported again after this time.
const REMINDER: Duration = Duration::from_secs(30);
/// Tells at least this often that it still routes.
const TURN: Duration = Duration::from_millis(500);
/// A link that has never been up is reported for the first time after this long. One that can be made is up sooner.
const FIRST_REMINDER: Duration = Duration::from_secs(5);

/// What the router has heard.
pub(super) enum Heard {
    Link {
        connection: Connection,
        up: bool,
    },
    /// An inquiry has ended; what stands in the way.
    Obstacle(Option<String>),
    Stop,
}

/// Who is at the other end, shown to others as a liveliness token, and reported when it changes.
///
/// Its loop is what the supervisor's watchdog watches, so nothing in it waits for another machine: see [`Inquiry`].
pub(super) struct Watch {
    name: String,
    peers: BTreeMap<String, Peer>,
    /// Connections under one name that are as it should be.
    most: usize,
    /// For this long, further ones may be left over from a reconnection.
    settle: Duration,
    inquiry: Option<Inquiry>,
    /// The peers for which an inquiry is under way.
    asked: Option<Vec<String>>,
    /// Where inquiries leave what they found.
    sender: mpsc::Sender<Heard>,
    _alive: Option<LivelinessToken>,
}

struct Peer {
    /// A new one may be up before the old one is known to be down.
    connections: Vec<Connection>,
    since: Instant,
    remind_after: Duration,
    token: Option<LivelinessToken>,
    /// Since when there have been too many connections, and when that is reported.
    crowded: Option<Crowded>,
}

struct Crowded {
    tell_at: Instant,
    token: Option<LivelinessToken>,
}

impl Watch {
    pub(super) fn new(link: Option<&LinkEnd>, sender: mpsc::Sender<Heard>) -> Watch {
        let peer = |name| {
            let (connections, since, remind_after) = (Vec::new(), Instant::now(), FIRST_REMINDER);
            (name, Peer { connections, since, remind_after, token: None, crowded: None })
        };
        let peers = link.map(|it| it.peers().into_iter().map(peer).collect()).unwrap_or_default();
        let name = link.map_or_else(|| "router".to_owned(), LinkEnd::name);
        let most = link.map_or(1, |it| second_way::connections(it.side()));
        let settle = link.map_or(Duration::ZERO, |it| 3 * it.table.carrier.lease);
        Watch { name, peers, most, settle, inquiry: link.map(Inquiry::of), asked: None, sender, _alive: None }
    }

    /// For tests: the first inquiry begins at once, has this limit and finds addresses like this.
    #[cfg(test)]
    pub(super) fn hurry(&mut self, limit: Duration, resolver: super::obstacle::Resolver) {
        self.peers.values_mut().for_each(|it| it.remind_after = Duration::ZERO);
        if let Some(inquiry) = &mut self.inquiry {
            (inquiry.limit, inquiry.resolver) = (limit, resolver);
        }
    }

    pub(super) fn run(
        &mut self,
        session: &Session,
        events: &mpsc::Receiver<Heard>,
        tell: &mut impl FnMut(News),
    ) -> Result<(), BusError> {
        self._alive = Some(token(session, router_token(&self.name))?);
        loop {
            probe(session, &self.name)?;
            tell(News::Turned);
            match events.recv_timeout(self.patience().min(TURN)) {
                Ok(Heard::Stop) | Err(RecvTimeoutError::Disconnected) => return Ok(()),
                Ok(Heard::Link { connection, up }) => self.heard(session, connection, up, tell)?,
                Ok(Heard::Obstacle(why)) => self.found(why, tell),
                Err(RecvTimeoutError::Timeout) => {}
            }
            self.remind(tell);
            self.count(session, tell)?;
        }
    }

    fn heard(
        &mut self,
        session: &Session,
        connection: Connection,
        up: bool,
        tell: &mut impl FnMut(News),
    ) -> Result<(), BusError> {
        let name = connection.peer.clone();
        // One that is not expected has a certificate all the same, and is denied everything.
        let Some(peer) = self.peers.get_mut(&name) else { return Ok(()) };
        let was_up = peer.is_up();
        if up {
            peer.connections.push(connection);
        } else if let Some(at) = peer.connections.iter().position(|it| *it == connection) {
            peer.connections.remove(at);
        }
        match (was_up, peer.is_up()) {
            (false, true) => {
                peer.token = Some(token(session, link_token(&self.name, &name))?);
                tell(News::Up { peer: name });
            }
            (true, false) => {
                (peer.token, peer.since, peer.remind_after) = (None, Instant::now(), REMINDER);
                tell(News::Down { peer: name, why: None, since: Duration::ZERO });
            }
            (true, true) | (false, false) => {}
        }
        Ok(())
    }

    /// Until the next reminder.
    fn patience(&self) -> Duration {
        let down = self.peers.values().filter(|it| !it.is_up());
        let left = down.map(|it| it.remind_after.saturating_sub(it.since.elapsed()));
        left.min().unwrap_or(Duration::from_secs(3600))
    }

    /// Of the peers that are due, the reason is asked for; they are reported once it is known.
    fn remind(&mut self, tell: &mut impl FnMut(News)) {
        let mut due = Vec::new();
        for (name, peer) in self.peers.iter_mut().filter(|(_, it)| it.is_due()) {
            peer.remind_after = peer.since.elapsed() + REMINDER;
            due.push(name.clone());
        }
        if due.is_empty() {
            return;
        }
        let sender = self.sender.clone();
        // The router is ending if nobody listens any more.
        let told = move |why| drop(sender.send(Heard::Obstacle(why)));
        let started = match (&self.asked, &self.inquiry) {
            (None, Some(inquiry)) => inquiry.start(told).is_ok(),
            // The last one hangs, at a disk for example: no second one beside it.
            (Some(_), _) | (_, None) => false,
        };
        match started {
            true => self.asked = Some(due),
            false => self.report(&due, None, tell),
        }
    }

    /// An inquiry has ended.
    fn found(&mut self, why: Option<String>, tell: &mut impl FnMut(News)) {
        let due = self.asked.take().unwrap_or_default();
        self.report(&due, why, tell);
    }

    fn report(&self, names: &[String], why: Option<String>, tell: &mut impl FnMut(News)) {
        // One that has come up meanwhile has been reported.
        for (name, peer) in self.peers.iter().filter(|(name, it)| names.contains(name) && !it.is_up()) {
            tell(News::Down { peer: name.clone(), why: why.clone(), since: peer.since.elapsed() });
        }
    }

    /// Tells of names under which there are more connections than one machine makes.
    fn count(&mut self, session: &Session, tell: &mut impl FnMut(News)) -> Result<(), BusError> {
        let now = Instant::now();
        for (name, peer) in &mut self.peers {
            if peer.connections.len() <= self.most {
                peer.crowded = None;
                continue;
            }
            let crowded = peer.crowded.get_or_insert(Crowded { tell_at: now + self.settle, token: None });
            if crowded.tell_at <= now {
                crowded.tell_at = now + REMINDER;
                if crowded.token.is_none() {
                    crowded.token = Some(token(session, crowd_token(&self.name, name))?);
                }
                let from = peer.connections.iter().map(|it| it.from.clone()).collect();
                tell(News::Crowded { peer: name.clone(), most: self.most, from });
            }
        }
        Ok(())
    }
}

impl Peer {
    fn is_up(&self) -> bool {
        !self.connections.is_empty()
    }

    fn is_due(&self) -> bool {
        !self.is_up() && self.remind_after <= self.since.elapsed()
    }
}

/// Asks the router's own tables for its own token. One that is stuck does not come back.
fn probe(session: &Session, name: &str) -> Result<(), BusError> {
    let key = router_token(name);
    let replies = session.liveliness().get(&key).timeout(TURN).wait();
    let replies = replies.map_err(|cause| BusError::Declare { key, cause: cause.to_string() })?;
    replies.into_iter().for_each(drop);
    Ok(())
}

fn token(session: &Session, key: String) -> Result<LivelinessToken, BusError> {
    let declared = session.liveliness().declare_token(&key).wait();
    declared.map_err(|cause| BusError::Declare { key, cause: cause.to_string() })
}

/// The liveliness token of a router; it does not cross the link.
pub(super) fn router_token(name: &str) -> String {
    format!("router/{name}")
}

/// The liveliness token that a router holds while its link to `peer` is up.
pub(super) fn link_token(name: &str, peer: &str) -> String {
    format!("router/{name}/link/{peer}")
}

/// The liveliness token that a router holds while there are more connections under the name of `peer` than one machine makes.
pub(super) fn crowd_token(name: &str, peer: &str) -> String {
    format!("router/{name}/crowd/{peer}")
}
