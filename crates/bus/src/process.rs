//! A node put onto the bus: its session, its declarations, its liveliness token, and the loop between them.

use domain::time::Pace;
use node::Node;
use zenoh::Wait;

use crate::calls::Calls;
use crate::direct::Links;
use crate::inbox::Inbox;
use crate::mailbox::Mailbox;
use crate::outbox::Outbox;
use crate::shell::Shell;
use crate::{BusError, Clock, Direct, Link, Nudge, Stop, inbox, keys, only_one, session};

/// A node, and how it gets onto the bus.
pub struct Process<'a> {
    /// What runs.
    pub node: &'a mut dyn Node,
    /// Its router, and where it stands.
    pub link: &'a Link,
    /// Direct links to some processes of the same machine, besides the router.
    pub direct: Option<&'a Direct>,
    /// How many times faster than the wall clock mission time runs.
    pub pace: Pace,
    /// Has the node act on something that the bus does not bring.
    pub nudge: Nudge,
    /// It ends if another process of the same service and vehicle is there.
    pub is_only_one: bool,
}

impl<'a> Process<'a> {
    /// `node` at real time, over the router alone, with nothing to do besides what the bus brings.
    pub fn of(node: &'a mut dyn Node, link: &'a Link) -> Process<'a> {
        Process { node, link, direct: None, pace: Pace::REAL_TIME, nudge: Nudge::default(), is_only_one: false }
    }

    /// Runs until the node is over or `stop` is asked for. Blocks the calling thread.
    ///
    /// # Errors
    /// If no router is reached within the link's limit, zenoh refuses a declaration, or another process is there.
    pub fn run(self, stop: &Stop) -> Result<(), BusError> {
        let Process { node, link, direct, pace, nudge, is_only_one } = self;
        let session = session::open(link)?;
        if is_only_one {
            only_one::wait_to_be(&session, node.name())?;
        }
        let mailbox = Mailbox::new()?;
        let nudged = mailbox.clone();
        nudge.attach(move || nudged.nudge());
        let stopped = mailbox.clone();
        stop.on_stop(move || stopped.stop());
        let inbox = Inbox::new(&link.scope, mailbox.clone());
        let links = match direct {
            Some(direct) => Links::open(direct, node, inbox.clone())?,
            None => Links::none(inbox.clone()),
        };
        inbox::declare(&session, node, &inbox)?;
        inbox::watch_peers(&session, &link.scope, &mailbox)?;
        let clocks = inbox::listen_to_clocks(&session, &link.scope)?;
        let instance = session.zid().to_string();
        // Last: a process that sees the token finds everything else declared.
        let token_key = keys::alive(node.name(), &instance);
        let token = session
            .liveliness()
            .declare_token(&token_key)
            .wait()
            .map_err(|cause| BusError::Declare { key: token_key, cause: cause.to_string() })?;
        let outbox = Outbox::new(&session, direct.is_some(), &link.scope, clocks.clone());
        let calls = Calls::new(&session, &link.scope, mailbox, clocks);
        let mut shell = Shell::new(Clock::start(pace), outbox, calls, links, inbox, instance);
        let result = shell.run(node);
        drop(shell);
        // The token first, so that the others see it vanish, then the session. A close that hangs ends with the process.
        let _ = token.undeclare().wait();
        let _ = session.close().wait();
        result
    }
}
