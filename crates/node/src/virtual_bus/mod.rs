//! Services in one thread on a virtual bus and a virtual clock: the same nodes, no transport.
//!
//! Time jumps from one event or deadline to the next. On an ideal [`Machine`] an event arrives when it is sent, and in
//! that order; on a busy one events and nodes are late, and only what is promised to be in order is. The same nodes,
//! the same script and the same machine give the same run, to the bit.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::time::{Now, Time};
use kittiwake_proto::topics::{Message, Request, Service, Topic};
use kittiwake_proto::v1::Heartbeat;

use crate::{Effect, Event, MessageKind, Node, Scope, Token, commands_first};

mod calls;
mod delivery;
mod disturbance;
mod machine;
mod queue;
#[cfg(test)]
mod tests;

use calls::Calls;
pub use disturbance::Disturbance;
use disturbance::Disturbances;
use machine::Delays;
pub use machine::Machine;
use queue::{Index, Queue};

/// UTC at virtual time zero: 2026-01-01T00:00:00Z. A fixed date keeps runs identical.
pub const UTC_START_MS: i64 = 1_767_225_600_000;

/// Every node says this often that its loop makes progress, as over the real transport.
const HEARTBEAT: Duration = Duration::from_millis(250);

/// After this many turns at one moment of virtual time, nodes keep each other, or themselves, busy for ever.
const LIVELOCK: u32 = 10_000;

/// Nodes, their shared clock and the events between them.
pub struct VirtualBus<'a> {
    nodes: Vec<Member<'a>>,
    /// Processes that are being started again.
    starting: Vec<Starting<'a>>,
    now: Time,
    /// By how much the wall clock was set away from where it would be, in milliseconds.
    clock_set_ms: i64,
    delays: Delays,
    disturbances: Disturbances,
    queue: Queue,
    calls: Calls,
    next_token: u64,
    refusals: BTreeMap<(&'static str, MessageKind), u64>,
    unanswered: BTreeMap<(&'static str, Service), u64>,
    tap: Tap<'a>,
}

/// Gets every published message, with the time.
type Tap<'a> = Box<dyn FnMut(Time, &Message) + 'a>;

/// A node on the bus.
struct Member<'a> {
    node: Box<dyn Node + 'a>,
    scope: Scope,
    /// A bit for each topic that it receives: every message asks every node.
    subscribed: u64,
    /// When its next turn is at the earliest.
    free_from: Time,
    next_heartbeat: Time,
    /// The node's deadline since its last turn, which alone can move it: asked once, not before the turn of every other.
    deadline: Option<Time>,
    handled: u64,
    has_ended: bool,
    /// Requests that it has taken in and not answered.
    open: Vec<(Token, Service)>,
}

/// A process that follows one that was killed, before its node is on the bus.
struct Starting<'a> {
    at: Time,
    scope: Scope,
    node: Box<dyn Node + 'a>,
}

/// What comes next.
#[derive(Debug, Clone, Copy)]
enum Turn {
    /// A call expires.
    Expiry,
    /// A process that was killed is there again.
    Start,
    /// Takes in what has arrived, and acts.
    Events(Index),
    /// Says that its loop turns.
    Heartbeat(Index),
}

impl<'a> VirtualBus<'a> {
    /// A bus without nodes.
    pub fn new(machine: Machine) -> VirtualBus<'a> {
        VirtualBus {
            nodes: Vec::new(),
            starting: Vec::new(),
            now: Time::ZERO,
            clock_set_ms: 0,
            delays: Delays::of(machine),
            disturbances: Disturbances::default(),
            queue: Queue::default(),
            calls: Calls::default(),
            next_token: 1,
            refusals: BTreeMap::new(),
            unanswered: BTreeMap::new(),
            tap: Box::new(|_, _| {}),
        }
    }

    /// Adds a node; it sees the nodes in its scope, and they see it.
    pub fn add(&mut self, scope: Scope, node: impl Node + 'a) {
        self.add_boxed(scope, Box::new(node));
    }

    fn add_boxed(&mut self, scope: Scope, node: Box<dyn Node + 'a>) {
        let added = self.nodes.len();
        let member = Member {
            subscribed: node.subscriptions().iter().fold(0, |topics, topic| topics | bit(*topic)),
            deadline: node.deadline(),
            node,
            scope,
            free_from: self.now,
            next_heartbeat: self.now,
            handled: 0,
            has_ended: false,
            open: Vec::new(),
        };
        self.nodes.push(member);
        for other in (0..added).filter(|it| !self.nodes[*it].has_ended).collect::<Vec<_>>() {
            self.announce(other, added, true);
            self.announce(added, other, true);
        }
        self.announce(added, added, true);
        self.ask_again();
    }

    /// Gives every published message to `tap`, with the time.
    pub fn tap(&mut self, tap: impl FnMut(Time, &Message) + 'a) {
        self.tap = Box::new(tap);
    }

    /// The virtual time.
    pub fn now(&self) -> Time {
        self.now
    }

    /// How many messages each node has refused because of their content, by kind.
    pub fn refusals(&self) -> &BTreeMap<(&'static str, MessageKind), u64> {
        &self.refusals
    }

    /// How many requests each node has left without a reply, which is a mistake in the node, by service.
    pub fn unanswered(&self) -> &BTreeMap<(&'static str, Service), u64> {
        &self.unanswered
    }

    /// Publishes `message` of `vehicle` from outside.
    pub fn publish(&mut self, vehicle: &str, message: impl Into<Message>) {
        self.deliver(None, vehicle.into(), message.into());
    }

    /// Sends `request` to `vehicle` from outside; its reply is ignored.
    pub fn request(&mut self, vehicle: &str, request: Request) {
        self.ask(None, &vehicle.into(), &request);
    }

    /// Stops the process of the node called `name` for a while, as if it hung: it takes in nothing and sends nothing, not
    /// even a heartbeat. What has arrived meanwhile is in its mailbox then, and calls that have ended are over. One that is being started
    /// has nothing to hang with.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn freeze(&mut self, name: &str, time: Duration) {
        let until = self.now + time;
        let frozen = self.nodes.iter_mut().filter(|it| it.node.name() == name && !it.has_ended);
        let count = frozen.map(|it| it.free_from = it.free_from.max(until)).count();
        let is_starting = self.starting.iter().any(|it| it.node.name() == name);
        assert!(0 < count || is_starting, "there is no node `{name}`");
    }

    /// Kills the process of the node called like `successor`, which is there after `time`: what is under way to it is lost, its calls end with
    /// it, and the others see it vanish and appear. One that is being started is killed, too.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn restart(&mut self, time: Duration, successor: Box<dyn Node + 'a>) {
        let (name, at) = (successor.name(), self.now + time);
        if let Some(killed) = self.starting.iter().position(|it| it.node.name() == name) {
            let scope = self.starting.remove(killed).scope;
            return self.starting.push(Starting { at, scope, node: successor });
        }
        let killed = self.nodes.iter().position(|it| it.node.name() == name && !it.has_ended);
        let Some(killed) = killed else { panic!("there is no node `{name}`") };
        self.end(killed);
        let scope = self.nodes[killed].scope.clone();
        self.starting.push(Starting { at, scope, node: successor });
    }

    /// For this long what the nodes send each other is lost, sent twice or late, now and then. The later one takes the place of the
    /// earlier one.
    pub fn disturb(&mut self, disturbance: Disturbance, time: Duration) {
        self.disturbances.begin(disturbance, self.now + time);
    }

    /// Sets the wall clock of every node by this many milliseconds, forward or back.
    pub fn set_clock(&mut self, by_ms: i64) {
        self.clock_set_ms += by_ms;
    }

    /// Runs until `done` says so or `limit` of virtual time has passed; whether `done` said so.
    ///
    /// # Panics
    /// If virtual time stands still because nodes keep each other busy: a mistake in one of them.
    pub fn run_until(&mut self, limit: Duration, mut done: impl FnMut() -> bool) -> bool {
        let end = self.now + limit;
        let mut turns = 0;
        loop {
            if done() {
                return true;
            }
            let Some((at, turn)) = self.next() else { return false };
            if end < at {
                self.now = end;
                return false;
            }
            turns = if self.now < at { 0 } else { turns + 1 };
            self.now = self.now.max(at);
            match turn {
                Turn::Expiry => self.expire_calls(),
                Turn::Start => self.start(),
                Turn::Heartbeat(node) => self.beat(node),
                Turn::Events(node) => {
                    let name = self.nodes[node].node.name();
                    assert!(turns < LIVELOCK, "time stands still: {name} acts again and again");
                    self.take_turn(node);
                }
            }
        }
    }

    /// What comes next, and when.
    fn next(&self) -> Option<(Time, Turn)> {
        let arrival = self.queue.next(|node| self.nodes[node].free_from);
        // What has arrived comes first.
        if let Some((at, node)) = arrival.filter(|(at, _)| *at <= self.now) {
            return Some((at, Turn::Events(node)));
        }
        let expiry = self.calls.deadline().map(|at| (at, Turn::Expiry));
        let arrival = arrival.map(|(at, node)| (at, Turn::Events(node)));
        let present = || self.nodes.iter().enumerate().filter(|(_, it)| !it.has_ended);
        let deadlines = present().filter_map(|(index, it)| Some((it.deadline?.max(it.free_from), Turn::Events(index))));
        let heartbeats = present().map(|(index, it)| (it.next_heartbeat.max(it.free_from), Turn::Heartbeat(index)));
        let start = self.starting.iter().map(|it| (it.at, Turn::Start)).min_by_key(|(at, _)| *at);
        let others = start.into_iter().chain(deadlines).chain(heartbeats);
        expiry.into_iter().chain(arrival).chain(others).min_by_key(|(at, _)| *at)
    }

    /// The process that was to be there first is there.
    fn start(&mut self) {
        let first = self.starting.iter().enumerate().min_by_key(|(_, it)| it.at).map(|(index, _)| index);
        if let Some(first) = first {
            let Starting { scope, node, .. } = self.starting.remove(first);
            self.add_boxed(scope, node);
        }
    }

    /// A node says that its loop turns.
    fn beat(&mut self, index: Index) {
        let member = &mut self.nodes[index];
        member.next_heartbeat = self.now + HEARTBEAT;
        let heartbeat = Heartbeat {
            service: member.node.name().to_owned(),
            instance: instance(index),
            uptime_s: self.now.as_secs_f64(),
            handled: member.handled,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            ..Heartbeat::default()
        };
        let vehicle = member.scope.vehicle();
        self.deliver(Some(index), vehicle, heartbeat.into());
    }

    /// A node takes in what has arrived, and acts.
    fn take_turn(&mut self, index: Index) {
        let now = self.moment();
        for event in self.queue.take(index, self.now) {
            let member = &mut self.nodes[index];
            member.handled += 1;
            if let Event::Request { token, request, .. } = event.as_ref() {
                member.open.push((*token, request.service()));
            }
            let mut effects = Vec::new();
            member.node.on(now, *event, &mut effects);
            self.perform(index, effects);
        }
        let mut effects = Vec::new();
        self.nodes[index].node.act(now, &mut effects);
        self.perform(index, effects);
        self.fail_unanswered(index);
        self.nodes[index].free_from = self.now + self.delays.draw();
        self.nodes[index].deadline = self.nodes[index].node.deadline();
        if self.nodes[index].node.is_over() {
            self.end(index);
        }
    }

    /// A node that is over leaves the bus.
    fn end(&mut self, index: Index) {
        self.nodes[index].has_ended = true;
        self.queue.drop_all(index);
        self.calls.drop_node(index);
        for other in (0..self.nodes.len()).filter(|it| !self.nodes[*it].has_ended).collect::<Vec<_>>() {
            self.announce(index, other, false);
        }
        self.ask_again();
    }

    fn perform(&mut self, index: Index, mut effects: Vec<Effect>) {
        commands_first(&mut effects);
        for effect in effects {
            match effect {
                Effect::Publish { vehicle, message } => {
                    let vehicle = self.nodes[index].scope.address(vehicle);
                    self.deliver(Some(index), vehicle, message);
                }
                Effect::Call { call, vehicle, request, timeout, .. } => {
                    let vehicle = self.nodes[index].scope.address(vehicle);
                    self.call(index, call, vehicle, request, timeout);
                }
                Effect::Reply { token, response } => {
                    self.nodes[index].open.retain(|(open, _)| *open != token);
                    self.answer(index, token, Ok(response));
                }
                Effect::Refused { what, .. } => {
                    *self.refusals.entry((self.nodes[index].node.name(), what)).or_default() += 1;
                }
            }
        }
    }

    /// The virtual time, and UTC.
    pub fn moment(&self) -> Now {
        Now { time: self.now, utc_ms: UTC_START_MS + self.clock_set_ms + self.now.since_start().as_millis() as i64 }
    }
}

/// The topic as a set of one.
fn bit(topic: Topic) -> u64 {
    const { assert!(Topic::ALL.len() <= u64::BITS as usize, "a set of topics is 64 bits wide") };
    1_u64 << topic as u32
}

/// The start of the node at `index`, of which there is one.
fn instance(index: Index) -> String {
    format!("virtual-{index}")
}
