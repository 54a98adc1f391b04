//! Looks for one service on the bus, as a health check does: briefly, and leaving no trace of its own.

#![expect(clippy::disallowed_methods, reason = "somebody waits for the answer, on the wall clock")]

use std::sync::mpsc;
use std::time::{Duration, Instant};

use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1::Heartbeat;
use zenoh::{Session, Wait};

use crate::{BusError, Link, keys, session};

/// More heartbeats than a fleet sends while the tokens are asked for.
const HEARTBEATS: usize = 1024;

/// How a service fares.
#[derive(Debug, Clone, PartialEq)]
pub enum Presence {
    /// It is there and its loop turns.
    Alive(Heartbeat),
    /// It is there and has shown no progress while it was looked for.
    Stuck,
    /// It is not there.
    Absent,
}

/// Looks for the service that stands in the scope of `link`, for `patience` once a router answers.
///
/// # Errors
/// If no router answers there.
pub fn look_for(link: &Link, service: &str, patience: Duration) -> Result<Presence, BusError> {
    let session = session::open(link)?;
    let presence = look(&session, service, Instant::now() + patience);
    // The answer is known, even if closing fails.
    let _ = session.close().wait();
    presence
}

/// A router as its own side sees it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RouterView {
    /// As its certificate calls it, if it has one.
    pub name: String,
    /// The routers to which its link is up.
    pub links: Vec<String>,
    /// Those of them whose certificate seems to be used by another machine as well.
    pub crowded: Vec<String>,
}

/// Looks at the router where `link` leads; `None` if it does not say who it is within `patience`.
///
/// # Errors
/// If none answers there.
pub fn look_at_router(link: &Link, patience: Duration) -> Result<Option<RouterView>, BusError> {
    let session = session::open(link)?;
    let tokens = tokens(&session, "router/**", Instant::now() + patience);
    let _ = session.close().wait();
    Ok(view(&tokens?))
}

/// `router/NAME`, `router/NAME/link/PEER` for each link that is up, and `router/NAME/crowd/PEER` for each peer with too many
/// connections.
fn view(tokens: &[String]) -> Option<RouterView> {
    let chunks: Vec<Vec<&str>> = tokens.iter().map(|it| it.split('/').collect()).collect();
    let name = chunks.iter().find_map(|it| if let ["router", name] = it[..] { Some(name.to_owned()) } else { None })?;
    let peers = |what: &str| {
        let peer = |it: &Vec<&str>| match it[..] {
            ["router", _, said, peer] if said == what => Some(peer.to_owned()),
            _ => None,
        };
        let mut peers: Vec<_> = chunks.iter().filter_map(peer).collect();
        peers.sort();
        peers
    };
    Some(RouterView { name, links: peers("link"), crowded: peers("crowd") })
}

/// A liveliness token says that the process has a link, a heartbeat that its loop turns.
fn look(session: &Session, service: &str, until: Instant) -> Result<Presence, BusError> {
    let heartbeats = listen(session)?;
    let instances = instances(session, service, until)?.found;
    if instances.is_empty() {
        return Ok(Presence::Absent);
    }
    while let Ok(heartbeat) = heartbeats.recv_timeout(until.saturating_duration_since(Instant::now())) {
        if heartbeat.service == service && instances.contains(&heartbeat.instance) {
            return Ok(Presence::Alive(heartbeat));
        }
    }
    Ok(Presence::Stuck)
}

fn listen(session: &Session) -> Result<mpsc::Receiver<Heartbeat>, BusError> {
    let (sender, heartbeats) = mpsc::sync_channel(HEARTBEATS);
    session
        .declare_subscriber(Topic::Heartbeat.key())
        .callback(move |sample| {
            if let Ok(Message::Heartbeat(it)) = Message::decode(Topic::Heartbeat, &sample.payload().to_bytes()) {
                // Fails once enough has been heard, or if many wait to be read: others follow within a second.
                let _ = sender.try_send(it);
            }
        })
        .background()
        .wait()
        .map_err(|cause| refused(Topic::Heartbeat.key(), &*cause))?;
    Ok(heartbeats)
}

/// The processes of a service, as a router has told.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Instances {
    /// Those that are there.
    pub(crate) found: Vec<String>,
    /// The answer came to its end; one that was cut off says nothing about others.
    pub(crate) is_whole: bool,
}

/// The processes of a service that are there.
pub(crate) fn instances(session: &Session, service: &str, until: Instant) -> Result<Instances, BusError> {
    let tokens = tokens(session, &keys::alive(service, "*"), until)?;
    let found = tokens.iter().filter_map(|it| Some(keys::parse_alive(it)?.1.to_owned())).collect();
    Ok(Instances { found, is_whole: Instant::now() < until })
}

/// The liveliness tokens that are there.
fn tokens(session: &Session, key: &str, until: Instant) -> Result<Vec<String>, BusError> {
    let left = until.saturating_duration_since(Instant::now());
    let replies = session.liveliness().get(key).timeout(left).wait().map_err(|cause| refused(key, &*cause))?;
    let tokens = replies.into_iter().filter_map(|it| it.into_result().ok());
    Ok(tokens.map(|it| it.key_expr().as_str().to_owned()).collect())
}

fn refused(key: &str, cause: &dyn std::fmt::Display) -> BusError {
    BusError::Declare { key: key.to_owned(), cause: cause.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_router_is_known_by_its_tokens() {
        #[track_caller]
        fn check(tokens: &[&str], expected: Option<(&str, &[&str], &[&str])>) {
            let tokens: Vec<String> = tokens.iter().map(|it| (*it).to_owned()).collect();
            let found = view(&tokens);
            let names = |it: &[&str]| it.iter().map(|it| (*it).to_owned()).collect();
            let expected = expected.map(|(name, links, crowded)| RouterView {
                name: name.into(),
                links: names(links),
                crowded: names(crowded),
            });
            assert_eq!(found, expected, "{tokens:?}");
        }
        check(&[], None);
        check(&["router/router"], Some(("router", &[], &[])));
        let links =
            ["router/ground-router/link/uav2-router", "router/ground-router", "router/ground-router/link/uav1-router"];
        check(&links, Some(("ground-router", &["uav1-router", "uav2-router"], &[])));
        let crowd = ["router/ground-router", "router/ground-router/crowd/uav1-router"];
        check(&crowd, Some(("ground-router", &[], &["uav1-router"])));
        check(&["router/ground-router/link/uav1-router"], None);
    }
}
