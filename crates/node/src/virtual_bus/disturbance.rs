//! What happens to messages under way between nodes, besides waiting.

use std::time::Duration;

use domain::time::Time;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

use crate::Event;

/// How a bus disturbs what its nodes send each other. What is said from outside, and that a process appears or vanishes, always arrives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disturbance {
    /// Of every draw.
    pub seed: u64,
    /// Of messages, requests and replies the share that is lost, 0 to 1.
    pub lost: f64,
    /// Of messages and requests the share that is sent twice, 0 to 1; the second one comes later by up to `late`.
    pub twice: f64,
    /// Everything is under way for up to this long; a later message may overtake an earlier one of another class or another sender.
    pub late: Duration,
}

/// The disturbance at present.
#[derive(Default)]
pub(super) struct Disturbances(Option<Present>);

struct Present {
    disturbance: Disturbance,
    until: Time,
    dice: ChaCha8Rng,
}

impl Disturbances {
    pub(super) fn begin(&mut self, disturbance: Disturbance, until: Time) {
        let dice = ChaCha8Rng::seed_from_u64(disturbance.seed);
        self.0 = Some(Present { disturbance, until, dice });
    }

    /// Whether something that is sent once is lost.
    pub(super) fn loses(&mut self, now: Time) -> bool {
        self.present(now).is_some_and(Present::loses)
    }

    /// By how much the event is late, and its second copy, if they arrive at all.
    pub(super) fn copies(&mut self, now: Time, event: &Event) -> [Option<Duration>; 2] {
        let (false, Some(present)) = (matches!(event, Event::Peer { .. }), self.present(now)) else {
            return [Some(Duration::ZERO), None];
        };
        if present.loses() {
            return [None, None];
        }
        let comes_twice = present.is_below(present.disturbance.twice);
        [Some(present.late()), comes_twice.then(|| present.late())]
    }

    fn present(&mut self, now: Time) -> Option<&mut Present> {
        self.0.as_mut().filter(|it| now < it.until)
    }
}

impl Present {
    fn loses(&mut self) -> bool {
        self.is_below(self.disturbance.lost)
    }

    fn is_below(&mut self, share: f64) -> bool {
        self.draw() < share
    }

    fn late(&mut self) -> Duration {
        self.disturbance.late.mul_f64(self.draw())
    }

    /// 0 to 1.
    fn draw(&mut self) -> f64 {
        f64::from(self.dice.next_u32()) / f64::from(u32::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kittiwake_proto::v1;

    const END: Time = Time::after(Duration::from_secs(10));

    /// Of how many of a thousand messages how many copies arrive, the latest in milliseconds.
    fn counts(disturbance: Disturbance, now: Time) -> (usize, usize, u128) {
        let mut disturbances = Disturbances::default();
        disturbances.begin(disturbance, END);
        let flag = Event::Message { vehicle: "uav1".into(), message: v1::FlagEvent::default().into() };
        let sent: Vec<_> = (0..1000).map(|_| disturbances.copies(now, &flag)).collect();
        let latest = sent.iter().flatten().flatten().max().map_or(0, Duration::as_millis);
        (sent.iter().filter(|it| it[0].is_some()).count(), sent.iter().filter(|it| it[1].is_some()).count(), latest)
    }

    #[test]
    fn shares_are_kept_until_the_end() {
        let disturbance = Disturbance { seed: 1, lost: 0.2, twice: 0.5, late: Duration::from_millis(100) };
        let (once, twice, latest) = counts(disturbance, Time::ZERO);
        assert!((750..850).contains(&once) && (350..450).contains(&twice), "{once}, {twice}");
        assert!((90..=100).contains(&latest), "{latest}");
        assert_eq!(counts(disturbance, Time::ZERO), (once, twice, latest), "the same seed, the same draws");
        assert_eq!(counts(disturbance, END), (1000, 0, 0));
    }

    #[test]
    fn that_a_process_appears_is_never_lost() {
        let mut disturbances = Disturbances::default();
        disturbances.begin(Disturbance { seed: 1, lost: 1.0, twice: 1.0, late: Duration::from_secs(1) }, END);
        let peer = Event::Peer { vehicle: "uav1".into(), service: "mcm".into(), instance: "1".into(), alive: true };
        assert_eq!(disturbances.copies(Time::ZERO, &peer), [Some(Duration::ZERO), None]);
        assert!(disturbances.loses(Time::ZERO));
    }
}
