//! A node on the bus: what it sees, and what becomes of what it wants done.

#![expect(clippy::disallowed_methods, reason = "heartbeats and deadlines of calls are on the wall clock")]

use std::collections::BTreeMap;
use std::os::fd::BorrowedFd;
use std::time::{Duration, Instant};

use kittiwake_proto::topics::{Message, Response, Service};
use kittiwake_proto::v1::Heartbeat;
use node::{Effect, Event, MessageKind, Node, Token, VehicleId, commands_first};
use zenoh::Wait;
use zenoh::liveliness::LivelinessToken;

use crate::calls::Calls;
use crate::clock::monotonic_ns;
use crate::direct::Links;
use crate::inbox::{Asker, Declared, Inbox};
use crate::mailbox::Mail;
use crate::neighbours::Neighbours;
use crate::outbox::{self, Outbox};
use crate::trace::Parent;
use crate::{BusError, Clock, freshness, trace};

/// Every node says at least this often that its own loop makes progress: often enough that one that hangs is noticed
/// within a second, although a heartbeat or two may be late.
const HEARTBEAT: Duration = Duration::from_millis(250);
/// What the caller of a request without a reply gets.
const UNANSWERED: &str = "the service did not answer";

/// What belongs to one node.
pub(crate) struct Seat<'a> {
    pub(crate) node: &'a mut dyn Node,
    pub(crate) clock: Clock,
    pub(crate) outbox: Outbox<'a>,
    pub(crate) calls: Calls<'a>,
    pub(crate) links: Links,
    pub(crate) neighbours: Neighbours,
    pub(crate) inbox: Inbox,
    pub(crate) declared: Declared,
    pub(crate) token: LivelinessToken,
    pub(crate) instance: String,
    pub(crate) progress: Progress,
}

/// How far a node has come.
pub(crate) struct Progress {
    handled: u64,
    /// Messages that the node refused because of their content, by kind.
    refusals: BTreeMap<MessageKind, u64>,
    /// Requests that the node has not answered yet: of the batch at hand, or answered later.
    open: Vec<(Token, Service)>,
    /// Requests that the node left without a reply, by service.
    unanswered: BTreeMap<Service, u64>,
    next_heartbeat: Instant,
    /// No order is obeyed before.
    next_order: Instant,
    /// Empty between turns; kept for their room.
    batch: Vec<Mail>,
    effects: Vec<Effect>,
}

impl Progress {
    /// Of a node that has not had a turn yet.
    pub(crate) fn new() -> Progress {
        Progress {
            handled: 0,
            refusals: BTreeMap::new(),
            open: Vec::new(),
            unanswered: BTreeMap::new(),
            next_heartbeat: Instant::now(),
            next_order: Instant::now(),
            batch: Vec::new(),
            effects: Vec::new(),
        }
    }
}

impl Seat<'_> {
    /// When it has something to do even if nothing arrives.
    pub(crate) fn next_wake(&self) -> Instant {
        let wanted = self.node.deadline().map(|it| self.clock.instant_of(it));
        let order = self.inbox.mailbox().has_order().then_some(self.progress.next_order);
        [wanted, self.calls.deadline(), order].into_iter().flatten().fold(self.progress.next_heartbeat, Instant::min)
    }

    /// Whether something has arrived.
    pub(crate) fn has_mail(&self) -> bool {
        self.inbox.mailbox().has_mail()
    }

    /// Whether its node is over.
    pub(crate) fn is_over(&self) -> bool {
        self.node.is_over()
    }

    /// The node's name.
    pub(crate) fn name(&self) -> &'static str {
        self.node.name()
    }

    /// What tells that its direct links have something to read.
    pub(crate) fn descriptors(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        self.links.descriptors()
    }

    /// Reads its direct links.
    pub(crate) fn read(&mut self) {
        self.links.read();
    }

    /// Another node of the process has left.
    pub(crate) fn goes_on_without(&mut self, name: &str) {
        self.neighbours.leave(name);
    }

    /// Leaves the bus, the token first, so that the others see it vanish.
    pub(crate) fn leave(self) {
        let Seat { token, declared, .. } = self;
        let _ = token.undeclare().wait();
        drop(declared);
    }

    /// Shows the node everything that has arrived, of the orders at most one, and lets it act.
    pub(crate) fn turn(&mut self) -> Result<(), BusError> {
        let mut batch = std::mem::take(&mut self.progress.batch);
        self.inbox.mailbox().take(&mut batch);
        // What this batch is about; the decisions taken at its end belong to the same trace.
        let mut cause = None;
        for mail in batch.drain(..) {
            if let Some((event, parent)) = self.open(mail) {
                self.show(event, parent, &mut cause)?;
            }
        }
        self.progress.batch = batch;
        let ordered = self.show_order(&mut cause)?;
        let mut late = Vec::new();
        self.calls.tend(Instant::now(), &mut late, &mut self.links, &self.neighbours)?;
        for event in late {
            self.show(event, None, &mut cause)?;
        }
        {
            let _entered = cause.as_ref().map(|it: &Parent| trace::span("act", Some(it)).entered());
            let mut effects = std::mem::take(&mut self.progress.effects);
            self.node.act(self.clock.now(), &mut effects);
            self.perform(effects)?;
        }
        if let Some(begun) = ordered {
            // Half of the time is for everything else, whatever people ask for.
            let now = Instant::now();
            self.progress.next_order = now + (now - begun);
        }
        self.fail_unanswered();
        self.beat()
    }

    /// Shows the node the first order that is not too old, if it is time for one; returns when it was shown.
    fn show_order(&mut self, cause: &mut Option<Parent>) -> Result<Option<Instant>, BusError> {
        let now = Instant::now();
        if now < self.progress.next_order {
            return Ok(None);
        }
        while let Some(mail) = self.inbox.mailbox().take_order() {
            if let Some((event, parent)) = self.open(mail) {
                self.show(event, parent, cause)?;
                return Ok(Some(now));
            }
        }
        Ok(None)
    }

    /// What a piece of mail means to the node, if anything.
    fn open(&mut self, mail: Mail) -> Option<(Event, Option<Parent>)> {
        match mail {
            Mail::Event(event, parent) => Some((event, parent)),
            // It was in time when it came; only now it is obeyed.
            Mail::Said(said, event, parent) => match freshness::check(said, monotonic_ns()) {
                Ok(()) => Some((event, parent)),
                Err(late) => {
                    self.inbox.refuse_stale(event, late);
                    None
                }
            },
            Mail::Answer { call, attempt, result } => Some((self.calls.answered(call, attempt, result)?, None)),
            Mail::Unserved { call, attempt } => {
                self.calls.unserved(call, attempt, Instant::now());
                None
            }
        }
    }

    fn show(&mut self, event: Event, parent: Option<Parent>, cause: &mut Option<Parent>) -> Result<(), BusError> {
        self.progress.handled += 1;
        let what = match &event {
            // Telemetry is not traced: hundreds a second, and nobody's decision.
            Event::Message { message, .. } if message.topic().qos().keeps_newest_only() => None,
            Event::Message { message, .. } => Some(message.topic().key()),
            Event::Request { request, token, .. } => {
                self.progress.open.push((*token, request.service()));
                Some(request.service().key())
            }
            Event::Reply { .. } | Event::Peer { .. } => None,
        };
        let _entered = what.map(|what| trace::span(what, parent.as_ref()).entered());
        if what.is_some() {
            *cause = trace::current();
        }
        let mut effects = std::mem::take(&mut self.progress.effects);
        self.node.on(self.clock.now(), event, &mut effects);
        self.perform(effects)
    }

    fn perform(&mut self, mut effects: Vec<Effect>) -> Result<(), BusError> {
        commands_first(&mut effects);
        for effect in effects.drain(..) {
            match effect {
                Effect::Publish { vehicle, message } => self.publish(vehicle, &message)?,
                Effect::Call { call, vehicle, trace, request, timeout } => {
                    // What comes from outside the bus brings its own trace, or begins one.
                    let span = trace
                        .map(|it| trace::span(request.service().key(), Some(it).filter(|it| !it.is_empty()).as_ref()));
                    let _entered = span.map(|it| it.entered());
                    let deadline = Instant::now() + self.clock.to_wall(timeout);
                    self.calls.call(call, vehicle, request, deadline, &mut self.links, &self.neighbours)?;
                }
                Effect::Reply { token, response } => {
                    self.progress.open.retain(|(open, _)| *open != token);
                    self.answer(token, Some(response));
                }
                Effect::Refused { what, why } => {
                    let count = self.progress.refusals.entry(what).or_default();
                    *count += 1;
                    // Once per kind: a sender of invalid content sends it at the rate of its topic.
                    if *count == 1 {
                        tracing::warn!(key = what.key(), why, "invalid message refused; further ones are only counted");
                    }
                }
            }
        }
        self.progress.effects = effects;
        Ok(())
    }

    /// To the other nodes of this process first: they act next.
    fn publish(&mut self, vehicle: Option<VehicleId>, message: &Message) -> Result<(), BusError> {
        let traceparent = outbox::parent_of(message);
        self.neighbours.publish(vehicle.as_ref(), message, &traceparent);
        self.outbox.publish(vehicle, message, traceparent, &mut self.links)
    }

    /// The node has had its turn: requests that it has not answered, and will not answer later, never will be, and their
    /// callers hear of that.
    fn fail_unanswered(&mut self) {
        for (token, service) in std::mem::take(&mut self.progress.open) {
            if self.node.answers_later(token) {
                self.progress.open.push((token, service));
                continue;
            }
            let count = self.progress.unanswered.entry(service).or_default();
            *count += 1;
            if *count == 1 {
                tracing::error!(
                    key = service.key(),
                    "the node left a request without a reply; further ones are only counted"
                );
            }
            self.answer(token, None);
        }
    }

    /// Tells who asked; `None`: that there is no answer.
    fn answer(&mut self, token: Token, response: Option<Response>) {
        match self.inbox.open().take(token) {
            None => {}
            Some(Asker::Neighbour(outcome)) => outcome.settle(response),
            Some(Asker::Direct { connection, number }) => {
                self.links.answer(connection, number, response.map(|it| it.encode()).as_deref());
            }
            Some(Asker::Zenoh(query)) => {
                let sent = match response.map(|it| it.encode()) {
                    Some(payload) => query.reply(query.key_expr(), payload).wait(),
                    None => query.reply_err(UNANSWERED).wait(),
                };
                if let Err(cause) = sent {
                    tracing::warn!(key = query.key_expr().as_str(), %cause, "answer not sent");
                }
            }
        }
    }

    fn beat(&mut self) -> Result<(), BusError> {
        let now = Instant::now();
        if now < self.progress.next_heartbeat {
            return Ok(());
        }
        self.progress.next_heartbeat = now + HEARTBEAT;
        self.links.call();
        let losses = self.inbox.mailbox().losses();
        let heartbeat = Heartbeat {
            service: self.node.name().to_owned(),
            instance: self.instance.clone(),
            uptime_s: self.clock.uptime().as_secs_f64(),
            handled: self.progress.handled,
            dropped: losses.dropped,
            malformed: losses.malformed,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            pid: std::process::id(),
            late: losses.late,
            refused: self.progress.refusals.values().sum(),
            unanswered: self.progress.unanswered.values().sum(),
        };
        self.publish(None, &Message::Heartbeat(heartbeat))
    }
}
