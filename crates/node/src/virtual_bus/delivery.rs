//! Who gets what.

use std::time::Duration;

use kittiwake_proto::topics::{Message, Request, Response, Topic};

use super::calls::{OpenCall, Progress};
use super::queue::Index;
use super::{Member, VirtualBus};
use crate::{CallError, CallId, Event, Token, VehicleId};

impl VirtualBus<'_> {
    /// Sends `message` to every subscriber in whose scope it is, except to its sender.
    pub(super) fn deliver(&mut self, from: Option<Index>, vehicle: VehicleId, message: Message) {
        (self.tap)(self.now, &message);
        let topic = message.topic();
        // The ground speaks about itself in heartbeats only.
        if vehicle.is_empty() && topic != Topic::Heartbeat {
            return;
        }
        let topics = super::bit(topic);
        let receives = |(to, it): (Index, &Member<'_>)| {
            let is_told = it.subscribed & topics != 0 && !it.has_ended && from != Some(to) && it.scope.covers(&vehicle);
            is_told.then_some(to)
        };
        let receivers: Vec<Index> = self.nodes.iter().enumerate().filter_map(receives).collect();
        let Some((last, others)) = receivers.split_last() else { return };
        for to in others {
            self.send(from, *to, Event::Message { vehicle: vehicle.clone(), message: message.clone() });
        }
        self.send(from, *last, Event::Message { vehicle, message });
    }

    /// A node calls.
    pub(super) fn call(&mut self, caller: Index, id: CallId, vehicle: VehicleId, request: Request, timeout: Duration) {
        let progress = self.ask(Some(caller), &vehicle, &request);
        self.calls.open(OpenCall { caller, id, until: self.now + timeout, vehicle, request, progress });
    }

    /// Sends a request to a node that serves it, if there is one.
    pub(super) fn ask(&mut self, from: Option<Index>, vehicle: &VehicleId, request: &Request) -> Progress {
        let service = request.service();
        let server = self.nodes.iter().position(|it| {
            let serves = it.node.serves().contains(&service) && it.scope.covers(vehicle);
            serves && !it.has_ended && !vehicle.is_empty()
        });
        let Some(server) = server else { return Progress::Unserved };
        self.next_token += 1;
        let token = Token(self.next_token);
        self.send(from, server, Event::Request { vehicle: vehicle.clone(), token, request: request.clone() });
        Progress::Asked(server, token)
    }

    /// Sends the requests that no node served so far, now that the nodes are others.
    pub(super) fn ask_again(&mut self) {
        let mut calls = std::mem::take(&mut self.calls);
        for call in calls.unserved() {
            call.progress = self.ask(Some(call.caller), &call.vehicle, &call.request);
        }
        self.calls = calls;
    }

    /// Ends the call that waits for the reply to this token, if the reply arrives in time.
    pub(super) fn answer(&mut self, from: Index, token: Token, result: Result<Response, CallError>) {
        let Some(call) = self.calls.asked(token) else { return };
        let delay = self.delays.draw();
        if call.until < self.now + delay {
            call.progress = Progress::AnsweredLate;
            return;
        }
        if self.disturbances.loses(self.now) {
            // Which its caller finds out when the time for it is over.
            call.progress = Progress::AnsweredLate;
            return;
        }
        let (caller, id) = (call.caller, call.id);
        self.calls.close(caller, id);
        self.queue.send(Some(from), caller, Event::Reply { call: id, result }, self.now, delay);
    }

    /// The turn of `node` is over: requests that it has not answered never will be.
    pub(super) fn fail_unanswered(&mut self, node: Index) {
        for (token, service) in std::mem::take(&mut self.nodes[node].open) {
            if self.nodes[node].node.answers_later(token) {
                self.nodes[node].open.push((token, service));
                continue;
            }
            *self.unanswered.entry((self.nodes[node].node.name(), service)).or_default() += 1;
            self.answer(node, token, Err(CallError::Unanswered));
        }
    }

    pub(super) fn expire_calls(&mut self) {
        for (caller, call, error) in self.calls.expire(self.now) {
            self.queue.send(None, caller, Event::Reply { call, result: Err(error) }, self.now, Duration::ZERO);
        }
    }

    /// `node` has appeared or vanished; `to` sees that if it is in its scope.
    pub(super) fn announce(&mut self, node: Index, to: Index, alive: bool) {
        let vehicle = self.nodes[node].scope.vehicle();
        if self.nodes[to].scope.covers(&vehicle) {
            let service = self.nodes[node].node.name().to_owned();
            self.send(None, to, Event::Peer { vehicle, service, instance: super::instance(node), alive });
        }
    }

    fn send(&mut self, from: Option<Index>, to: Index, event: Event) {
        let undisturbed = [Some(Duration::ZERO), None];
        let [first, second] = from.map_or(undisturbed, |_| self.disturbances.copies(self.now, &event));
        if let Some(late) = second {
            let delay = late + self.delays.draw();
            self.queue.send(from, to, event.clone(), self.now, delay);
        }
        if let Some(late) = first {
            let delay = late + self.delays.draw();
            self.queue.send(from, to, event, self.now, delay);
        }
    }
}
