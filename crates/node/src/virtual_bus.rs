//! All services in one thread on a virtual bus and a virtual clock: the same nodes, no transport.
//!
//! Delivery is immediate and in order of publication; time jumps from one deadline to the next.
//! With the same nodes and the same script a run is the same to the bit.

use std::collections::VecDeque;
use std::time::Duration;

use domain::time::{Now, Time};
use kittiwake_proto::topics::{Message, Request, Response};

use crate::{CallError, CallId, Effect, Event, Node, Token, VehicleId};

/// UTC at virtual time zero: 2026-01-01T00:00:00Z. A fixed date keeps runs identical.
pub const UTC_START_MS: i64 = 1_767_225_600_000;

/// So much at one moment of virtual time is nodes that keep each other, or themselves, busy for ever.
const LIVELOCK: u32 = 10_000;

/// Nodes, their shared clock and the messages between them.
pub struct VirtualBus<'a> {
    vehicle: VehicleId,
    nodes: Vec<Box<dyn Node + 'a>>,
    now: Time,
    /// Events on their way, with the index of the node they are for.
    queue: VecDeque<(usize, Event)>,
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
    pub fn new(vehicle: &str) -> VirtualBus<'a> {
        VirtualBus {
            vehicle: vehicle.into(),
            nodes: Vec::new(),
            now: Time::ZERO,
            queue: VecDeque::new(),
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
            self.queue.push_back((index, self.peer(name)));
            self.queue.push_back((other, self.peer(node.name())));
        }
        self.nodes.push(Box::new(node));
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
        self.ask(token, request);
    }

    /// Runs until `done` says so or `limit` of virtual time has passed; whether `done` said so.
    ///
    /// # Panics
    /// If virtual time stands still because nodes keep each other busy: a mistake in one of them.
    pub fn run_until(&mut self, limit: Duration, mut done: impl FnMut() -> bool) -> bool {
        let end = self.now + limit;
        let mut idle_rounds = 0;
        loop {
            self.drain();
            if done() {
                return true;
            }
            let deadlines = self.nodes.iter().filter_map(|it| it.deadline());
            let Some(next) = deadlines.chain(self.calls.iter().map(|it| it.until)).min() else { return false };
            if next > end {
                self.now = end;
                return false;
            }
            idle_rounds = if next <= self.now { idle_rounds + 1 } else { 0 };
            assert!(idle_rounds < LIVELOCK, "time stands still: {} wants to act again and again", self.first_due(next));
            self.now = self.now.max(next);
            self.give_up_on_late_replies();
            for index in 0..self.nodes.len() {
                if self.nodes[index].deadline().is_some_and(|it| it <= self.now) {
                    self.act(index);
                }
            }
        }
    }

    fn drain(&mut self) {
        let mut handled = 0;
        while let Some((index, event)) = self.queue.pop_front() {
            handled += 1;
            assert!(handled < LIVELOCK, "time stands still: {} gets {event:?}", self.nodes[index].name());
            let mut effects = Vec::new();
            let now = self.moment();
            self.nodes[index].on(now, event, &mut effects);
            self.perform(index, effects);
            if !self.queue.iter().any(|(for_node, _)| *for_node == index) {
                self.act(index);
            }
        }
    }

    fn first_due(&self, next: Time) -> &'static str {
        self.nodes.iter().find(|it| it.deadline().is_some_and(|at| at <= next)).map_or("a call", |it| it.name())
    }

    fn act(&mut self, index: usize) {
        let mut effects = Vec::new();
        let now = self.moment();
        self.nodes[index].act(now, &mut effects);
        self.perform(index, effects);
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
                    if !self.ask(token, request) {
                        self.answer(token, Err(CallError::Unavailable));
                    }
                }
                Effect::Reply { token, response } => self.answer(token, Ok(response)),
            }
        }
    }

    /// To everybody but the sender, as on the real bus.
    fn deliver(&mut self, from: Option<usize>, vehicle: VehicleId, message: Message) {
        (self.tap)(self.now, &message);
        let topic = message.topic();
        for (index, node) in self.nodes.iter().enumerate() {
            if from != Some(index) && node.subscriptions().contains(&topic) {
                self.queue.push_back((index, Event::Message { vehicle: vehicle.clone(), message: message.clone() }));
            }
        }
    }

    /// Whether somebody serves the request.
    fn ask(&mut self, token: Token, request: Request) -> bool {
        let service = request.service();
        let Some(server) = self.nodes.iter().position(|it| it.serves().contains(&service)) else { return false };
        self.queue.push_back((server, Event::Request { vehicle: self.vehicle.clone(), token, request }));
        true
    }

    fn answer(&mut self, token: Token, result: Result<Response, CallError>) {
        if let Some(position) = self.calls.iter().position(|it| it.token == token) {
            let OpenCall { caller, id, .. } = self.calls.remove(position);
            self.queue.push_back((caller, Event::Reply { call: id, result }));
        }
    }

    fn give_up_on_late_replies(&mut self) {
        let late: Vec<_> = self.calls.iter().filter(|it| it.until <= self.now).map(|it| it.token).collect();
        for token in late {
            self.answer(token, Err(CallError::Unanswered));
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
