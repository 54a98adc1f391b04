//! All services in one thread on a virtual bus and a virtual clock: the same nodes, no transport.
//!
//! Time jumps from one event or deadline to the next. On an ideal [`Machine`] delivery is immediate and in order of
//! publication; on a busy one messages and processes are late, and what is not promised to be in order is not.
//! With the same nodes, the same script and the same machine a run is the same to the bit.

use std::time::Duration;

use domain::time::{Now, Time};
use kittiwake_proto::topics::{Message, Request, Response};

use crate::{CallError, CallId, Effect, Event, Node, Token, VehicleId};

mod machine;
mod post;

use machine::Delays;
pub use machine::Machine;
use post::Post;

/// UTC at virtual time zero: 2026-01-01T00:00:00Z. A fixed date keeps runs identical.
pub const UTC_START_MS: i64 = 1_767_225_600_000;

/// So much at one moment of virtual time is nodes that keep each other, or themselves, busy for ever.
const LIVELOCK: u32 = 10_000;

/// Nodes, their shared clock and the messages between them.
pub struct VirtualBus<'a> {
    vehicle: VehicleId,
    nodes: Vec<Box<dyn Node + 'a>>,
    now: Time,
    /// When each node has its next turn at the earliest.
    free_from: Vec<Time>,
    delays: Delays,
    post: Post,
    calls: Vec<OpenCall>,
    next_token: u64,
    tap: Tap<'a>,
}

/// Is shown every published message, with the time.
type Tap<'a> = Box<dyn FnMut(Time, &Message) + 'a>;

struct OpenCall {
    token: Token,
    caller: usize,
    id: CallId,
    until: Time,
}

impl<'a> VirtualBus<'a> {
    /// A bus without nodes, for one vehicle.
    pub fn new(vehicle: &str, machine: Machine) -> VirtualBus<'a> {
        VirtualBus {
            vehicle: vehicle.into(),
            nodes: Vec::new(),
            now: Time::ZERO,
            free_from: Vec::new(),
            delays: Delays::of(machine),
            post: Post::default(),
            calls: Vec::new(),
            next_token: 1,
            tap: Box::new(|_, _| {}),
        }
    }

    /// Adds a node; every node learns that the other is there.
    pub fn add(&mut self, node: impl Node + 'a) {
        let index = self.nodes.len();
        let names: Vec<_> = self.nodes.iter().map(|it| it.name()).collect();
        for (other, name) in names.into_iter().enumerate() {
            self.send(None, index, self.peer(name));
            self.send(None, other, self.peer(node.name()));
        }
        self.nodes.push(Box::new(node));
        self.free_from.push(Time::ZERO);
    }

    /// Shows every published message to `tap`, with the time.
    pub fn tap(&mut self, tap: impl FnMut(Time, &Message) + 'a) {
        self.tap = Box::new(tap);
    }

    /// The virtual time.
    pub fn now(&self) -> Time {
        self.now
    }

    /// Publishes `message` from outside.
    pub fn publish(&mut self, message: impl Into<Message>) {
        let message = message.into();
        self.deliver(None, self.vehicle.clone(), message);
    }

    /// Sends `request` from outside; its answer is not waited for.
    pub fn request(&mut self, request: Request) {
        let token = self.token();
        self.ask(None, token, request);
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
                Some(node) => {
                    assert!(turns < LIVELOCK, "time stands still: {} acts again and again", self.nodes[node].name());
                    self.take_turn(node);
                }
                None => self.give_up_on_late_replies(),
            }
        }
    }

    /// What comes next: when, and whose turn; nobody's when a call is to be given up.
    fn next(&self) -> Option<(Time, Option<usize>)> {
        let mail = self.post.next(&self.free_from);
        // What has arrived comes first.
        if let Some((at, node)) = mail.filter(|(at, _)| *at <= self.now) {
            return Some((at, Some(node)));
        }
        let calls = self.calls.iter().map(|it| (it.until, None));
        let mail = mail.map(|(at, node)| (at, Some(node)));
        let deadlines = self.nodes.iter().zip(&self.free_from).enumerate();
        let deadlines = deadlines.filter_map(|(node, (it, free))| Some((it.deadline()?.max(*free), Some(node))));
        calls.chain(mail).chain(deadlines).min_by_key(|(at, _)| *at)
    }

    /// A node takes in what has arrived, and acts.
    fn take_turn(&mut self, node: usize) {
        let now = self.moment();
        for event in self.post.collect(node, self.now) {
            let mut effects = Vec::new();
            self.nodes[node].on(now, event, &mut effects);
            self.perform(node, effects);
        }
        let mut effects = Vec::new();
        self.nodes[node].act(now, &mut effects);
        self.perform(node, effects);
        self.free_from[node] = self.now + self.delays.draw();
    }

    fn perform(&mut self, index: usize, effects: Vec<Effect>) {
        for effect in effects {
            match effect {
                Effect::Publish { vehicle, message } => {
                    self.deliver(Some(index), vehicle.unwrap_or_else(|| self.vehicle.clone()), message);
                }
                Effect::Call { call, request, timeout, .. } => {
                    let token = self.token();
                    self.calls.push(OpenCall { token, caller: index, id: call, until: self.now + timeout });
                    if !self.ask(Some(index), token, request) {
                        self.answer(None, token, Err(CallError::Unavailable));
                    }
                }
                Effect::Reply { token, response } => self.answer(Some(index), token, Ok(response)),
            }
        }
    }

    /// To everybody but the sender, as on the real bus.
    fn deliver(&mut self, from: Option<usize>, vehicle: VehicleId, message: Message) {
        (self.tap)(self.now, &message);
        let topic = message.topic();
        for to in 0..self.nodes.len() {
            if from != Some(to) && self.nodes[to].subscriptions().contains(&topic) {
                self.send(from, to, Event::Message { vehicle: vehicle.clone(), message: message.clone() });
            }
        }
    }

    /// Whether somebody serves the request.
    fn ask(&mut self, from: Option<usize>, token: Token, request: Request) -> bool {
        let service = request.service();
        let Some(server) = self.nodes.iter().position(|it| it.serves().contains(&service)) else { return false };
        self.send(from, server, Event::Request { vehicle: self.vehicle.clone(), token, request });
        true
    }

    /// Answers a call; one that would get its answer too late is given up when its time is over.
    fn answer(&mut self, from: Option<usize>, token: Token, result: Result<Response, CallError>) {
        let Some(position) = self.calls.iter().position(|it| it.token == token) else { return };
        let delay = self.delays.draw();
        if self.now + delay <= self.calls[position].until {
            let OpenCall { caller, id, .. } = self.calls.remove(position);
            self.post.send(from, caller, Event::Reply { call: id, result }, self.now, delay);
        }
    }

    fn send(&mut self, from: Option<usize>, to: usize, event: Event) {
        let delay = self.delays.draw();
        self.post.send(from, to, event, self.now, delay);
    }

    fn give_up_on_late_replies(&mut self) {
        let now = self.now;
        for OpenCall { caller, id, .. } in self.calls.extract_if(.., |it| it.until <= now) {
            let event = Event::Reply { call: id, result: Err(CallError::Unanswered) };
            self.post.send(None, caller, event, now, Duration::ZERO);
        }
    }

    fn token(&mut self) -> Token {
        self.next_token += 1;
        Token(self.next_token)
    }

    fn peer(&self, service: &str) -> Event {
        Event::Peer { vehicle: self.vehicle.clone(), service: service.into(), instance: "virtual".into(), alive: true }
    }

    fn moment(&self) -> Now {
        Now { time: self.now, utc_ms: UTC_START_MS + self.now.since_start().as_millis() as i64 }
    }
}
