//! What carries the bridge's keys to PX4 and PX4's to it: Zenoh in flight, memory in tests.

use domain::time::Time;

/// The far side, as the bridge sees it. It never blocks.
pub trait Port {
    /// What has arrived since the last time, in its order.
    fn take(&mut self, now: Time) -> Vec<Arrival>;

    /// Sends `payload` with `key`. What nobody listens to is lost.
    fn put(&mut self, now: Time, key: &str, payload: Vec<u8>);

    /// When something arrives that wakes nobody; `None` where an arrival wakes the loop.
    fn deadline(&self) -> Option<Time> {
        None
    }
}

/// Something that arrived.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Arrival {
    /// A sample.
    Sample {
        /// The whole key.
        key: String,
        /// Its bytes.
        payload: Vec<u8>,
    },
    /// A liveliness token appeared or vanished.
    Token {
        /// The whole key.
        key: String,
        /// Whether it is there.
        alive: bool,
    },
}
