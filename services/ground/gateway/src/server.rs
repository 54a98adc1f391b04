//! Serves connections: a limited number at a time, encrypted where that is configured, and closed when the
//! handshake or the head of a request takes too long.
//!
//! The content of a request is not read here; the guard decides what the request may do.

use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use axum::Router;
use axum_server::accept::{Accept, NoDelayAcceptor};
use axum_server::tls_rustls::{RustlsAcceptor, RustlsConfig};
use axum_server::{Handle, Server};
use hyper_util::rt::TokioTimer;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tower_service::Service;

use crate::http::{self, Api};

/// A client that does not read delays the end of the server by no more than this.
const GRACE_PERIOD: Duration = Duration::from_secs(1);

/// Answers on `listener` until `shutdown` completes; open event streams are then ended. Connections are
/// encrypted with `tls`, if there is any.
///
/// # Errors
/// When the listener fails for good.
pub async fn serve(
    listener: TcpListener,
    tls: Option<Arc<rustls::ServerConfig>>,
    api: Api,
    shutdown: impl Future<Output = ()> + Send + 'static,
) -> io::Result<()> {
    // The limit for a handshake, and for the head of a request from the end of the request before.
    let head_timeout = api.config.head_timeout_s.seconds();
    let connections = Arc::new(Semaphore::new(usize::from(api.config.max_connections.get())));
    let (close, closing) = watch::channel(());
    let router = http::router(api, closing);
    let shutdown = async move {
        shutdown.await;
        drop(close);
    };
    match tls {
        None => run(listener, router, Limited { connections, acceptor: NoDelayAcceptor }, head_timeout, shutdown).await,
        Some(config) => {
            let acceptor = RustlsAcceptor::new(RustlsConfig::from_config(config)).handshake_timeout(head_timeout);
            let acceptor = acceptor.acceptor(NoDelayAcceptor);
            run(listener, router, Limited { connections, acceptor }, head_timeout, shutdown).await
        }
    }
}

async fn run<A>(
    listener: TcpListener,
    router: Router,
    acceptor: Limited<A>,
    head_timeout: Duration,
    shutdown: impl Future<Output = ()> + Send + 'static,
) -> io::Result<()>
where
    A: Accept<TcpStream, Router, Service = Router> + Clone + Send + Sync + 'static,
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
    server.http_builder().http1().timer(TokioTimer::new()).header_read_timeout(head_timeout);
    let served = server.serve(router.into_make_service()).await;
    watch.abort();
    served
}

/// Accepts connections while there are permits; more are closed at once.
#[derive(Clone)]
struct Limited<A> {
    connections: Arc<Semaphore>,
    acceptor: A,
}

impl<A> Accept<TcpStream, Router> for Limited<A>
where
    A: Accept<TcpStream, Router, Service = Router>,
    A::Future: Send + 'static,
{
    type Stream = A::Stream;
    type Service = Connection;
    type Future = Pin<Box<dyn Future<Output = io::Result<(A::Stream, Connection)>> + Send>>;

    fn accept(&self, stream: TcpStream, service: Router) -> Self::Future {
        let Ok(permit) = self.connections.clone().try_acquire_owned() else {
            return Box::pin(async { Err(io::Error::other("the limit of open connections is reached")) });
        };
        let accepting = self.acceptor.accept(stream, service);
        Box::pin(async {
            let (stream, router) = accepting.await?;
            Ok((stream, Connection { router, _permit: Arc::new(permit) }))
        })
    }
}

/// Answers the requests of one connection, and holds its permit while it is open.
#[derive(Clone)]
struct Connection {
    router: Router,
    _permit: Arc<OwnedSemaphorePermit>,
}

impl<B> Service<axum::http::Request<B>> for Connection
where
    Router: Service<axum::http::Request<B>>,
{
    type Response = <Router as Service<axum::http::Request<B>>>::Response;
    type Error = <Router as Service<axum::http::Request<B>>>::Error;
    type Future = <Router as Service<axum::http::Request<B>>>::Future;

    fn poll_ready(&mut self, context: &mut Context<'_>) -> Poll<Result<(), Self::Error>> {
        self.router.poll_ready(context)
    }

    fn call(&mut self, request: axum::http::Request<B>) -> Self::Future {
        self.router.call(request)
    }
}
