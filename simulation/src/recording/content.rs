//! What a recording consists of, and its form in bytes.

use std::time::Duration;

use domain::memory::MemoryLoss;
use domain::time::{Now, Time};
use kittiwake_proto::topics::{Message, Request, Response, Service, Topic};
use node::{CallError, CallId, Event, Token};

use super::bytes::{Reader, put};

/// What stands at the beginning.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// Of the program that recorded it.
    pub program: String,
    /// The vehicle that flew.
    pub vehicle: String,
    /// What made the mission manager's request ids unique: of a simulated flight its seed.
    pub instance: u64,
    /// Mission time ran this many times as fast as the wall clock.
    pub speed: f64,
    /// The public key of the tower whose permissions were believed; empty: every permission was.
    pub tower_key: String,
    /// The files that were flown: configuration, mission, table and trees, by their names here.
    pub files: Vec<(String, String)>,
}

/// One thing in a recording, in the order in which it happened. Nodes are numbers in [`super::RECORDED`].
#[derive(Debug, Clone, PartialEq)]
pub enum Entry {
    /// A node was given something.
    Given {
        /// Which node.
        node: u8,
        /// When.
        now: Now,
        /// What.
        input: Input,
    },
    /// What a node did then, in words.
    Did {
        /// Which node.
        node: u8,
        /// What.
        what: String,
    },
}

/// What a node is given.
#[derive(Debug, Clone, PartialEq)]
pub enum Input {
    /// An event.
    Event(Event),
    /// Its turn.
    Act,
    /// Its process was killed, and is there again as this instance.
    Restart(u64),
    /// The state of a process before it.
    Resume(Vec<u8>),
    /// What a process before it has saved last is lost.
    Lost(MemoryLoss),
    /// The outcome of an attempt to save, and the loss that a failure is.
    Written(Result<(), String>, Option<u64>),
}

const CALL_ERRORS: [CallError; 4] =
    [CallError::Unavailable, CallError::Unanswered, CallError::Late, CallError::Malformed];

impl Header {
    pub(super) fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        put(&mut bytes, self.program.as_bytes());
        put(&mut bytes, self.vehicle.as_bytes());
        bytes.extend(self.instance.to_be_bytes());
        bytes.extend(self.speed.to_bits().to_be_bytes());
        put(&mut bytes, self.tower_key.as_bytes());
        bytes.extend((self.files.len() as u32).to_be_bytes());
        for (name, text) in &self.files {
            put(&mut bytes, name.as_bytes());
            put(&mut bytes, text.as_bytes());
        }
        bytes
    }

    pub(super) fn decode(bytes: &[u8]) -> Option<Header> {
        let mut reader = Reader(bytes);
        let (program, vehicle, instance) = (reader.text()?, reader.text()?, reader.u64()?);
        let (speed, tower_key) = (f64::from_bits(reader.u64()?), reader.text()?);
        let count = reader.u32()?;
        let mut files = Vec::new();
        for _ in 0..count {
            files.push((reader.text()?, reader.text()?));
        }
        Some(Header { program, vehicle, instance, speed, tower_key, files })
    }
}

impl Entry {
    pub(super) fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        match self {
            Entry::Did { node, what } => {
                bytes.extend([b'd', *node]);
                put(&mut bytes, what.as_bytes());
            }
            Entry::Given { node, now, input } => {
                bytes.extend([b'g', *node]);
                bytes.extend((now.time.since_start().as_nanos() as u64).to_be_bytes());
                bytes.extend(now.utc_ms.to_be_bytes());
                match input {
                    Input::Act => bytes.push(b'a'),
                    Input::Restart(instance) => {
                        bytes.push(b'n');
                        bytes.extend(instance.to_be_bytes());
                    }
                    Input::Resume(memory) => {
                        bytes.push(b's');
                        put(&mut bytes, memory);
                    }
                    Input::Lost(MemoryLoss { id, why }) => {
                        bytes.push(b'l');
                        bytes.extend(id.to_be_bytes());
                        put(&mut bytes, why.as_bytes());
                    }
                    Input::Written(outcome, loss) => {
                        bytes.push(b'w');
                        // A failure has a reason, and no loss has the number zero.
                        put(&mut bytes, outcome.as_ref().err().map_or("", String::as_str).as_bytes());
                        bytes.push(u8::from(outcome.is_ok()));
                        bytes.extend(loss.unwrap_or_default().to_be_bytes());
                    }
                    Input::Event(event) => encode_event(event, &mut bytes),
                }
            }
        }
        bytes
    }

    pub(super) fn decode(bytes: &[u8]) -> Option<Entry> {
        let mut reader = Reader(bytes);
        let (kind, node) = (reader.byte()?, reader.byte()?);
        if kind == b'd' {
            return Some(Entry::Did { node, what: reader.text()? });
        }
        if kind != b'g' || super::RECORDED.len() <= usize::from(node) {
            return None;
        }
        let time = Time::after(Duration::from_nanos(reader.u64()?));
        let now = Now { time, utc_ms: reader.u64()? as i64 };
        let input = match reader.byte()? {
            b'a' => Input::Act,
            b'n' => Input::Restart(reader.u64()?),
            b's' => Input::Resume(reader.bytes()?.to_vec()),
            b'l' => Input::Lost(MemoryLoss { id: reader.u64()?, why: reader.text()? }),
            b'w' => {
                let (why, is_ok) = (reader.text()?, reader.byte()? == 1);
                Input::Written(if is_ok { Ok(()) } else { Err(why) }, Some(reader.u64()?).filter(|it| *it != 0))
            }
            kind => Input::Event(decode_event(kind, &mut reader)?),
        };
        Some(Entry::Given { node, now, input })
    }
}

fn encode_event(event: &Event, bytes: &mut Vec<u8>) {
    match event {
        Event::Message { vehicle, message } => {
            bytes.push(b'm');
            put(bytes, vehicle.as_bytes());
            put(bytes, message.topic().key().as_bytes());
            put(bytes, &message.encode());
        }
        Event::Request { vehicle, token, request } => {
            bytes.push(b'q');
            put(bytes, vehicle.as_bytes());
            bytes.extend(token.0.to_be_bytes());
            put(bytes, request.service().key().as_bytes());
            put(bytes, &request.encode());
        }
        Event::Reply { call, result: Ok(response) } => {
            bytes.push(b'r');
            bytes.extend(call.0.to_be_bytes());
            put(bytes, service_of(response).key().as_bytes());
            put(bytes, &response.encode());
        }
        Event::Reply { call, result: Err(error) } => {
            bytes.push(b'e');
            bytes.extend(call.0.to_be_bytes());
            bytes.push(CALL_ERRORS.iter().position(|it| it == error).unwrap_or_default() as u8);
        }
        Event::Peer { vehicle, service, instance, alive } => {
            bytes.push(b'p');
            put(bytes, vehicle.as_bytes());
            put(bytes, service.as_bytes());
            put(bytes, instance.as_bytes());
            bytes.push(u8::from(*alive));
        }
    }
}

fn decode_event(kind: u8, reader: &mut Reader<'_>) -> Option<Event> {
    let topic = |key: &str| Topic::ALL.iter().copied().find(|it| it.key() == key);
    let service = |key: &str| Service::ALL.iter().copied().find(|it| it.key() == key);
    Some(match kind {
        b'm' => {
            let (vehicle, topic) = (reader.text()?.into(), topic(&reader.text()?)?);
            Event::Message { vehicle, message: Message::decode(topic, reader.bytes()?).ok()? }
        }
        b'q' => {
            let (vehicle, token) = (reader.text()?.into(), Token(reader.u64()?));
            let service = service(&reader.text()?)?;
            Event::Request { vehicle, token, request: Request::decode(service, reader.bytes()?).ok()? }
        }
        b'r' => {
            let (call, service) = (CallId(reader.u64()?), service(&reader.text()?)?);
            Event::Reply { call, result: Ok(Response::decode(service, reader.bytes()?).ok()?) }
        }
        b'e' => {
            let call = CallId(reader.u64()?);
            Event::Reply { call, result: Err(*CALL_ERRORS.get(usize::from(reader.byte()?))?) }
        }
        b'p' => Event::Peer {
            vehicle: reader.text()?.into(),
            service: reader.text()?,
            instance: reader.text()?,
            alive: reader.byte()? == 1,
        },
        _ => return None,
    })
}

fn service_of(response: &Response) -> Service {
    match response {
        Response::Skill(_) => Service::Skill,
        Response::SkillCancel(_) => Service::SkillCancel,
        Response::SkillTable(_) => Service::SkillTable,
        Response::Replan(_) => Service::Replan,
        Response::Edit(_) => Service::Edit,
        Response::OperatorCommand(_) => Service::OperatorCommand,
        Response::Mission(_) => Service::Mission,
        Response::Permission(_) => Service::Permission,
        Response::Decide(_) => Service::Decide,
        Response::AcceptLoss(_) => Service::AcceptLoss,
        Response::SiteReport(_) => Service::SiteReport,
        Response::Fault(_) => Service::Fault,
    }
}
