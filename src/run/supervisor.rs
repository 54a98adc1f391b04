//! Where a supervisor such as systemd reads notifications (sd_notify(3): `NOTIFY_SOCKET`).
//!
//! Linux keeps as few as ten notifications that nobody has read (`net.unix.max_dgram_qlen`), and a send waits for room. So none does here: a
//! supervisor that hangs must not stop the loop of what flies.

use std::ffi::OsStr;
use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};

use sd_notify::NotifyState;

/// The supervisor of this process.
#[derive(Debug)]
pub(crate) struct Supervisor {
    socket: UnixDatagram,
    /// By its name, so that one that was started again is reached.
    address: SocketAddr,
}

impl Supervisor {
    /// The one that the environment names; `None` without one.
    ///
    /// # Errors
    /// When there can be no such socket.
    pub(crate) fn from_environment() -> io::Result<Option<Supervisor>> {
        std::env::var_os("NOTIFY_SOCKET").map(|it| Supervisor::at(&it)).transpose()
    }

    fn at(name: &OsStr) -> io::Result<Supervisor> {
        let address = match name.as_bytes().strip_prefix(b"@") {
            Some(name) => SocketAddr::from_abstract_name(name)?,
            None => SocketAddr::from_pathname(name)?,
        };
        let socket = UnixDatagram::unbound()?;
        socket.set_nonblocking(true)?;
        Ok(Supervisor { socket, address })
    }

    /// Notifies it; returns whether there was room for that.
    ///
    /// # Errors
    /// When it cannot be reached, as one that has ended.
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
            let supervisor = Supervisor::at(&name).unwrap();
            assert!(supervisor.notify(&NotifyState::Ready).unwrap());
            let has_room = (0..100_000).all(|_| supervisor.notify(&NotifyState::Watchdog).unwrap());
            assert!(!has_room, "it keeps any number");
            let mut bytes = [0; 64];
            let length = signs.recv(&mut bytes).unwrap();
            assert_eq!(str::from_utf8(&bytes[..length]).unwrap().trim(), "READY=1");
            assert!(supervisor.notify(&NotifyState::Watchdog).unwrap(), "there is room again");
            drop(signs);
            assert!(supervisor.notify(&NotifyState::Watchdog).is_err());
        }
    }
}
