//! Calls other ends and listens for calls.

#![expect(clippy::disallowed_methods, reason = "after an error of the operating system there is no event to wait for")]

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use rustls::pki_types::ServerName;
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

use crate::callers::Callers;
use crate::link::TlsLink;
use crate::settings::{self, socket};

/// A caller that takes longer to show its certificate is hung up on.
const HANDSHAKE_LIMIT: Duration = Duration::from_secs(10);
/// After the kernel has refused a connection, mostly since there are too many.
const PAUSE: Duration = Duration::from_millis(100);

/// Makes links over TLS for zenoh.
pub struct LinkManagerUnicastTls {
    incoming: NewLinkChannelSender,
    listeners: ListenersUnicastIP,
}

impl LinkManagerUnicastTls {
    /// Links that others make go to `incoming`.
    pub fn new(incoming: NewLinkChannelSender) -> LinkManagerUnicastTls {
        LinkManagerUnicastTls { incoming, listeners: ListenersUnicastIP::new() }
    }
}

#[async_trait::async_trait]
impl LinkManagerUnicastTrait for LinkManagerUnicastTls {
    /// Calls, for as long as zenoh waits for it.
    async fn new_link(&self, endpoint: EndPoint) -> ZResult<LinkUnicast> {
        let config = endpoint.config();
        let client = settings::of_caller(&config)?.client().map_err(|invalid| zerror!("{invalid}"))?;
        let connector = TlsConnector::from(Arc::new(client));
        let name =
            ServerName::try_from(host_of(&endpoint.address())?.to_owned()).map_err(|cause| zerror!("{cause}"))?;
        let addresses = get_tcp_addrs(endpoint.address()).await?;
        let (tcp, own, other) = socket(&config)?.new_link_first_reachable(addresses).await?;
        let stream = connector.connect(name, tcp).await.map_err(|cause| zerror!("{endpoint}: {cause}"))?;
        Ok(LinkUnicast::from(Arc::new(TlsLink::over(stream.into(), own, other)?) as Arc<dyn LinkUnicastTrait>))
    }

    async fn new_listener(&self, endpoint: EndPoint) -> ZResult<Locator> {
        let config = endpoint.config();
        let server = settings::of_listener(&config)?.server().map_err(|invalid| zerror!("{invalid}"))?;
        let acceptor = TlsAcceptor::from(Arc::new(server));
        let (listener, bound) = socket(&config)?.new_listener(&address_of(&endpoint).await?)?;
        let host = host_of(&endpoint.address())?.to_owned();
        let locator = Locator::new(endpoint.protocol(), format!("{host}:{}", bound.port()), endpoint.metadata())?;
        let listening = EndPoint::new(locator.protocol(), locator.address(), locator.metadata(), endpoint.config())?;
        let stop = self.listeners.token.child_token();
        let task = accept(listener, acceptor, stop.clone(), self.incoming.clone());
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

/// Takes calls until stopped; nobody waits for another's handshake.
async fn accept(
    listener: TcpListener,
    acceptor: TlsAcceptor,
    stop: CancellationToken,
    incoming: NewLinkChannelSender,
) -> ZResult<()> {
    let mut callers = Callers::default();
    loop {
        let call = tokio::select! {
            () = stop.cancelled() => return Ok(()),
            call = listener.accept() => call,
        };
        match call {
            Ok((tcp, other)) => {
                let (acceptor, incoming) = (acceptor.clone(), incoming.clone());
                callers.greet(other.ip(), async move {
                    if let Err(cause) = greet(tcp, other, acceptor, incoming).await {
                        tracing::debug!(%other, %cause, "not let in");
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

async fn greet(
    tcp: TcpStream,
    other: SocketAddr,
    acceptor: TlsAcceptor,
    incoming: NewLinkChannelSender,
) -> ZResult<()> {
    let own = tcp.local_addr()?;
    let stream = tokio::time::timeout(HANDSHAKE_LIMIT, acceptor.accept(tcp)).await??;
    let link: Arc<dyn LinkUnicastTrait> = Arc::new(TlsLink::over(stream.into(), own, other)?);
    Ok(incoming.send_async(LinkUnicast::from(link)).await?)
}

fn host_of<'a>(address: &'a Address) -> ZResult<&'a str> {
    let parts = address.as_str().rsplit_once(':');
    Ok(parts.ok_or_else(|| zerror!("found `{address}`, expected `HOST:PORT`"))?.0)
}

async fn address_of(endpoint: &EndPoint) -> ZResult<SocketAddr> {
    let found = get_tcp_addrs(endpoint.address()).await?.next();
    Ok(found.ok_or_else(|| zerror!("`{}` is not found", endpoint.address()))?)
}
