//! One connection of the direct links, of either end.

use std::collections::BTreeMap;
use std::os::fd::OwnedFd;

use kittiwake_proto::topics::{Service, Topic};
use node::CallId;

use super::packet::{Hello, Packet};
use super::socket::{self, Sent};

/// Requests under way over one connection; a node that has more of them is broken.
const MOST_ASKED: usize = 256;

/// A request that waits for its answer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asked {
    pub(super) call: CallId,
    pub(super) attempt: u32,
    pub(super) service: Service,
}

/// A connection, and what is known of the other end.
#[derive(Debug)]
pub(super) struct Connection {
    /// Another one for each connection of this process.
    pub(super) id: u64,
    pub(super) socket: OwnedFd,
    /// Whom this process has called, by its place in the list.
    pub(super) called: Option<usize>,
    topics: Vec<Topic>,
    services: Vec<Service>,
    asked: BTreeMap<u64, Asked>,
}

impl Connection {
    pub(super) fn new(id: u64, socket: OwnedFd, called: Option<usize>) -> Connection {
        Connection { id, socket, called, topics: Vec::new(), services: Vec::new(), asked: BTreeMap::new() }
    }

    /// The other end has said who it is.
    pub(super) fn greeted(&mut self, hello: &Hello) {
        let (topics, services) = (&hello.topics, &hello.services);
        self.topics = Topic::ALL.iter().copied().filter(|it| topics.iter().any(|key| key == it.key())).collect();
        self.services = Service::ALL.iter().copied().filter(|it| services.iter().any(|key| key == it.key())).collect();
    }

    /// Whether the other end listens to `topic`. Nobody does before it has said who it is.
    pub(super) fn listens(&self, topic: Topic) -> bool {
        self.topics.contains(&topic)
    }

    /// Whether the other end answers `service`.
    pub(super) fn serves(&self, service: Service) -> bool {
        self.services.contains(&service)
    }

    pub(super) fn send(&self, packet: &Packet<'_>) -> Sent {
        match packet.head() {
            Some(head) => socket::send(&self.socket, &packet.parts(&head)),
            None => Sent::NoRoom,
        }
    }

    /// Keeps in mind what was asked.
    pub(super) fn asked(&mut self, number: u64, asked: Asked) {
        self.asked.insert(number, asked);
        // The oldest has ended by its deadline long ago.
        if MOST_ASKED < self.asked.len() {
            self.asked.pop_first();
        }
    }

    /// The request of this number, which is settled with that.
    pub(super) fn settle(&mut self, number: u64) -> Option<Asked> {
        self.asked.remove(&number)
    }

    /// Whatever waits for an answer.
    pub(super) fn unanswered(&self) -> impl Iterator<Item = &Asked> {
        self.asked.values()
    }
}
