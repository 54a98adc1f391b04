//! Who is at the other end of the link, shown to others as liveliness tokens, and reported when it changes.

#![expect(clippy::disallowed_methods, reason = "links are watched on the wall clock")]

use std::collections::BTreeMap;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

use zenoh::liveliness::LivelinessToken;
use zenoh::{Session, Wait};

use super::obstacle::obstacle;
use super::{LinkEnd, News, Way};
use crate::{BusError, link_credentials};

/// A link that is down is reported again after this time.
const REMINDER: Duration = Duration::from_secs(30);
/// Tells at least this often that it still routes.
const TURN: Duration = Duration::from_millis(500);
/// A link that has never been up is reported for the first time after this long. One that can be made is up sooner.
const FIRST_REMINDER: Duration = Duration::from_secs(5);

/// What the router has heard.
pub(super) enum Heard {
    Link { peer: String, up: bool },
    Stop,
}

/// Who is at the other end, shown to others as a liveliness token, and reported when it changes.
pub(super) struct Watch {
    name: String,
    link: Option<LinkEnd>,
    peers: BTreeMap<String, Peer>,
    _alive: Option<LivelinessToken>,
}

struct Peer {
    /// Links to it: a new one may be up before the old one is known to be down.
    links: usize,
    since: Instant,
    remind_after: Duration,
    token: Option<LivelinessToken>,
}

impl Watch {
    pub(super) fn new(link: Option<&LinkEnd>) -> Watch {
        let peer = |name| (name, Peer { links: 0, since: Instant::now(), remind_after: FIRST_REMINDER, token: None });
        let peers = link.map(|it| it.peers().into_iter().map(peer).collect()).unwrap_or_default();
        let name = link.map_or_else(|| "router".to_owned(), LinkEnd::name);
        Watch { name, link: link.cloned(), peers, _alive: None }
    }

    /// What stands in the way, as far as this end can tell: its own credentials, or the router that it calls.
    fn obstacle(&self) -> Option<String> {
        let link = self.link.as_ref()?;
        let invalid =
            link_credentials::check(&link.credentials, &self.name, link.side()).err().map(|it| it.to_string());
        invalid.or_else(|| match &link.way {
            Way::Dial { locator, .. } => obstacle(&link.credentials, locator.trim_start_matches("tls/")),
            Way::Accept { .. } => None,
        })
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
                Ok(Heard::Link { peer, up }) => self.heard(session, peer, up, tell)?,
                Err(RecvTimeoutError::Timeout) => self.remind(tell),
            }
        }
    }

    fn heard(
        &mut self,
        session: &Session,
        name: String,
        up: bool,
        tell: &mut impl FnMut(News),
    ) -> Result<(), BusError> {
        // One that is not expected has a certificate all the same, and is denied everything.
        let Some(peer) = self.peers.get_mut(&name) else { return Ok(()) };
        let was_up = 0 < peer.links;
        peer.links = if up { peer.links + 1 } else { peer.links.saturating_sub(1) };
        match (was_up, 0 < peer.links) {
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
        let down = self.peers.values().filter(|it| it.links == 0);
        let left = down.map(|it| it.remind_after.saturating_sub(it.since.elapsed()));
        left.min().unwrap_or(Duration::from_secs(3600))
    }

    fn remind(&mut self, tell: &mut impl FnMut(News)) {
        let due = |it: &Peer| it.links == 0 && it.remind_after <= it.since.elapsed();
        if !self.peers.values().any(due) {
            return;
        }
        let why = self.obstacle();
        for (name, peer) in self.peers.iter_mut().filter(|(_, it)| due(it)) {
            let since = peer.since.elapsed();
            peer.remind_after = since + REMINDER;
            tell(News::Down { peer: name.clone(), why: why.clone(), since });
        }
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
