//! The stream of one connection: it ends when its seat is given to another, and when its client takes nothing of what waits
//! to be sent.

use std::future::Future;
use std::io;
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio::sync::oneshot;
use tokio::time::{Instant, Sleep, sleep_until};

/// A TCP stream with a limit on how long it waits for its client.
#[derive(Debug)]
pub(crate) struct Connection {
    stream: TcpStream,
    /// Ends when the connection has to; absent once it has ended, for a receiver is not to be asked again. TLS does ask again: it
    /// says good-bye on a connection that it could not read.
    close: Option<oneshot::Receiver<()>>,
    write_timeout: Duration,
    /// While bytes wait: when the client must have taken some.
    deadline: Option<Pin<Box<Sleep>>>,
}

impl Connection {
    /// The stream, which ends when `close` does, or when no byte is taken for `write_timeout` of those that wait.
    pub(crate) fn new(stream: TcpStream, close: oneshot::Receiver<()>, write_timeout: Duration) -> Connection {
        Connection { stream, close: Some(close), write_timeout, deadline: None }
    }

    fn check_open(&mut self, context: &mut Context<'_>) -> io::Result<()> {
        if self.close.as_mut().is_some_and(|close| Pin::new(close).poll(context).is_pending()) {
            return Ok(());
        }
        self.close = None;
        Err(io::Error::new(io::ErrorKind::ConnectionAborted, "the seat was given to another"))
    }

    /// Writes, unless the connection has to end or the client has taken nothing for too long.
    fn write(
        &mut self,
        context: &mut Context<'_>,
        write: impl FnOnce(Pin<&mut TcpStream>, &mut Context<'_>) -> Poll<io::Result<usize>>,
    ) -> Poll<io::Result<usize>> {
        self.check_open(context)?;
        if let Poll::Ready(written) = write(Pin::new(&mut self.stream), context) {
            self.deadline = None;
            return Poll::Ready(written);
        }
        let until = || Box::pin(sleep_until(Instant::now() + self.write_timeout));
        ready!(self.deadline.get_or_insert_with(until).as_mut().poll(context));
        Poll::Ready(Err(io::Error::new(io::ErrorKind::TimedOut, "the client takes nothing of what is sent")))
    }
}

impl AsyncRead for Connection {
    fn poll_read(self: Pin<&mut Self>, context: &mut Context<'_>, into: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        let it = self.get_mut();
        it.check_open(context)?;
        Pin::new(&mut it.stream).poll_read(context, into)
    }
}

impl AsyncWrite for Connection {
    fn poll_write(self: Pin<&mut Self>, context: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        self.get_mut().write(context, |stream, context| stream.poll_write(context, bytes))
    }

    fn poll_write_vectored(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        self.get_mut().write(context, |stream, context| stream.poll_write_vectored(context, bytes))
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.get_mut().stream).poll_flush(context)
    }

    fn poll_shutdown(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.get_mut().stream).poll_shutdown(context)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    use rustls::pki_types::{PrivatePkcs8KeyDer, ServerName};
    use rustls::{ClientConfig, RootCertStore, ServerConfig};
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
    use tokio::net::TcpListener;
    use tokio_rustls::{TlsAcceptor, TlsConnector};

    const WRITE_TIMEOUT: Duration = Duration::from_secs(60);

    /// A connection with what keeps it open, and its client.
    async fn connected() -> (Connection, oneshot::Sender<()>, TcpStream) {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let client = TcpStream::connect(listener.local_addr().unwrap()).await.unwrap();
        let (stay, close) = oneshot::channel();
        (Connection::new(listener.accept().await.unwrap().0, close, WRITE_TIMEOUT), stay, client)
    }

    /// Reads and writes again and again on a connection that has lost its seat, and closes it.
    async fn check(mut stream: impl AsyncRead + AsyncWrite + Unpin, stay: oneshot::Sender<()>) {
        drop(stay);
        assert_eq!(stream.read_u8().await.unwrap_err().kind(), io::ErrorKind::ConnectionAborted);
        for _ in 0..2 {
            assert!(stream.read_u8().await.is_err());
            // What is encrypted is written when it is flushed.
            assert!(stream.write_all(b"x").await.is_err() || stream.flush().await.is_err());
        }
        // Fails where something has to be sent for it.
        let _ = stream.shutdown().await;
    }

    #[tokio::test]
    async fn what_is_done_after_the_end_fails_each_time() {
        let (connection, stay, _client) = connected().await;
        check(connection, stay).await;
    }

    #[tokio::test]
    async fn an_encrypted_connection_that_is_displaced_ends_with_an_error() {
        let signed = rcgen::generate_simple_self_signed(["x".to_owned()]).unwrap();
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        let key = PrivatePkcs8KeyDer::from(signed.signing_key.serialize_der());
        let server = ServerConfig::builder_with_provider(provider.clone()).with_safe_default_protocol_versions();
        let server = server.unwrap().with_no_client_auth();
        let server = server.with_single_cert(vec![signed.cert.der().clone()], key.into()).unwrap();
        let mut roots = RootCertStore::empty();
        roots.add(signed.cert.der().clone()).unwrap();
        let client = ClientConfig::builder_with_provider(provider).with_safe_default_protocol_versions().unwrap();
        let client = client.with_root_certificates(roots).with_no_client_auth();
        let (connection, stay, socket) = connected().await;
        let connecting = TlsConnector::from(Arc::new(client)).connect(ServerName::try_from("x").unwrap(), socket);
        let accepting = TlsAcceptor::from(Arc::new(server)).accept(connection);
        let (stream, _client) = tokio::try_join!(accepting, connecting).unwrap();
        check(stream, stay).await;
    }
}
