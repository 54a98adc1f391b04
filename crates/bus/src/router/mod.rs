//! The router that every process of a side connects to, and the link to the other side's.

#![expect(
    clippy::disallowed_methods,
    reason = "links come and go one by one, and a lost event would leave a wrong view of them"
)]

use std::net::TcpListener;
use std::sync::mpsc;
use std::time::Duration;

use zenoh::Wait;

use crate::session::{config, set};
use crate::{BusError, Stop, sockets};

mod link;
mod obstacle;
mod second_way;
#[cfg(test)]
mod tests;
mod watch;

pub use link::{LinkEnd, Way};

use link::{quoted, set_up, watch_links};
use watch::{Heard, Watch};

/// What a running router tells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum News {
    /// It listens there; port 0 has become a free one.
    Listening(Vec<String>),
    /// The link to a peer is up.
    Up {
        /// The name in its certificate.
        peer: String,
    },
    /// It is down. It comes up again by itself.
    Down {
        /// The name in its certificate.
        peer: String,
        /// What stands in the way, if that is known.
        why: Option<String>,
        /// For how long it has been.
        since: Duration,
    },
    /// There are more connections under the name of a peer than its machine makes, for longer than it takes a lost one to end:
    /// another machine uses its certificate.
    Crowded {
        /// The name in the certificates.
        peer: String,
        /// How many there should be at most.
        most: usize,
        /// Where the connections come from.
        from: Vec<String>,
    },
    /// It still routes: a question that went through its tables came back.
    Turned,
}

/// Routes between the processes that connect, until stopped.
pub fn run_router(listen: &[String], stop: &Stop, ready: impl FnOnce(&[String])) -> Result<(), BusError> {
    let mut ready = Some(ready);
    run_linked_router(listen, None, stop, |news| {
        if let (News::Listening(bound), Some(ready)) = (news, ready.take()) {
            ready(&bound);
        }
    })
}

/// The same with one end of the link, which is made again whenever it breaks.
pub fn run_linked_router(
    listen: &[String],
    link: Option<&LinkEnd>,
    stop: &Stop,
    mut tell: impl FnMut(News),
) -> Result<(), BusError> {
    let listening = |cause: String| BusError::Listen { locators: listen.join(", "), cause };
    let mut listen = listen.to_vec();
    let mut config = config("router")?;
    if let Some(link) = link {
        set_up(&mut config, link)?;
        if let Way::Accept { locator, .. } = &link.way {
            listen.push(locator.clone());
        }
    }
    listen.iter().try_for_each(|it| try_out(it))?;
    set(&mut config, "listen/endpoints", &quoted(&listen))?;
    // Fail instead of running without being reachable, and do not wait for peers that never come.
    set(&mut config, "listen/exit_on_failure", "true")?;
    set(&mut config, "scouting/delay", "0")?;
    let session = zenoh::open(config).wait().map_err(|cause| listening(cause.to_string()))?;
    let bound: Vec<String> = session.info().locators().wait().iter().map(|it| it.to_string()).collect();
    if bound.is_empty() {
        return Err(listening("nothing was bound".into()));
    }
    let (sender, events) = mpsc::channel();
    let (told, heard) = (sender.clone(), sender.clone());
    stop.on_stop(move || drop(told.send(Heard::Stop)));
    watch_links(&session, move |connection, up| {
        // The router is ending if nobody listens any more.
        let _ = heard.send(Heard::Link { connection, up });
    })?;
    let second = link.map(|it| second_way::open(it, &session)).transpose()?.flatten();
    tell(News::Listening(bound));
    let mut watch = Watch::new(link, sender);
    watch.run(&session, &events, &mut tell)?;
    drop(watch);
    if let Some(second) = second {
        let _ = second.close().wait();
    }
    let _ = session.close().wait();
    Ok(())
}

/// Whether the address of a locator is free, since zenoh's own words about one that is not are for
/// its developers.
pub(crate) fn try_out(locator: &str) -> Result<(), BusError> {
    if let Some(path) = sockets::path_in(locator) {
        return Ok(sockets::check_to_listen(path)?);
    }
    let Some(("tcp" | "tls", address)) = locator.split_once('/') else { return Ok(()) };
    let address = address.split(['?', '#']).next().unwrap_or_default();
    let refused = |cause: std::io::Error| BusError::Listen { locators: locator.to_owned(), cause: cause.to_string() };
    TcpListener::bind(address).map(drop).map_err(refused)
}
