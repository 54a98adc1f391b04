//! Nodes put onto the bus: one session, and for each node its declarations, its liveliness token and a seat in the loop.

use domain::time::Pace;
use node::Node;
use zenoh::{Session, Wait};

use crate::calls::Calls;
use crate::direct::Links;
use crate::inbox::Inbox;
use crate::mailbox::Mailbox;
use crate::neighbours::{Neighbour, Neighbours};
use crate::only_one::Successor;
use crate::outbox::Outbox;
use crate::seat::{Progress, Seat};
use crate::wake::Wake;
use crate::{BusError, Clock, Direct, Link, Nudge, Stop, inbox, keys, only_one, session, shell};

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
    /// It ends if another process of the same service and vehicle is there, or a newer one comes while it runs.
    pub is_only_one: bool,
}

/// Several nodes in one process and one thread. They hand each other messages and requests in memory; everybody else hears the same of them
/// as of processes of their own.
pub struct Composition<'a> {
    /// What runs. No two have the same name, or answer the same service.
    pub nodes: Vec<Hosted<'a>>,
    /// Their router, and where all of them stand.
    pub link: &'a Link,
    /// How many times faster than the wall clock mission time runs.
    pub pace: Pace,
    /// It ends if another process has one of the nodes, for the same vehicle, or a newer one comes that has while it runs.
    pub is_only_one: bool,
}

/// A node of a composition.
pub struct Hosted<'a> {
    /// What runs.
    pub node: &'a mut dyn Node,
    /// Its direct links to nodes of other processes; those to nodes of this one are not made.
    pub direct: Option<Direct>,
    /// Has the node act on something that the bus does not bring.
    pub nudge: Nudge,
}

impl<'a> Process<'a> {
    /// `node` at real time, over the router alone, with nothing to do besides what the bus brings.
    pub fn of(node: &'a mut dyn Node, link: &'a Link) -> Process<'a> {
        Process { node, link, direct: None, pace: Pace::REAL_TIME, nudge: Nudge::default(), is_only_one: false }
    }

    /// Runs until the node is over or `stop` is asked for. Blocks the calling thread.
    ///
    /// # Errors
    /// If no router is reached within the link's limit, zenoh refuses a declaration, or another process is there or comes.
    pub fn run(self, stop: &Stop) -> Result<(), BusError> {
        let Process { node, link, direct, pace, nudge, is_only_one } = self;
        let nodes = vec![Hosted { node, direct: direct.cloned(), nudge }];
        Composition { nodes, link, pace, is_only_one }.run(stop)
    }
}

impl Composition<'_> {
    /// Runs until all nodes are over or `stop` is asked for. Blocks the calling thread. A node that panics ends all of them.
    ///
    /// # Errors
    /// If no router is reached within the link's limit, zenoh refuses a declaration, or another process has one of the nodes.
    pub fn run(self, stop: &Stop) -> Result<(), BusError> {
        let session = session::open(self.link)?;
        let result = self.run_on(&session, stop);
        // A close that hangs ends with the process.
        let _ = session.close().wait();
        result
    }

    fn run_on(mut self, session: &Session, stop: &Stop) -> Result<(), BusError> {
        if self.is_only_one {
            self.nodes.iter().try_for_each(|it| only_one::wait_to_be(session, it.node.name()))?;
        }
        self.link_to_others_only();
        let Composition { nodes, link, pace, is_only_one } = self;
        let wake = Wake::new()?;
        let instance = only_one::instance(session);
        let successor = match is_only_one {
            true => only_one::watch(
                session,
                nodes.iter().map(|it| it.node.name()).collect(),
                instance.clone(),
                wake.clone(),
            )?,
            false => Successor::default(),
        };
        let stopped = wake.clone();
        stop.on_stop(move || stopped.stop());
        let mailboxes: Vec<Mailbox> = nodes.iter().map(|_| Mailbox::new(&wake)).collect();
        let inboxes: Vec<Inbox> = mailboxes.iter().map(|it| Inbox::new(&link.scope, it.clone())).collect();
        let all: Vec<Neighbour> = nodes.iter().zip(&inboxes).map(|(it, inbox)| Neighbour::of(it.node, inbox)).collect();
        let mut declared = Vec::new();
        for ((hosted, inbox), mailbox) in nodes.iter().zip(&inboxes).zip(&mailboxes) {
            let nudged = mailbox.clone();
            hosted.nudge.attach(move || nudged.nudge());
            let links = match &hosted.direct {
                Some(direct) => Links::open(direct, hosted.node, inbox.clone())?,
                None => Links::none(inbox.clone()),
            };
            declared.push((inbox::declare(session, hosted.node, inbox)?, links));
        }
        inbox::watch_peers(session, &link.scope, &mailboxes)?;
        let clocks = inbox::listen_to_clocks(session, &link.scope)?;
        let clock = Clock::start(pace);
        let mut seats = Vec::new();
        for (place, ((hosted, inbox), (declared, links))) in nodes.into_iter().zip(inboxes).zip(declared).enumerate() {
            let outbox = Outbox::new(session, place, hosted.direct.is_some(), &link.scope, clocks.clone());
            let calls = Calls::new(session, &link.scope, inbox.mailbox().clone(), clocks.clone());
            seats.push(Seat {
                // Last: who sees the token of a node finds everything else declared, of all nodes.
                token: declare_token(session, hosted.node.name(), &instance)?,
                node: hosted.node,
                clock,
                outbox,
                calls,
                links,
                neighbours: Neighbours::of(&all, place),
                inbox,
                declared,
                instance: instance.clone(),
                progress: Progress::new(),
            });
        }
        shell::run(seats, &wake)?;
        successor.check()
    }

    /// A node is not called by those beside it: what they say would come twice.
    fn link_to_others_only(&mut self) {
        let own: Vec<String> = self.nodes.iter().filter_map(|it| it.direct.as_ref()?.listen.clone()).collect();
        for direct in self.nodes.iter_mut().filter_map(|it| it.direct.as_mut()) {
            direct.connect.retain(|it| !own.contains(it));
        }
    }
}

fn declare_token(
    session: &Session,
    service: &str,
    instance: &str,
) -> Result<zenoh::liveliness::LivelinessToken, BusError> {
    let key = keys::alive(service, instance);
    let token = session.liveliness().declare_token(&key).wait();
    token.map_err(|cause| BusError::Declare { key, cause: cause.to_string() })
}
