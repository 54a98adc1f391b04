//! Which frames were overtaken by newer ones on their way.
//!
//! An old mode that arrives after the new one would look like somebody else's doing, and stay it for as long as nothing newer arrives.
//! MAVLink counts frames, modulo 256, for each link and sender.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::time::Time;

/// The newest frame of each message of one sender. Those of different messages may overtake each other: they say different things.
#[derive(Debug, Default)]
pub(crate) struct Order(BTreeMap<u32, (Time, u8)>);

/// Farther behind than this, the count has begun again: 0.25 s of all that is asked for.
const OVERTAKEN: u8 = 64;
/// A frame is not later than this. A sender that was started again is believed from then on, whatever its count.
const LATEST: Duration = Duration::from_millis(300);

impl Order {
    /// Takes in the number of a frame with message `id`; whether a newer one has arrived before it.
    pub(crate) fn is_overtaken(&mut self, id: u32, sequence: u8, now: Time) -> bool {
        let newest = self.0.get(&id).filter(|(at, _)| now - *at <= LATEST);
        let behind = newest.map(|(_, newest)| newest.wrapping_sub(sequence));
        let is_overtaken = behind.is_some_and(|it| 0 < it && it < OVERTAKEN);
        if !is_overtaken {
            // As many messages as the bridge listens to.
            self.0.insert(id, (now, sequence));
        }
        is_overtaken
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_newer_frames_have_overtaken_is_old() {
        #[track_caller]
        fn check(before: u8, sequence: u8, after_ms: u64, expected: bool) {
            let mut order = Order::default();
            assert!(!order.is_overtaken(32, before, Time::ZERO));
            assert_eq!(order.is_overtaken(32, sequence, Time::after(Duration::from_millis(after_ms))), expected);
        }
        check(7, 8, 1, false);
        check(7, 7, 1, false);
        check(7, 5, 1, true);
        check(3, 250, 1, true);
        check(250, 3, 1, false);
        // After losses, and when the sender was started again.
        check(7, 150, 1, false);
        check(40, 0, 1, true);
        check(40, 0, 301, false);
    }

    #[test]
    fn a_message_is_not_overtaken_by_another_one() {
        let mut order = Order::default();
        assert!(!order.is_overtaken(32, 9, Time::ZERO));
        assert!(!order.is_overtaken(33, 8, Time::ZERO));
    }
}
