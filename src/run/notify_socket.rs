//! The socket at which a supervisor such as systemd reads notifications (sd_notify(3): `NOTIFY_SOCKET`).
//!
//! Linux queues as few as ten unread notifications (`net.unix.max_dgram_qlen`), and then a send blocks, also in the library
//! `sd-notify`. No send blocks here: a supervisor that hangs must not stop the loop of a process that flies.

use std::ffi::OsStr;
use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};

use sd_notify::NotifyState;

/// The supervisor's socket.
#[derive(Debug)]
pub(crate) struct NotifySocket {
    socket: UnixDatagram,
    /// By its name, so that a supervisor that was started again is reached.
    address: SocketAddr,
}

impl NotifySocket {
    /// The one that the environment names; `None` without one.
    ///
    /// # Errors
    /// When there can be no such socket.
    pub(crate) fn from_environment() -> io::Result<Option<NotifySocket>> {
        std::env::var_os("NOTIFY_SOCKET").map(|it| NotifySocket::at(&it)).transpose()
    }

    /// The one of this name: a path, or an abstract name after `@`.
    ///
    /// # Errors
    /// When there can be no such socket.
    pub(crate) fn at(name: &OsStr) -> io::Result<NotifySocket> {
        let address = match name.as_bytes().strip_prefix(b"@") {
            Some(name) => SocketAddr::from_abstract_name(name)?,
            None => SocketAddr::from_pathname(name)?,
        };
        let socket = UnixDatagram::unbound()?;
        socket.set_nonblocking(true)?;
        Ok(NotifySocket { socket, address })
    }

    /// Notifies the supervisor; returns whether there was room for that.
    ///
    /// # Errors
    /// When the supervisor cannot be reached, for example because it has ended.
    pub(crate) fn notify(&self, state: &NotifyState<'_>) -> io::Result<bool> {
        match self.socket.send_to_addr(state.to_string().as_bytes(), &self.address) {
            Err(cause) if cause.kind() == io::ErrorKind::WouldBlock => Ok(false),
            sent => sent.map(|_| true),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_supervisor_that_does_not_read_holds_nothing_up_and_one_that_does_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notify");
        let named = format!("kittiwake-test-{}", std::process::id());
        let abstract_name = SocketAddr::from_abstract_name(&named).unwrap();
        for (signs, name) in [
            (UnixDatagram::bind(&path).unwrap(), path.into_os_string()),
            (UnixDatagram::bind_addr(&abstract_name).unwrap(), format!("@{named}").into()),
        ] {
            let socket = NotifySocket::at(&name).unwrap();
            assert!(socket.notify(&NotifyState::Ready).unwrap());
            let has_room = (0..100_000).all(|_| socket.notify(&NotifyState::Watchdog).unwrap());
            assert!(!has_room, "the queue has no end");
            let mut bytes = [0; 64];
            let length = signs.recv(&mut bytes).unwrap();
            assert_eq!(str::from_utf8(&bytes[..length]).unwrap().trim(), "READY=1");
            assert!(socket.notify(&NotifyState::Watchdog).unwrap(), "there is room again");
            drop(signs);
            assert!(socket.notify(&NotifyState::Watchdog).is_err());
        }
    }
}
