//! Signatures of MAVLink 2: who does not know the key can neither command the autopilot nor speak for it.
//!
//! A signature is the first 48 bits of a SHA-256 over the key, the frame, the id of the link and a time that grows with each frame
//! (<https://mavlink.io/en/guide/message_signing.html>). It proves who speaks, and that nothing is said twice; it hides nothing.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use domain::time::Time;
use sha2::{Digest, Sha256};

use crate::frame::{Found, Frame, Framer};
use crate::link::{Link, Voice};

/// The key that both sides know.
#[derive(Clone, PartialEq, Eq)]
pub struct Key([u8; 32]);

impl FromStr for Key {
    type Err = String;
    fn from_str(text: &str) -> Result<Key, String> {
        let digits = text.trim().as_bytes();
        let expected = "expected 64 hexadecimal digits, such as `openssl rand -hex 32` prints";
        if digits.len() != 64 {
            return Err(format!("found {} characters, {expected}", digits.len()));
        }
        let mut key = [0; 32];
        for (byte, pair) in key.iter_mut().zip(digits.chunks(2)) {
            let digit =
                |it: u8| char::from(it).to_digit(16).ok_or_else(|| format!("found another character, {expected}"));
            *byte = (digit(pair[0])? * 16 + digit(pair[1])?) as u8;
        }
        Ok(Key(key))
    }
}

/// It is a secret.
impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Key")
    }
}

/// Why a frame is not believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refused {
    /// It has no signature.
    Unsigned,
    /// Its signature was made with another key, or it was changed.
    Wrong,
    /// It, or one after it, was heard before; or its sender is more than a minute behind.
    Old,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Refused::Unsigned => "without a signature: set the key of `signing_key` there, too",
            Refused::Wrong => "signed with another key than that of `signing_key`",
            Refused::Old => "with signatures of a time that has passed: they are repeated, or a clock is wrong",
        })
    }
}

/// Signs what is sent and checks what is heard.
#[derive(Debug)]
pub struct Signing {
    key: Key,
    link: u8,
    /// Of the newest frame that was sent or believed, in units of 10 us since 2015.
    newest: u64,
    /// The newest frame of each stream: link, system and component.
    heard: BTreeMap<(u8, u8, u8), u64>,
}

/// 2015-01-01, in Unix milliseconds: signatures count from then.
const EPOCH_MS: i64 = 1_420_070_400_000;
const UNITS_PER_MS: i64 = 100;
/// A stream that begins may be this much behind.
const MINUTE: u64 = 60_000 * UNITS_PER_MS as u64;
/// RADIO_STATUS is made by the radio, which has no key.
pub(crate) const RADIO_STATUS: u32 = 109;

/// Whether a frame shows that somebody speaks who may have a place: a whole message, and none that needs no signature.
pub(crate) fn shows_a_speaker(frame: &Frame) -> bool {
    frame.is_known() && frame.id() != RADIO_STATUS
}

impl Signing {
    /// With this key, as the sender of this link: each link of one component needs an id of its own.
    pub fn new(key: Key, link: u8) -> Signing {
        Signing { key, link, newest: 0, heard: BTreeMap::new() }
    }

    /// The same frame with a signature.
    pub fn sign(&mut self, frame: Frame, utc_ms: i64) -> Frame {
        // After a clock that was set back the time goes on from where it was.
        self.newest = units(utc_ms).max(self.newest + 1);
        let (key, time) = (&self.key.0, self.newest.to_le_bytes());
        let mut tail = [self.link, time[0], time[1], time[2], time[3], time[4], time[5]];
        frame.signed(|bytes| {
            let digest = digest(key, bytes, &mut tail);
            [&tail[..], &digest].concat()
        })
    }

    /// Whether a frame is to be believed.
    ///
    /// # Errors
    /// Why it is not.
    pub fn check(&mut self, frame: &Frame, utc_ms: i64) -> Result<(), Refused> {
        let Some((signed, signature)) = frame.signature() else {
            return if frame.id() == RADIO_STATUS { Ok(()) } else { Err(Refused::Unsigned) };
        };
        let (mut tail, digits) = (signature[..7].to_vec(), &signature[7..]);
        if digest(&self.key.0, signed, &mut tail) != digits {
            return Err(Refused::Wrong);
        }
        let time = tail[1..].iter().rev().fold(0, |time, byte| time << 8 | u64::from(*byte));
        let stream = (tail[0], frame.system(), frame.component());
        let is_new = match self.heard.get(&stream) {
            Some(before) => *before < time,
            None => units(utc_ms).max(self.newest) <= time + MINUTE,
        };
        if !is_new {
            return Err(Refused::Old);
        }
        self.heard.insert(stream, time);
        // Follow the clock that is ahead: one that was set back would be refused by the other side.
        self.newest = self.newest.max(time);
        Ok(())
    }
}

fn units(utc_ms: i64) -> u64 {
    u64::try_from((utc_ms - EPOCH_MS) * UNITS_PER_MS).unwrap_or(0)
}

fn digest(key: &[u8; 32], frame: &[u8], tail: &mut [u8]) -> [u8; 6] {
    let hash = Sha256::new().chain_update(key).chain_update(frame).chain_update(&*tail).finalize();
    std::array::from_fn(|it| hash[it])
}

/// A link on which everything is signed: what we send, and what is believed of what arrives. What goes on from elsewhere keeps its
/// signature.
pub struct SignedLink<L> {
    link: L,
    framer: Framer,
    signing: Signing,
    utc_ms: Box<dyn FnMut() -> i64>,
    refused: Option<Refused>,
    /// Bytes of the piece that was received last.
    not_believed: usize,
    /// In that piece somebody spoke who knows the key and is behind.
    is_late: bool,
}

impl<L: Link> SignedLink<L> {
    /// Over `link`, by the wall clock `utc_ms`.
    pub fn new(link: L, signing: Signing, utc_ms: impl FnMut() -> i64 + 'static) -> SignedLink<L> {
        SignedLink {
            link,
            framer: Framer::default(),
            signing,
            utc_ms: Box::new(utc_ms),
            refused: None,
            not_believed: 0,
            is_late: false,
        }
    }

    fn believed(&mut self, found: Found) -> Option<Frame> {
        // MAVLink 1 knows no signatures.
        let Found::Frame(frame) = found else {
            self.refused = Some(Refused::Unsigned);
            return None;
        };
        match self.signing.check(&frame, (self.utc_ms)()) {
            Ok(()) => Some(frame),
            Err(why) => {
                self.refused = Some(why);
                self.is_late |= why == Refused::Old && shows_a_speaker(&frame);
                None
            }
        }
    }
}

impl<L: Link> fmt::Debug for SignedLink<L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SignedLink").field("link", &self.link).field("refused", &self.refused).finish_non_exhaustive()
    }
}

impl<L: Link> Link for SignedLink<L> {
    /// One piece and no more: a stranger may send faster than his frames are checked.
    fn receive(&mut self, now: Time) -> Option<Vec<u8>> {
        let bytes = self.link.receive(now)?;
        self.is_late = false;
        let found = if self.link.is_datagram() { Framer::datagram(&bytes) } else { self.framer.push(&bytes) };
        let frames: Vec<Frame> = found.into_iter().filter_map(|it| self.believed(it)).collect();
        let believed: Vec<u8> = frames.iter().flat_map(|it| it.bytes()).copied().collect();
        self.not_believed = bytes.len().saturating_sub(believed.len());
        Some(believed)
    }

    fn send(&mut self, frame: &[u8], now: Time) {
        for found in Framer::datagram(frame) {
            let Found::Frame(frame) = found else { continue };
            let frame = if frame.is_signed() { frame } else { self.signing.sign(frame, (self.utc_ms)()) };
            self.link.send(frame.bytes(), now);
        }
    }

    /// What is handed on are whole frames.
    fn is_datagram(&self) -> bool {
        true
    }

    fn arrival(&self) -> Option<Time> {
        self.link.arrival()
    }

    fn refused(&self) -> Option<String> {
        self.refused.map(|it| format!("frames arrive {it}"))
    }

    fn not_believed(&self) -> usize {
        self.not_believed
    }

    fn admit(&mut self, voice: Voice) -> bool {
        // A late frame is not handed on: listeners behind this link cannot know that it is late.
        self.link.admit(if self.is_late { voice.max(Voice::Late) } else { voice })
    }
}

#[cfg(test)]
mod tests;
