//! Direct links between processes of one machine, beside the router: a command, an event or a request wakes the thread that
//! handles it, and no other one on its way.
//!
//! They are Unix sockets of sequenced packets, and the node's own loop reads them: what is sent is whole, in order, and there when
//! the loop wakes. The same over zenoh wakes two threads of the transport first.
//!
//! What goes directly goes through the router as well, and the receiver takes whichever comes first: a direct link that is not there
//! yet, or breaks, or is full, costs time and never a message. So no process depends on another one's socket, and the two also stand in
//! for each other: what is linked directly keeps working while the router is being restarted. Telemetry goes through the router alone,
//! since it is for many.

use std::path::PathBuf;

mod connection;
mod links;
mod packet;
mod socket;

pub(crate) use links::Links;

/// The direct links of a process: Unix sockets in a folder that all of them know.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Direct {
    /// The folder of the sockets. Its mode is 0700, since every user with access to it can command the vehicle.
    pub folder: PathBuf,
    /// The process's own socket: who calls it here.
    pub listen: Option<String>,
    /// Whom it calls, in the background and for ever: they need not be there.
    pub connect: Vec<String>,
}

impl Direct {
    fn path(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.sock"))
    }
}
