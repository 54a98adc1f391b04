//! The direct links of a process: who called, whom it calls, and what is sent and read over them. The node's loop is the only one that
//! touches them.

use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::path::PathBuf;

use kittiwake_proto::topics::{Response, Service, Topic};
use nix::unistd::geteuid;
use node::{CallError, CallId, Event, Node};
use prost::Message as _;

use super::Direct;
use super::connection::{Asked, Connection};
use super::packet::{Hello, Kind, LONGEST, Packet};
use super::socket::{self, Received, Sent};
use crate::inbox::{Asker, Inbox, Refusal};
use crate::mailbox::Mail;
use crate::outbox::goes_directly;
use crate::{BusError, Scope, sockets};

/// Callers that are taken in: there are fewer processes on board.
const MOST_CALLERS: usize = 16;

/// Packets that are read from one connection before the others have their turn.
const TURN: usize = 64;

/// All of a process. Without any they do nothing.
pub(crate) struct Links {
    inbox: Inbox,
    vehicle: String,
    hello: Vec<u8>,
    listener: Option<OwnedFd>,
    /// Callers wait that cannot be taken in. Until the next [`Links::call`] nobody looks for them: they would keep the loop awake.
    callers_wait: bool,
    called: Vec<Called>,
    connections: Vec<Connection>,
    /// Numbers connections and requests.
    last: u64,
    buffer: Vec<u8>,
}

/// A process that this one calls.
struct Called {
    path: PathBuf,
    /// Why there is no link although somebody is there, as it was said last: it is tried for ever, and said once.
    trouble: Option<String>,
}

impl Links {
    /// None at all.
    pub(crate) fn none(inbox: Inbox) -> Links {
        let (vehicle, hello) = (String::new(), Vec::new());
        Links {
            inbox,
            vehicle,
            hello,
            listener: None,
            callers_wait: false,
            called: Vec::new(),
            connections: Vec::new(),
            last: 0,
            buffer: Vec::new(),
        }
    }

    /// Those of `direct`, for `node`. It waits for nobody.
    ///
    /// # Errors
    /// If the process's own socket, or its folder, is not to be used.
    pub(crate) fn open(direct: &Direct, node: &dyn Node, inbox: Inbox) -> Result<Links, BusError> {
        // Only a vehicle's processes are on one machine.
        let Scope::Vehicle(vehicle) = inbox.scope().clone() else { return Ok(Links::none(inbox)) };
        let topics = node.subscriptions().iter().filter(|it| goes_directly(**it)).map(|it| it.key().to_owned());
        let services = node.serves().iter().map(|it| it.key().to_owned());
        let hello = Hello::new(&vehicle, node.name(), topics.collect(), services.collect()).encode_to_vec();
        let paths: Vec<_> = direct.connect.iter().map(|it| direct.path(it)).collect();
        paths.iter().try_for_each(|it| sockets::check_to_connect(it))?;
        let listener = direct.listen.as_ref().map(|it| direct.path(it)).map(|path| {
            sockets::check_to_listen(&path)?;
            socket::listen(&path)
                .map_err(|cause| BusError::Listen { locators: path.display().to_string(), cause: cause.to_string() })
        });
        let called = paths.into_iter().map(|path| Called { path, trouble: None }).collect();
        let buffer = vec![0; LONGEST];
        let listener = listener.transpose()?;
        let (connections, callers_wait) = (Vec::new(), false);
        let mut links = Links { inbox, vehicle, hello, listener, callers_wait, called, connections, last: 0, buffer };
        links.call();
        Ok(links)
    }

    /// What tells that there is something to read.
    pub(crate) fn descriptors(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        let listener = self.listener.iter().filter(|_| !self.callers_wait);
        listener.map(AsFd::as_fd).chain(self.connections.iter().map(|it| it.socket.as_fd()))
    }

    /// Tries to connect to each process on its list that it has no link to. One that is not running costs a system call.
    pub(crate) fn call(&mut self) {
        self.callers_wait = false;
        for place in 0..self.called.len() {
            if self.connections.iter().any(|it| it.called == Some(place)) {
                continue;
            }
            let Ok(socket) = socket::connect(&self.called[place].path) else { continue };
            match self.may_speak(&socket) {
                Ok(()) => self.greet(socket, Some(place)),
                Err(why) => self.say(place, why),
            }
        }
    }

    /// Takes in callers, and reads what there is.
    pub(crate) fn read(&mut self) {
        while let Some(socket) = self.next_caller() {
            let callers = self.connections.iter().filter(|it| it.called.is_none()).count();
            match self.may_speak(&socket) {
                Ok(()) if callers < MOST_CALLERS => self.greet(socket, None),
                Ok(()) => self.inbox.refuse("(direct link)", "too many callers at once"),
                Err(why) => self.inbox.refuse("(direct link)", &why),
            }
        }
        let mut buffer = std::mem::take(&mut self.buffer);
        let mut at = 0;
        while at < self.connections.len() {
            match self.read_turn(at, &mut buffer) {
                Ok(()) => at += 1,
                Err(why) => self.close(at, why),
            }
        }
        self.buffer = buffer;
    }

    fn next_caller(&mut self) -> Option<OwnedFd> {
        let listener = self.listener.as_ref().filter(|_| !self.callers_wait)?;
        match socket::accept(listener) {
            Ok(caller) => caller,
            Err(cause) => {
                self.callers_wait = true;
                self.inbox.refuse("(direct link)", &cause.to_string());
                None
            }
        }
    }

    /// Sends a message to those who listen to it. Whom it does not reach hears it by the router.
    pub(crate) fn send(&mut self, topic: Topic, attachment: &[u8], payload: &[u8]) {
        let packet = Packet { kind: Kind::Message, number: 0, key: topic.key(), attachment, payload };
        let mut at = 0;
        while at < self.connections.len() {
            let connection = &self.connections[at];
            match if connection.listens(topic) { connection.send(&packet) } else { Sent::Whole } {
                Sent::Whole | Sent::NoRoom => at += 1,
                Sent::End => self.close(at, None),
            }
        }
    }

    /// Sends a request to who serves it; false if nobody does here, or it cannot be sent: then it goes by the router.
    pub(crate) fn ask(&mut self, service: Service, asked: (CallId, u32), attachment: &[u8], payload: &[u8]) -> bool {
        let Some(at) = self.connections.iter().position(|it| it.serves(service)) else { return false };
        self.last += 1;
        let number = self.last;
        let packet = Packet { kind: Kind::Request, number, key: service.key(), attachment, payload };
        match self.connections[at].send(&packet) {
            Sent::Whole => {
                let (call, attempt) = asked;
                self.connections[at].asked(number, Asked { call, attempt, service });
                return true;
            }
            Sent::NoRoom => {}
            Sent::End => self.close(at, None),
        }
        false
    }

    /// Answers a request that came over `connection`; `None`: the node has left it without an answer.
    pub(crate) fn answer(&mut self, connection: u64, number: u64, payload: Option<&[u8]>) {
        let kind = if payload.is_some() { Kind::Reply } else { Kind::Failure };
        self.tell(connection, &Packet::about(kind, number, payload.unwrap_or_default()));
    }

    /// If an answer cannot be sent, the connection is closed: that tells the caller to send its request again.
    fn tell(&mut self, connection: u64, packet: &Packet<'_>) {
        let Some(at) = self.connections.iter().position(|it| it.id == connection) else { return };
        if self.connections[at].send(packet) != Sent::Whole {
            self.close(at, None);
        }
    }

    fn greet(&mut self, socket: OwnedFd, called: Option<usize>) {
        self.last += 1;
        let connection = Connection::new(self.last, socket, called);
        if connection.send(&Packet::about(Kind::Hello, 0, &self.hello)) == Sent::Whole {
            self.connections.push(connection);
        }
    }

    /// The folder lets no other user in; this is the second look.
    fn may_speak(&self, socket: &OwnedFd) -> Result<(), String> {
        let (own, other) = (geteuid().as_raw(), socket::user(socket).map_err(|it| it.to_string())?);
        match own == other || own == 0 || other == 0 {
            true => Ok(()),
            false => Err(format!("its process runs as user {other}, this one as user {own}")),
        }
    }

    /// Reads what one connection has. A foreign packet ends the connection.
    fn read_turn(&mut self, at: usize, buffer: &mut [u8]) -> Result<(), Option<String>> {
        for _ in 0..TURN {
            match socket::receive(&self.connections[at].socket, buffer) {
                Received::Nothing => return Ok(()),
                Received::End => return Err(None),
                Received::Packet(length) => {
                    let bytes = buffer.get(..length).ok_or_else(|| Some(format!("a packet of {length} bytes")))?;
                    let packet = Packet::read(bytes)
                        .ok_or_else(|| Some("it sends something that is not a packet".to_owned()))?;
                    self.take(at, &packet)?;
                }
            }
        }
        Ok(())
    }

    fn take(&mut self, at: usize, packet: &Packet<'_>) -> Result<(), Option<String>> {
        let Packet { kind, number, key, attachment, payload } = *packet;
        match kind {
            Kind::Hello => {
                let hello = Hello::read(payload, &self.vehicle).map_err(Some)?;
                if let Some(called) = self.connections[at].called {
                    self.called[called].trouble = None;
                }
                tracing::debug!(peer = hello.service, "linked directly");
                self.connections[at].greeted(&hello);
            }
            Kind::Message => {
                let topic = Topic::ALL.iter().copied().find(|it| it.key() == key && goes_directly(*it));
                let topic = topic.ok_or_else(|| Some(format!("no topic of direct links: `{key}`")))?;
                self.inbox.direct_message(topic, key, payload, attachment);
            }
            Kind::Request => {
                let service = Service::ALL.iter().copied().find(|it| it.key() == key);
                let service = service.ok_or_else(|| Some(format!("no service: `{key}`")))?;
                let asker = Asker::Direct { connection: self.connections[at].id, number };
                if let Some((_, refusal)) = self.inbox.request(service, key, payload, Some(attachment), asker) {
                    let kind = if refusal == Refusal::NoRoom { Kind::Unserved } else { Kind::Failure };
                    if self.connections[at].send(&Packet::about(kind, number, &[])) != Sent::Whole {
                        return Err(None);
                    }
                }
            }
            Kind::Reply | Kind::Failure | Kind::Unserved => {
                let Some(Asked { call, attempt, service }) = self.connections[at].settle(number) else { return Ok(()) };
                let result = match kind {
                    Kind::Unserved => {
                        self.inbox.mailbox().push(Mail::Unserved { call, attempt });
                        return Ok(());
                    }
                    Kind::Reply => match Response::decode(service, payload) {
                        Ok(response) => Ok(Event::Reply { call, result: Ok(response) }),
                        Err(_) => Err(CallError::Malformed),
                    },
                    _ => Err(CallError::Unanswered),
                };
                self.inbox.mailbox().push(Mail::Answer { call, attempt, result });
            }
        }
        Ok(())
    }

    /// Ends a connection, for this reason if it is not the other end's end. What it was asked is asked again, by the router.
    fn close(&mut self, at: usize, why: Option<String>) {
        let closed = self.connections.swap_remove(at);
        for asked in closed.unanswered() {
            self.inbox.mailbox().push(Mail::Unserved { call: asked.call, attempt: asked.attempt });
        }
        match (why, closed.called) {
            (Some(why), Some(called)) => self.say(called, why),
            (Some(why), None) => self.inbox.refuse("(direct link)", &why),
            (None, _) => {}
        }
    }

    fn say(&mut self, place: usize, why: String) {
        let called = &mut self.called[place];
        if called.trouble.as_ref() != Some(&why) {
            let path = called.path.display();
            tracing::warn!(%path, why, "no direct link: what goes there goes by the router");
            called.trouble = Some(why);
        }
    }
}

impl std::fmt::Debug for Links {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Links").field("connections", &self.connections).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests;
