//! The loop that runs a node.

#![expect(clippy::disallowed_methods, reason = "heartbeats and deadlines of calls are on the wall clock")]

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use domain::time::Pace;
use kittiwake_proto::topics::{Message, Qos};
use kittiwake_proto::v1::Heartbeat;
use node::{Effect, Event, MessageKind, Node};
use zenoh::Wait;

use crate::calls::Calls;
use crate::inbox::{self, OpenQueries};
use crate::mailbox::{Mail, Mailbox};
use crate::outbox::Outbox;
use crate::trace::Parent;
use crate::{BusError, Clock, Direct, Link, Nudge, Stop, direct, keys, session, trace};

/// Every process says at least this often that its own loop makes progress: often enough that one that hangs is noticed
/// within a second, although a heartbeat or two may be late.
const HEARTBEAT: Duration = Duration::from_millis(250);

/// Runs `node` on the bus until it is over or `stop` is asked for. Blocks the calling thread.
pub fn run(node: &mut dyn Node, link: &Link, pace: Pace, stop: &Stop) -> Result<(), BusError> {
    run_nudged(node, link, pace, stop, &Nudge::default())
}

/// The same with direct links to some processes of the same machine besides.
pub fn run_linked(
    node: &mut dyn Node,
    link: &Link,
    direct: Option<&Direct>,
    pace: Pace,
    stop: &Stop,
) -> Result<(), BusError> {
    run_with(node, link, direct, pace, stop, &Nudge::default())
}

/// The same for a node that has something to do besides what the bus brings: each `nudge` has it act.
pub fn run_nudged(node: &mut dyn Node, link: &Link, pace: Pace, stop: &Stop, nudge: &Nudge) -> Result<(), BusError> {
    run_with(node, link, None, pace, stop, nudge)
}

fn run_with(
    node: &mut dyn Node,
    link: &Link,
    direct: Option<&Direct>,
    pace: Pace,
    stop: &Stop,
    nudge: &Nudge,
) -> Result<(), BusError> {
    let session = session::open(link)?;
    let direct = direct.map(|it| direct::open(it, &link.scope)).transpose()?;
    let direct = direct.as_ref();
    let mailbox = Mailbox::default();
    let loop_of_it = mailbox.clone();
    nudge.attach(move || loop_of_it.nudge());
    let wake = mailbox.clone();
    stop.on_stop(move || wake.stop());
    let queries = inbox::declare(&session, direct, &link.scope, node, &mailbox)?;
    inbox::watch_peers(&session, &link.scope, &mailbox)?;
    let clocks = inbox::listen_to_clocks(&session, &link.scope)?;
    let instance = session.zid().to_string();
    // Last: who sees the token finds everything else declared.
    let token_key = keys::alive(node.name(), &instance);
    let token = session
        .liveliness()
        .declare_token(&token_key)
        .wait()
        .map_err(|cause| BusError::Declare { key: token_key, cause: cause.to_string() })?;
    let mut shell = Shell {
        clock: Clock::start(pace),
        outbox: Outbox::new(&session, direct, &link.scope, clocks.clone()),
        calls: Calls::new(&session, direct, &link.scope, mailbox.clone(), clocks),
        queries,
        mailbox,
        instance,
        handled: 0,
        refusals: BTreeMap::new(),
        next_heartbeat: Instant::now(),
    };
    let result = shell.run(node);
    drop(shell);
    // Gone from everybody's sight first, then the session; a close that hangs is the process's end anyway.
    let _ = token.undeclare().wait();
    let _ = session.close().wait();
    if let Some(direct) = direct {
        let _ = direct.close().wait();
    }
    result
}

struct Shell<'a> {
    clock: Clock,
    outbox: Outbox<'a>,
    calls: Calls<'a>,
    queries: OpenQueries,
    mailbox: Mailbox,
    instance: String,
    handled: u64,
    /// Messages that the node refused because of their content, by kind.
    refusals: BTreeMap<MessageKind, u64>,
    next_heartbeat: Instant,
}

impl Shell<'_> {
    fn run(&mut self, node: &mut dyn Node) -> Result<(), BusError> {
        let mut batch = Vec::new();
        let mut effects = Vec::new();
        loop {
            let go_on = self.mailbox.wait(self.next_wake(node), &mut batch);
            // What this batch is about; the decisions taken at its end belong to the same trace.
            let mut cause = None;
            for mail in batch.drain(..) {
                if let Some((event, parent)) = self.open(mail) {
                    self.show(node, event, parent, &mut cause, &mut effects)?;
                }
            }
            let mut late = Vec::new();
            self.calls.tend(Instant::now(), &mut late)?;
            for event in late {
                self.show(node, event, None, &mut cause, &mut effects)?;
            }
            {
                let _entered = cause.as_ref().map(|it: &Parent| trace::span("act", Some(it)).entered());
                node.act(self.clock.now(), &mut effects);
                self.perform(&mut effects)?;
            }
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
            Event::Request { request, .. } => Some(request.service().key()),
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
        // What the vehicle must do leaves before what others may read: each effect takes its time to be sent.
        effects.sort_by_key(|it| !is_command(it));
        for effect in effects.drain(..) {
            match effect {
                Effect::Publish { vehicle, message } => self.outbox.publish(vehicle, &message)?,
                Effect::Call { call, vehicle, trace, request, timeout } => {
                    // What comes from outside the bus brings its own trace, or begins one.
                    let span = trace
                        .map(|it| trace::span(request.service().key(), Some(it).filter(|it| !it.is_empty()).as_ref()));
                    let _entered = span.map(|it| it.entered());
                    self.calls.call(call, vehicle, &request, Instant::now() + self.clock.to_wall(timeout))?;
                }
                Effect::Reply { token, response } => {
                    if let Some(query) = self.queries.take(token)
                        && let Err(cause) = query.reply(query.key_expr(), response.encode()).wait()
                    {
                        tracing::warn!(key = query.key_expr().as_str(), %cause, "reply not sent");
                    }
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

    fn beat(&mut self, node: &dyn Node) -> Result<(), BusError> {
        let now = Instant::now();
        if now < self.next_heartbeat {
            return Ok(());
        }
        self.next_heartbeat = now + HEARTBEAT;
        let losses = self.mailbox.losses();
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
        };
        self.outbox.publish(None, &Message::Heartbeat(heartbeat))
    }
}

fn is_command(effect: &Effect) -> bool {
    matches!(effect, Effect::Publish { message, .. } if message.topic().qos() == Qos::Command)
}
