//! Unix sockets of type `SOCK_SEQPACKET` (unix(7)): each packet arrives whole and in order, and a closed connection is noticed. No call
//! here blocks.

use std::io;
use std::os::fd::OwnedFd;
use std::path::Path;

use rustix::io::Errno;
use rustix::net::{
    self, AddressFamily, RecvFlags, SendAncillaryBuffer, SendFlags, SocketAddrUnix, SocketFlags, SocketType,
};

/// Callers that wait to be taken in; there are as many as processes on board.
const BACKLOG: i32 = 16;

/// What there is to read.
pub(super) enum Received {
    /// A packet of this length, which may be greater than the buffer: then its end is lost.
    Packet(usize),
    /// Nothing at the moment.
    Nothing,
    /// The other end is closed.
    End,
}

/// What became of a packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sent {
    /// It will be read, if its reader lives.
    Whole,
    /// Not at all: the reader is behind, or the packet is larger than the socket takes.
    NoRoom,
    /// The other end is closed.
    End,
}

fn socket() -> io::Result<OwnedFd> {
    let flags = SocketFlags::NONBLOCK | SocketFlags::CLOEXEC;
    Ok(net::socket_with(AddressFamily::UNIX, SocketType::SEQPACKET, flags, None)?)
}

/// Listens at `path`, which has been looked at: what is there was left behind, and is replaced.
pub(super) fn listen(path: &Path) -> io::Result<OwnedFd> {
    match std::fs::remove_file(path) {
        Err(cause) if cause.kind() != io::ErrorKind::NotFound => return Err(cause),
        _ => {}
    }
    let socket = socket()?;
    net::bind(&socket, &SocketAddrUnix::new(path)?)?;
    net::listen(&socket, BACKLOG)?;
    Ok(socket)
}

/// A connection to who listens at `path`.
pub(super) fn connect(path: &Path) -> io::Result<OwnedFd> {
    let socket = socket()?;
    net::connect(&socket, &SocketAddrUnix::new(path)?)?;
    Ok(socket)
}

/// The next caller, if there is one.
///
/// # Errors
/// If one waits and cannot be taken in: the process has no descriptors or memory left.
pub(super) fn accept(listener: &OwnedFd) -> io::Result<Option<OwnedFd>> {
    match net::accept_with(listener, SocketFlags::NONBLOCK | SocketFlags::CLOEXEC) {
        Ok(socket) => Ok(Some(socket)),
        Err(cause @ (Errno::MFILE | Errno::NFILE | Errno::NOBUFS | Errno::NOMEM)) => Err(cause.into()),
        // Nobody, or one that has hung up meanwhile.
        Err(_) => Ok(None),
    }
}

/// The user at the other end.
pub(super) fn user(socket: &OwnedFd) -> io::Result<u32> {
    Ok(net::sockopt::socket_peercred(socket)?.uid.as_raw())
}

/// Sends the parts as one packet, or nothing.
pub(super) fn send(socket: &OwnedFd, parts: &[io::IoSlice<'_>]) -> Sent {
    let flags = SendFlags::DONTWAIT | SendFlags::NOSIGNAL;
    match net::sendmsg(socket, parts, &mut SendAncillaryBuffer::default(), flags) {
        Ok(_) => Sent::Whole,
        Err(Errno::AGAIN | Errno::MSGSIZE | Errno::NOBUFS | Errno::NOMEM | Errno::INTR) => Sent::NoRoom,
        Err(_) => Sent::End,
    }
}

/// Reads a packet into `buffer`.
pub(super) fn receive(socket: &OwnedFd, buffer: &mut [u8]) -> Received {
    match net::recv(socket, buffer, RecvFlags::DONTWAIT | RecvFlags::TRUNC) {
        Ok((_, 0)) => Received::End,
        Ok((_, length)) => Received::Packet(length),
        Err(Errno::AGAIN | Errno::INTR) => Received::Nothing,
        Err(_) => Received::End,
    }
}
