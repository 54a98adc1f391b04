//! Direct links between processes of one machine, beside the router: a command, an event or a request
//! need not wake a third process on its way.
//!
//! What goes directly goes through the router as well, and the receiver takes whichever comes first: a
//! direct link that is not there yet, or breaks, costs time and never a message. So no process depends on
//! another one's socket, and the two also stand in for each other: what is linked directly keeps working
//! while the router is being restarted. Telemetry goes through the router alone, since it is for many.

use std::path::PathBuf;

use zenoh::Session;

use crate::session::{config, open_with, set};
use crate::{BusError, Scope, sockets};

/// The direct links of a process: Unix sockets in a folder that all of them know.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Direct {
    /// The folder of the sockets, of mode 0700: whoever may enter it may command the vehicle.
    pub folder: PathBuf,
    /// The process's own socket: who calls it here.
    pub listen: Option<String>,
    /// Whom it calls, in the background and for ever: they need not be there.
    pub connect: Vec<String>,
}

/// Opens the session of the direct links. It waits for nobody.
pub(crate) fn open(direct: &Direct, scope: &Scope) -> Result<Session, BusError> {
    let path = |name: &String| direct.folder.join(format!("{name}.sock"));
    direct.listen.iter().map(path).try_for_each(|it| sockets::check_to_listen(&it))?;
    direct.connect.iter().map(path).try_for_each(|it| sockets::check_to_connect(&it))?;
    let locators = |names: &[String]| {
        let locators: Vec<_> = names.iter().map(|it| sockets::locator_of(&path(it))).collect();
        serde_json::json!(locators).to_string()
    };
    let mut config = config("peer")?;
    set(&mut config, "listen/endpoints", &locators(direct.listen.as_slice()))?;
    set(&mut config, "connect/endpoints", &locators(&direct.connect))?;
    set(&mut config, "connect/exit_on_failure", "false")?;
    set(&mut config, "scouting/delay", "0")?;
    open_with(config, scope).map_err(|cause| BusError::Listen { locators: direct.folder.display().to_string(), cause })
}
