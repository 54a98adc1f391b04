//! A ground station that watches: frames are forwarded between it and the autopilot, and it hears from Kittiwake.
//!
//! Frames go on as they came, byte by byte, signature and all, by the rules of MAVLink's routing guide: everything but what is for us,
//! and never back to where their sender is. Nothing that comes from the ground is believed by the bridge itself: an autopilot is one that
//! speaks on the autopilot's link. A ground station that selects a mode takes the vehicle, as any other pilot does.

use std::collections::BTreeSet;
use std::time::Duration;

use domain::time::Time;
use kittiwake_proto::v1::DecisionRecord;

use crate::frame::{Found, Frame};
use crate::intake::Intake;
use crate::link::{Link, Voice};
use crate::said::OUR_COMPONENT;
use crate::signing::{RADIO_STATUS, shows_a_speaker};

mod arrivals;
mod endpoint;
mod socket;
mod words;

pub use endpoint::GroundEndpoint;
pub use socket::GroundSocket;

/// Our own heartbeat, as MAVLink demands.
const HEARTBEAT_PERIOD: Duration = Duration::from_secs(1);
/// An onboard controller (18) that is not an autopilot (8) and is active (4).
const HEARTBEAT: [u8; 9] = [0, 0, 0, 0, 18, 8, 0, 4, 3];
/// Senders that are remembered; a network has some ten.
const MOST_SENDERS: usize = 256;

/// The ground station's side of the bridge.
#[derive(Debug)]
pub(crate) struct Ground {
    link: Box<dyn Link>,
    intake: Intake,
    /// Of our frames on this link.
    sequence: u8,
    next_heartbeat: Time,
    /// Distinguishes texts of several frames.
    text_id: u16,
    /// Who was heard on which side: system and component.
    on_ground: BTreeSet<(u8, u8)>,
    on_vehicle: BTreeSet<(u8, u8)>,
    /// Why frames were not believed, as far as it was told.
    told_refused: Vec<String>,
}

impl Ground {
    /// Over `link`; nobody was heard.
    pub(crate) fn new(link: Box<dyn Link>) -> Ground {
        Ground {
            link,
            intake: Intake::default(),
            sequence: 0,
            next_heartbeat: Time::ZERO,
            text_id: 0,
            on_ground: BTreeSet::new(),
            on_vehicle: BTreeSet::new(),
            told_refused: Vec::new(),
        }
    }

    /// A frame has arrived from the vehicle.
    pub(crate) fn forward_to_ground(&mut self, frame: &Frame, now: Time) {
        let sender = note(&mut self.on_vehicle, frame);
        let is_for_us = addressee(frame) == Some((frame.system(), OUR_COMPONENT));
        if !self.on_ground.contains(&sender) && !is_for_us {
            self.link.send(frame.bytes(), now);
        }
    }

    /// The frames that have arrived from the ground and go on to the vehicle, which is this system. A few at a time.
    pub(crate) fn take_from_ground(&mut self, system: Option<u8>, now: Time) -> Vec<Frame> {
        let mut onward = Vec::new();
        self.intake.begin_turn();
        while let Some(found) = self.intake.next(&mut self.link, now) {
            if !self.link.admit(voice_in(&found)) {
                continue;
            }
            for it in found {
                // One of MAVLink 1 goes no further: the bridge speaks MAVLink 2 alone.
                if let Found::Frame(frame) = it {
                    onward.extend(self.route(frame, system, now));
                }
            }
        }
        onward
    }

    fn route(&mut self, frame: Frame, system: Option<u8>, now: Time) -> Option<Frame> {
        // Who speaks on the vehicle's side, or as we do, is not a ground station: its own frame has come round.
        let sender = (frame.system(), frame.component());
        if self.on_vehicle.contains(&sender) || system.is_some_and(|it| sender == (it, OUR_COMPONENT)) {
            return None;
        }
        note(&mut self.on_ground, &frame);
        let us = system.map(|it| (it, OUR_COMPONENT));
        if us.is_none() || addressee(&frame) != us {
            return Some(frame);
        }
        if let (Some((system, _)), Some(command)) = (us, words::command_in(&frame)) {
            self.say(system, words::COMMAND_ACK, &words::not_supported(command, sender), now);
        }
        None
    }

    /// The mission manager has decided something.
    pub(crate) fn tell(&mut self, decision: &DecisionRecord, system: Option<u8>, now: Time) {
        let Some(system) = system else { return };
        self.text_id = self.text_id.checked_add(1).unwrap_or(1);
        for payload in words::status_texts(decision, self.text_id) {
            self.say(system, words::STATUSTEXT, &payload, now);
        }
    }

    /// Says that we are there, beside the autopilot of this system.
    pub(crate) fn act(&mut self, system: Option<u8>, now: Time) {
        if self.next_heartbeat <= now {
            self.next_heartbeat = now + HEARTBEAT_PERIOD;
            if let Some(system) = system {
                self.say(system, 0, &HEARTBEAT, now);
            }
        }
    }

    /// Why something that has arrived is not believed. Each reason is returned once: a stranger cannot fill the log.
    pub(crate) fn tell_refused(&mut self) -> Option<String> {
        let why = self.link.refused().filter(|it| !self.told_refused.contains(it))?;
        self.told_refused.push(why.clone());
        Some(format!("a ground station is not believed: {why}"))
    }

    /// When something is due.
    pub(crate) fn deadline(&self) -> Option<Time> {
        [self.link.arrival(), self.intake.deadline(), Some(self.next_heartbeat)].into_iter().flatten().min()
    }

    fn say(&mut self, system: u8, id: u32, payload: &[u8], now: Time) {
        self.sequence = self.sequence.wrapping_add(1);
        let frame = Frame::new(self.sequence, system, OUR_COMPONENT, id, payload);
        self.link.send(frame.bytes(), now);
    }
}

/// What is handed on by a link that is signed is believed there.
fn voice_in(found: &[Found]) -> Voice {
    let speaks = found.iter().any(|it| matches!(it, Found::Frame(frame) if shows_a_speaker(frame)));
    if speaks { Voice::Believed } else { Voice::Unknown }
}

fn note(senders: &mut BTreeSet<(u8, u8)>, frame: &Frame) -> (u8, u8) {
    let sender = (frame.system(), frame.component());
    // Without a signature anybody may say that one in a ground station's name, whose frames would then go no further.
    if senders.len() < MOST_SENDERS && frame.id() != RADIO_STATUS {
        senders.insert(sender);
    }
    sender
}

/// Whom a command, or the answer to one, is for; `None` for every other message, which is for many.
fn addressee(frame: &Frame) -> Option<(u8, u8)> {
    let byte = |at: usize| frame.payload().get(at).copied().unwrap_or(0);
    match frame.id() {
        words::COMMAND_INT | words::COMMAND_LONG => Some((byte(30), byte(31))),
        words::COMMAND_ACK => Some((byte(8), byte(9))),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
