//! Serves connections: those that have a seat (`seats`), encrypted where that is configured, and closed when the
//! handshake or the head of a request takes too long.
//!
//! The content of a request is not read here; the guard decides what the request may do. The memory of a connection is
//! bounded: what waits for a client that does not read is some kilobytes of its own, texts that all share, and answers that
//! `answer_memory` counts.

use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use axum::Router;
use axum_server::accept::Accept;
use axum_server::tls_rustls::{RustlsAcceptor, RustlsConfig};
use axum_server::{Handle, Server};
use hyper_util::rt::TokioTimer;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;
use tokio::task::JoinSet;
use tokio::time::{MissedTickBehavior, interval};
use tower_service::Service;

use crate::access::{CurrentTokens, LOOK_PERIOD, utc_ms_now};
use crate::connection::Connection;
use crate::http::caller::Caller;
use crate::http::standstill::{Standstill, TICK, since_boot};
use crate::http::{self, Api};
use crate::seats::Seats;

/// A client that does not read delays the end of the server by no more than this.
const GRACE_PERIOD: Duration = Duration::from_secs(1);
/// Bytes of a connection's buffers, for the head of a request and for what waits to be sent.
const BUFFER: usize = 16 * 1024;
/// Encrypted bytes that wait to be sent, beyond those. With 16 KiB, two thousand streams that nobody reads took a quarter more.
const TLS_BUFFER: usize = 4 * 1024;

/// Answers on `listener` until `shutdown` completes; open event streams are then ended. Connections are
/// encrypted with `tls`, if there is any. Whether tokens are taken away is for others to notice (`file_watch`); the seats of their
/// holders are given back here.
///
/// Neither the argument nor the result is generic: each caller would compile the HTTP server again.
///
/// # Errors
/// When the listener fails for good.
pub fn serve(
    listener: TcpListener,
    tls: Option<Arc<rustls::ServerConfig>>,
    api: Api,
    shutdown: Boxed<()>,
) -> Boxed<io::Result<()>> {
    Box::pin(answer(listener, tls, api, shutdown))
}

/// A future whose type does not name what it is made from.
pub type Boxed<T> = Pin<Box<dyn Future<Output = T> + Send>>;

async fn answer(
    listener: TcpListener,
    tls: Option<Arc<rustls::ServerConfig>>,
    api: Api,
    shutdown: Boxed<()>,
) -> io::Result<()> {
    // The limit for a handshake, and for the head of a request from the end of the request before.
    let head_timeout = api.config.head_timeout_s.seconds();
    let seats = Seats::new(api.config.max_connections.get().into(), &api.config.clients);
    let seating = Seating { seats: seats.clone(), write_timeout: api.config.clients.write_timeout_s.seconds() };
    let (close, closing) = watch::channel(());
    // Ends with this function.
    let mut beside = JoinSet::new();
    beside.spawn(tick(api.standstill.clone()));
    beside.spawn(give_back(seats, api.tokens.clone()));
    let router = http::router(api, closing);
    let shutdown: Boxed<()> = Box::pin(async move {
        shutdown.await;
        drop(close);
    });
    match tls {
        None => run(listener, router, seating, head_timeout, shutdown).await,
        Some(config) => {
            let acceptor = RustlsAcceptor::new(RustlsConfig::from_config(config)).handshake_timeout(head_timeout);
            run(listener, router, Bounded(acceptor.acceptor(seating)), head_timeout, shutdown).await
        }
    }
}

/// Notices when this process stood still. It runs where requests are read, so that it does not tick while they wait.
async fn tick(standstill: Standstill) {
    let mut ticks = interval(TICK);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        ticks.tick().await;
        standstill.tick(since_boot());
    }
}

/// Gives back the seats of those whose tokens were taken away, or have expired.
async fn give_back(seats: Arc<Seats>, tokens: Arc<CurrentTokens>) {
    let mut looks = interval(LOOK_PERIOD);
    looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        looks.tick().await;
        let (valid, utc_ms) = (tokens.get(), utc_ms_now());
        seats.keep(|who| valid.has_token(&who.token_hash(), utc_ms));
    }
}

async fn run<A>(
    listener: TcpListener,
    router: Router,
    acceptor: A,
    head_timeout: Duration,
    shutdown: Boxed<()>,
) -> io::Result<()>
where
    A: Accept<TcpStream, Router, Service = Seated> + Clone + Send + Sync + 'static,
    A::Stream: AsyncRead + AsyncWrite + Unpin + Send + 'static,
    A::Future: Send + 'static,
{
    let handle = Handle::new();
    let stopping = handle.clone();
    let watch = tokio::spawn(async move {
        shutdown.await;
        stopping.graceful_shutdown(Some(GRACE_PERIOD));
    });
    let server = Server::<SocketAddr>::from_listener(listener).acceptor(acceptor);
    // HTTP/1.1 only: a server that also speaks HTTP/2 waits without a limit for the client's first bytes.
    let mut server = server.handle(handle).http1_only();
    let mut builder = server.http_builder().http1();
    builder.timer(TokioTimer::new()).header_read_timeout(head_timeout).max_buf_size(BUFFER);
    let served = server.serve(router.into_make_service()).await;
    watch.abort();
    served
}

/// Gives each connection a seat.
#[derive(Clone)]
struct Seating {
    seats: Arc<Seats>,
    write_timeout: Duration,
}

impl Accept<TcpStream, Router> for Seating {
    type Stream = Connection;
    type Service = Seated;
    type Future = std::future::Ready<io::Result<(Connection, Seated)>>;

    fn accept(&self, stream: TcpStream, router: Router) -> Self::Future {
        std::future::ready(stream.set_nodelay(true).and_then(|()| stream.peer_addr()).map(|peer| {
            let (seat, close) = self.seats.take(peer.ip());
            let seated = Seated { router, caller: Caller(Some(Arc::new(seat))) };
            (Connection::new(stream, close, self.write_timeout), seated)
        }))
    }
}

/// Bounds what TLS buffers for a client that does not read.
#[derive(Clone)]
struct Bounded(RustlsAcceptor<Seating>);

impl Accept<TcpStream, Router> for Bounded {
    type Stream = tokio_rustls::server::TlsStream<Connection>;
    type Service = Seated;
    type Future = Pin<Box<dyn Future<Output = io::Result<(Self::Stream, Seated)>> + Send>>;

    fn accept(&self, stream: TcpStream, router: Router) -> Self::Future {
        let accepting = self.0.accept(stream, router);
        Box::pin(async {
            let (mut stream, seated) = accepting.await?;
            stream.get_mut().1.set_buffer_limit(Some(TLS_BUFFER));
            Ok((stream, seated))
        })
    }
}

/// Answers the requests of one connection, and has its seat while it is open.
#[derive(Clone)]
struct Seated {
    router: Router,
    caller: Caller,
}

impl<B> Service<axum::http::Request<B>> for Seated
where
    Router: Service<axum::http::Request<B>>,
{
    type Response = <Router as Service<axum::http::Request<B>>>::Response;
    type Error = <Router as Service<axum::http::Request<B>>>::Error;
    type Future = <Router as Service<axum::http::Request<B>>>::Future;

    fn poll_ready(&mut self, context: &mut Context<'_>) -> Poll<Result<(), Self::Error>> {
        self.router.poll_ready(context)
    }

    fn call(&mut self, mut request: axum::http::Request<B>) -> Self::Future {
        request.extensions_mut().insert(self.caller.clone());
        self.router.call(request)
    }
}
