//! Where bytes come from and go to.

use domain::time::Time;

/// A longer datagram is dropped where it arrives. MAVLink puts frames of at most 280 bytes together up to what a packet of the network
/// holds: 1500 bytes, or 9000 of a large one.
pub(crate) const LONGEST_DATAGRAM: usize = 9_000;

/// What a datagram shows of its sender: the most that one of its frames shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Voice {
    /// Nothing: noise, or what needs no signature.
    Unknown,
    /// The key, by a signature whose time has passed: it is behind, or repeats what somebody else has said.
    Late,
    /// Something that is believed.
    Believed,
}

/// The way to the autopilot as the node sees it; it never waits.
pub trait Link: std::fmt::Debug {
    /// The next bytes that have arrived: a datagram, or a piece of a stream. Empty if nothing in it is believed: it has
    /// been looked at all the same, and there may be more.
    fn receive(&mut self, now: Time) -> Option<Vec<u8>>;

    /// Sends a frame, or drops it if it cannot be sent at once.
    fn send(&mut self, frame: &[u8], now: Time);

    /// Whether each piece is a datagram: frames do not go on in the next one.
    fn is_datagram(&self) -> bool;

    /// Why something that has arrived was not believed, if anything was.
    fn refused(&self) -> Option<String> {
        None
    }

    /// How many bytes of what was received last were not believed and so not handed on: looking at them took its time, too.
    fn not_believed(&self) -> usize {
        0
    }

    /// Whether the sender of what was received last is listened to; `voice` is what was found in that. Where many can send, only a few are
    /// listened to and sent to, and those are chosen by this.
    fn admit(&mut self, voice: Voice) -> bool {
        let _ = voice;
        true
    }

    /// When something arrives, if that is known: only on a simulated link.
    fn arrival(&self) -> Option<Time> {
        None
    }
}

impl Link for Box<dyn Link> {
    fn receive(&mut self, now: Time) -> Option<Vec<u8>> {
        (**self).receive(now)
    }

    fn send(&mut self, frame: &[u8], now: Time) {
        (**self).send(frame, now);
    }

    fn is_datagram(&self) -> bool {
        (**self).is_datagram()
    }

    fn refused(&self) -> Option<String> {
        (**self).refused()
    }

    fn not_believed(&self) -> usize {
        (**self).not_believed()
    }

    fn admit(&mut self, voice: Voice) -> bool {
        (**self).admit(voice)
    }

    fn arrival(&self) -> Option<Time> {
        (**self).arrival()
    }
}
