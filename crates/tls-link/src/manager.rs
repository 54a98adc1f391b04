//! Calls other ends and listens for calls.

#![expect(
    clippy::disallowed_methods,
    reason = "after an error of the operating system there is no event to wait for; refusals are counted by the minute"
)]

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use credentials::{Credentials, End, InvalidCredentials, Stamp, called_at};
use regular_file::Followed;
use rustls::ClientConfig;
use tokio::net::{TcpListener, TcpStream};
use tokio_rustls::{TlsAcceptor, TlsConnector};
use tokio_util::sync::CancellationToken;
use zenoh_link_commons::tcp::get_tcp_addrs;
use zenoh_link_commons::{
    LinkManagerUnicastTrait, LinkUnicast, LinkUnicastTrait, ListenersUnicastIP, NewLinkChannelSender,
};
use zenoh_protocol::core::endpoint::Address;
use zenoh_protocol::core::{EndPoint, Locator};
use zenoh_result::{ZResult, zerror};

use crate::LOG;
use crate::callers::{Callers, Refusals};
use crate::link::TlsLink;
use crate::settings::{self, Caller, socket};

/// A caller that takes longer to show its certificate is hung up on.
const HANDSHAKE_LIMIT: Duration = Duration::from_secs(10);
/// After the kernel has refused a connection, mostly since there are too many.
const PAUSE: Duration = Duration::from_millis(100);

/// Makes links over TLS for zenoh.
pub struct LinkManagerUnicastTls {
    incoming: NewLinkChannelSender,
    listeners: ListenersUnicastIP,
    /// What it has called with.
    callings: Mutex<Vec<Calling>>,
}

impl LinkManagerUnicastTls {
    /// Links that others make go to `incoming`.
    pub fn new(incoming: NewLinkChannelSender) -> LinkManagerUnicastTls {
        LinkManagerUnicastTls { incoming, listeners: ListenersUnicastIP::new(), callings: Mutex::default() }
    }
}

#[async_trait::async_trait]
impl LinkManagerUnicastTrait for LinkManagerUnicastTls {
    /// Calls, for as long as zenoh waits for it.
    async fn new_link(&self, endpoint: EndPoint) -> ZResult<LinkUnicast> {
        let config = endpoint.config();
        let caller = settings::of_caller(&config)?;
        // Before they are read: what is replaced from here on is noticed.
        let stamp = caller.credentials.stamp();
        let (client, stamp) = self.calling(&caller, stamp).map_err(|invalid| zerror!("{invalid}"))?;
        let connector = TlsConnector::from(client);
        let name = called_at(endpoint.address().as_str()).map_err(|cause| zerror!("{cause}"))?;
        let addresses = get_tcp_addrs(endpoint.address()).await?;
        let (tcp, own, other) = socket(&config)?.new_link_first_reachable(addresses).await?;
        let stream = connector.connect(name.clone(), tcp).await.map_err(|cause| zerror!("{endpoint}: {cause}"))?;
        let link = Arc::new(TlsLink::over(stream.into(), own, other)?);
        link.keep_checking(caller.credentials, stamp, End::Called(name));
        Ok(LinkUnicast::from(link as Arc<dyn LinkUnicastTrait>))
    }

    async fn new_listener(&self, endpoint: EndPoint) -> ZResult<Locator> {
        let config = endpoint.config();
        let entrance = Entrance::open(settings::of_listener(&config)?)?;
        let (listener, bound) = socket(&config)?.new_listener(&address_of(&endpoint).await?)?;
        let host = host_of(&endpoint.address())?.to_owned();
        let locator = Locator::new(endpoint.protocol(), format!("{host}:{}", bound.port()), endpoint.metadata())?;
        let listening = EndPoint::new(locator.protocol(), locator.address(), locator.metadata(), endpoint.config())?;
        let stop = self.listeners.token.child_token();
        let task = accept(listener, entrance, stop.clone(), self.incoming.clone());
        self.listeners.add_listener(listening, bound, task, stop).await?;
        Ok(locator)
    }

    async fn del_listener(&self, endpoint: &EndPoint) -> ZResult<()> {
        self.listeners.del_listener(address_of(endpoint).await?).await
    }

    async fn get_listeners(&self) -> Vec<EndPoint> {
        self.listeners.get_endpoints()
    }

    async fn get_locators(&self) -> Vec<Locator> {
        self.listeners.get_locators()
    }

    async fn get_locators_noloopback(&self) -> Vec<Locator> {
        self.listeners.get_locators_noloopback()
    }
}

impl LinkManagerUnicastTls {
    /// What to call with, and the stamp of the files that it comes from: the current files, which have `stamp`, or, if
    /// they cannot be used, the previous ones. A file being copied is incomplete for a moment, and a broken link must
    /// come back then too.
    fn calling(&self, caller: &Caller, stamp: Stamp) -> Result<(Arc<ClientConfig>, Stamp), InvalidCredentials> {
        let mut callings = self.callings.lock().unwrap_or_else(|it| it.into_inner());
        let Some(known) = callings.iter_mut().find(|it| it.caller == *caller) else {
            let client = (Arc::new(caller.client()?), stamp.clone());
            callings.push(Calling { caller: caller.clone(), client: Followed::new(stamp, client.clone()) });
            return Ok(client);
        };
        let found = known.client.look(stamp, |stamp, _| Ok((Arc::new(caller.client()?), stamp.clone())));
        if let Some(Err(unusable)) = found {
            tracing::warn!(target: LOG, %unusable, "calls are made with the previous credentials");
        }
        Ok(known.client.value().clone())
    }
}

/// What is made of credentials, and what their files were like then.
type Made<T> = Followed<Stamp, (T, Stamp), String>;

/// What calls are made with.
struct Calling {
    caller: Caller,
    client: Made<Arc<ClientConfig>>,
}

/// What callers are let in by: the files as they are when a call comes.
struct Entrance {
    credentials: Credentials,
    acceptor: Made<TlsAcceptor>,
}

impl Entrance {
    fn open(credentials: Credentials) -> ZResult<Entrance> {
        let stamp = credentials.stamp();
        let acceptor = acceptor(&credentials).map_err(|invalid| zerror!("{invalid}"))?;
        Ok(Entrance { credentials, acceptor: Followed::new(stamp.clone(), (acceptor, stamp)) })
    }

    /// What lets the next caller in, by files that may have been replaced. Those that cannot be used change nothing.
    fn renewed(&mut self) -> (TlsAcceptor, Stamp) {
        let Entrance { credentials, acceptor: followed } = self;
        let found = followed.look(credentials.stamp(), |stamp, _| Ok((acceptor(credentials)?, stamp.clone())));
        if let Some(Err(unusable)) = found {
            tracing::warn!(target: LOG, %unusable, "callers are let in by the previous credentials");
        }
        followed.value().clone()
    }
}

fn acceptor(credentials: &Credentials) -> Result<TlsAcceptor, InvalidCredentials> {
    credentials.server().map(|it| TlsAcceptor::from(Arc::new(it)))
}

/// Takes calls until stopped; nobody waits for another's handshake.
async fn accept(
    listener: TcpListener,
    mut entrance: Entrance,
    stop: CancellationToken,
    incoming: NewLinkChannelSender,
) -> ZResult<()> {
    let mut callers = Callers::default();
    let refusals = Arc::new(Mutex::new(Refusals::default()));
    loop {
        let call = tokio::select! {
            () = stop.cancelled() => return Ok(()),
            call = listener.accept() => call,
        };
        match call {
            Ok((tcp, other)) => {
                let (acceptor, used) = entrance.renewed();
                let credentials = entrance.credentials.clone();
                let greeting = Greeting { other, acceptor, credentials, used, incoming: incoming.clone() };
                let refusals = refusals.clone();
                callers.greet(other.ip(), async move {
                    if let Err(cause) = greeting.greet(tcp).await {
                        let due = refusals.lock().unwrap_or_else(|it| it.into_inner()).count(Instant::now());
                        if let Some(count) = due {
                            tracing::warn!(target: LOG, %other, %cause, count, "not let in; further ones are counted for a while");
                        }
                    }
                });
            }
            Err(cause) => {
                tracing::warn!(%cause, "a call is not taken");
                tokio::time::sleep(PAUSE).await;
            }
        }
    }
}

/// A caller's handshake.
struct Greeting {
    other: SocketAddr,
    acceptor: TlsAcceptor,
    credentials: Credentials,
    /// What the files were like that the acceptor comes from.
    used: Stamp,
    incoming: NewLinkChannelSender,
}

impl Greeting {
    async fn greet(self, tcp: TcpStream) -> ZResult<()> {
        let own = tcp.local_addr()?;
        let stream = tokio::time::timeout(HANDSHAKE_LIMIT, self.acceptor.accept(tcp)).await??;
        let link = Arc::new(TlsLink::over(stream.into(), own, self.other)?);
        link.keep_checking(self.credentials, self.used, End::Caller);
        Ok(self.incoming.send_async(LinkUnicast::from(link as Arc<dyn LinkUnicastTrait>)).await?)
    }
}

fn host_of<'a>(address: &'a Address) -> ZResult<&'a str> {
    let parts = address.as_str().rsplit_once(':');
    Ok(parts.ok_or_else(|| zerror!("found `{address}`, expected `HOST:PORT`"))?.0)
}

async fn address_of(endpoint: &EndPoint) -> ZResult<SocketAddr> {
    let found = get_tcp_addrs(endpoint.address()).await?.next();
    Ok(found.ok_or_else(|| zerror!("`{}` is not found", endpoint.address()))?)
}
