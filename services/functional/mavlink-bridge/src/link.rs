//! Where bytes come from and go to.

use domain::time::Time;

/// The way to the autopilot as the node sees it; it never waits.
pub trait Link: std::fmt::Debug {
    /// The next bytes that have arrived: a datagram, or a piece of a stream.
    fn receive(&mut self, now: Time) -> Option<Vec<u8>>;

    /// Sends a frame, or drops it if it cannot be sent at once.
    fn send(&mut self, frame: &[u8], now: Time);

    /// Whether each piece is a datagram: frames do not go on in the next one.
    fn is_datagram(&self) -> bool;

    /// Why something that has arrived was not believed, if anything was.
    fn refused(&self) -> Option<String> {
        None
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

    fn arrival(&self) -> Option<Time> {
        (**self).arrival()
    }
}
