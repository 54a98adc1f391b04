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
    /// Ends when the connection has to.
    close: oneshot::Receiver<()>,
    write_timeout: Duration,
    /// While bytes wait: when the client must have taken some.
    deadline: Option<Pin<Box<Sleep>>>,
}

impl Connection {
    /// The stream, which ends when `close` does, or when no byte is taken for `write_timeout` of those that wait.
    pub(crate) fn new(stream: TcpStream, close: oneshot::Receiver<()>, write_timeout: Duration) -> Connection {
        Connection { stream, close, write_timeout, deadline: None }
    }

    fn check_open(&mut self, context: &mut Context<'_>) -> io::Result<()> {
        match Pin::new(&mut self.close).poll(context) {
            Poll::Pending => Ok(()),
            Poll::Ready(_) => Err(io::Error::new(io::ErrorKind::ConnectionAborted, "the seat was given to another")),
        }
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
