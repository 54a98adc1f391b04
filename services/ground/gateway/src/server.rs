//! The doorkeeper of the gateway: takes connections, so many at a time, encrypts them where that is
//! configured, and cuts those that take their time with a handshake or a head.
//!
//! What a request may be is the business of [`guard`](crate::guard); here nothing is read yet.

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
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tower_service::Service;

/// How long a client that does not read may hold up the end.
const LAST_GOODBYE: Duration = Duration::from_secs(1);

/// How connections are taken.
pub(crate) struct Entrance {
    /// What they are encrypted with; `None`: they are not.
    pub(crate) tls: Option<Arc<rustls::ServerConfig>>,
    /// Wall time for a handshake, and for the head of a request, from the end of the one before on.
    pub(crate) head_limit: Duration,
    /// Open at a time; more are closed at once.
    pub(crate) most: usize,
}

/// Answers on `listener` until `shutdown` completes and everybody has left, or has had time to.
pub(crate) async fn serve(
    listener: TcpListener,
    router: Router,
    entrance: Entrance,
    shutdown: impl Future<Output = ()> + Send + 'static,
) -> io::Result<()> {
    let Entrance { tls, head_limit, most } = entrance;
    let seats = Arc::new(Semaphore::new(most));
    match tls {
        None => run(listener, router, Seats { seats, acceptor: NoDelayAcceptor }, head_limit, shutdown).await,
        Some(config) => {
            let acceptor = RustlsAcceptor::new(RustlsConfig::from_config(config)).handshake_timeout(head_limit);
            let acceptor = acceptor.acceptor(NoDelayAcceptor);
            run(listener, router, Seats { seats, acceptor }, head_limit, shutdown).await
        }
    }
}

async fn run<A>(
    listener: TcpListener,
    router: Router,
    acceptor: Seats<A>,
    head_limit: Duration,
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
        stopping.graceful_shutdown(Some(LAST_GOODBYE));
    });
    let server = Server::<SocketAddr>::from_listener(listener).acceptor(acceptor);
    // HTTP/1.1 alone: whether a client speaks HTTP/2 would be waited for without a limit.
    let mut server = server.handle(handle).http1_only();
    server.http_builder().http1().timer(TokioTimer::new()).header_read_timeout(head_limit);
    let served = server.serve(router.into_make_service()).await;
    watch.abort();
    served
}

/// Gives each connection a seat, for as long as it lasts.
#[derive(Clone)]
struct Seats<A> {
    seats: Arc<Semaphore>,
    acceptor: A,
}

impl<A> Accept<TcpStream, Router> for Seats<A>
where
    A: Accept<TcpStream, Router, Service = Router>,
    A::Future: Send + 'static,
{
    type Stream = A::Stream;
    type Service = Seated;
    type Future = Pin<Box<dyn Future<Output = io::Result<(A::Stream, Seated)>> + Send>>;

    fn accept(&self, stream: TcpStream, service: Router) -> Self::Future {
        let Ok(seat) = self.seats.clone().try_acquire_owned() else {
            return Box::pin(async { Err(io::Error::other("every seat is taken")) });
        };
        let accepting = self.acceptor.accept(stream, service);
        Box::pin(async {
            let (stream, router) = accepting.await?;
            Ok((stream, Seated { router, _seat: Arc::new(seat) }))
        })
    }
}

/// What answers a connection, which lives as long as that.
#[derive(Clone)]
struct Seated {
    router: Router,
    _seat: Arc<OwnedSemaphorePermit>,
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

    fn call(&mut self, request: axum::http::Request<B>) -> Self::Future {
        self.router.call(request)
    }
}
