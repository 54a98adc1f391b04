//! The loop that runs a node.

#![expect(clippy::disallowed_methods, reason = "heartbeats and deadlines of calls are on the wall clock")]

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use kittiwake_proto::topics::{Message, Service};
use kittiwake_proto::v1::Heartbeat;
use node::{Effect, Event, MessageKind, Node, Token, commands_first};
use zenoh::Wait;

use crate::calls::Calls;
use crate::direct::Links;
use crate::inbox::{Asker, Inbox};
use crate::mailbox::Mail;
use crate::outbox::Outbox;
use crate::trace::Parent;
use crate::{BusError, Clock, trace};

/// Every process says at least this often that its own loop makes progress: often enough that one that hangs is noticed
/// within a second, although a heartbeat or two may be late.
const HEARTBEAT: Duration = Duration::from_millis(250);
/// What the caller of a request without a reply gets.
const UNANSWERED: &str = "the service did not answer";

pub(crate) struct Shell<'a> {
    clock: Clock,
    outbox: Outbox<'a>,
    calls: Calls<'a>,
    links: Links,
    inbox: Inbox,
    instance: String,
    handled: u64,
    /// Messages that the node refused because of their content, by kind.
    refusals: BTreeMap<MessageKind, u64>,
    /// Requests that the node has not answered yet: of the batch at hand, or answered later.
    open: Vec<(Token, Service)>,
    /// Requests that the node left without a reply, by service.
    unanswered: BTreeMap<Service, u64>,
    next_heartbeat: Instant,
}

impl<'a> Shell<'a> {
    /// For a process of this `instance`, whose inbox is declared already.
    pub(crate) fn new(
        clock: Clock,
        outbox: Outbox<'a>,
        calls: Calls<'a>,
        links: Links,
        inbox: Inbox,
        instance: String,
    ) -> Shell<'a> {
        Shell {
            clock,
            outbox,
            calls,
            links,
            inbox,
            instance,
            handled: 0,
            refusals: BTreeMap::new(),
            open: Vec::new(),
            unanswered: BTreeMap::new(),
            next_heartbeat: Instant::now(),
        }
    }

    /// Runs `node` until it is over or the mailbox is stopped.
    pub(crate) fn run(&mut self, node: &mut dyn Node) -> Result<(), BusError> {
        let mut batch = Vec::new();
        let mut effects = Vec::new();
        loop {
            let mailbox = self.inbox.mailbox().clone();
            mailbox.wait(self.next_wake(node), self.links.descriptors());
            self.links.read();
            let go_on = mailbox.take(&mut batch);
            // What this batch is about; the decisions taken at its end belong to the same trace.
            let mut cause = None;
            for mail in batch.drain(..) {
                if let Some((event, parent)) = self.open(mail) {
                    self.show(node, event, parent, &mut cause, &mut effects)?;
                }
            }
            let mut late = Vec::new();
            self.calls.tend(Instant::now(), &mut late, &mut self.links)?;
            for event in late {
                self.show(node, event, None, &mut cause, &mut effects)?;
            }
            {
                let _entered = cause.as_ref().map(|it: &Parent| trace::span("act", Some(it)).entered());
                node.act(self.clock.now(), &mut effects);
                self.perform(&mut effects)?;
            }
            self.fail_unanswered(node);
            self.beat(node)?;
            if !go_on || node.is_over() {
                return Ok(());
            }
        }
    }

    fn next_wake(&self, node: &dyn Node) -> Instant {
        let wanted = node.deadline().map(|it| self.clock.instant_of(it));
        [wanted, self.calls.deadline()].into_iter().flatten().fold(self.next_heartbeat, Instant::min)
    }

    /// What a piece of mail means to the node, if anything.
    fn open(&mut self, mail: Mail) -> Option<(Event, Option<Parent>)> {
        match mail {
            Mail::Event(event, parent) => Some((event, parent)),
            Mail::Answer { call, attempt, result } => Some((self.calls.answered(call, attempt, result)?, None)),
            Mail::Unserved { call, attempt } => {
                self.calls.unserved(call, attempt, Instant::now());
                None
            }
        }
    }

    fn show(
        &mut self,
        node: &mut dyn Node,
        event: Event,
        parent: Option<Parent>,
        cause: &mut Option<Parent>,
        effects: &mut Vec<Effect>,
    ) -> Result<(), BusError> {
        self.handled += 1;
        let what = match &event {
            // Telemetry is not traced: hundreds a second, and nobody's decision.
            Event::Message { message, .. } if message.topic().qos().keeps_newest_only() => None,
            Event::Message { message, .. } => Some(message.topic().key()),
            Event::Request { request, token, .. } => {
                self.open.push((*token, request.service()));
                Some(request.service().key())
            }
            Event::Reply { .. } | Event::Peer { .. } => None,
        };
        let _entered = what.map(|what| trace::span(what, parent.as_ref()).entered());
        if what.is_some() {
            *cause = trace::current();
        }
        node.on(self.clock.now(), event, effects);
        self.perform(effects)
    }

    fn perform(&mut self, effects: &mut Vec<Effect>) -> Result<(), BusError> {
        commands_first(effects);
        for effect in effects.drain(..) {
            match effect {
                Effect::Publish { vehicle, message } => self.outbox.publish(vehicle, &message, &mut self.links)?,
                Effect::Call { call, vehicle, trace, request, timeout } => {
                    // What comes from outside the bus brings its own trace, or begins one.
                    let span = trace
                        .map(|it| trace::span(request.service().key(), Some(it).filter(|it| !it.is_empty()).as_ref()));
                    let _entered = span.map(|it| it.entered());
                    let deadline = Instant::now() + self.clock.to_wall(timeout);
                    self.calls.call(call, vehicle, &request, deadline, &mut self.links)?;
                }
                Effect::Reply { token, response } => {
                    self.open.retain(|(open, _)| *open != token);
                    self.answer(token, Some(&response.encode()));
                }
                Effect::Refused { what, why } => {
                    let count = self.refusals.entry(what).or_default();
                    *count += 1;
                    // Once per kind: a sender of invalid content sends it at the rate of its topic.
                    if *count == 1 {
                        tracing::warn!(key = what.key(), why, "invalid message refused; further ones are only counted");
                    }
                }
            }
        }
        Ok(())
    }

    /// The node has had its turn: requests that it has not answered, and will not answer later, never will be, and their
    /// callers hear of that.
    fn fail_unanswered(&mut self, node: &dyn Node) {
        for (token, service) in std::mem::take(&mut self.open) {
            if node.answers_later(token) {
                self.open.push((token, service));
                continue;
            }
            let count = self.unanswered.entry(service).or_default();
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
    fn answer(&mut self, token: Token, payload: Option<&[u8]>) {
        match self.inbox.open().take(token) {
            None => {}
            Some(Asker::Direct { connection, number }) => self.links.answer(connection, number, payload),
            Some(Asker::Zenoh(query)) => {
                let sent = match payload {
                    Some(payload) => query.reply(query.key_expr(), payload).wait(),
                    None => query.reply_err(UNANSWERED).wait(),
                };
                if let Err(cause) = sent {
                    tracing::warn!(key = query.key_expr().as_str(), %cause, "answer not sent");
                }
            }
        }
    }

    fn beat(&mut self, node: &dyn Node) -> Result<(), BusError> {
        let now = Instant::now();
        if now < self.next_heartbeat {
            return Ok(());
        }
        self.next_heartbeat = now + HEARTBEAT;
        self.links.call();
        let losses = self.inbox.mailbox().losses();
        let heartbeat = Heartbeat {
            service: node.name().to_owned(),
            instance: self.instance.clone(),
            uptime_s: self.clock.uptime().as_secs_f64(),
            handled: self.handled,
            dropped: losses.dropped,
            malformed: losses.malformed,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            pid: std::process::id(),
            late: losses.late,
            refused: self.refusals.values().sum(),
            unanswered: self.unanswered.values().sum(),
        };
        self.outbox.publish(None, &Message::Heartbeat(heartbeat), &mut self.links)
    }
}
