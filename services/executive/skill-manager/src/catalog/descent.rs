//! Whether a landing comes down.
//!
//! How high the ground is below the vehicle is not known: a place to land at may be a deck, or lower than the take-off
//! point. So a landing has no time for its whole way. It must come down by a little within a while, again and again.

use std::time::Duration;

use domain::time::{Pace, Time};

use crate::config::Config;

/// Watches the height of a landing.
#[derive(Debug)]
pub(super) struct Descent {
    least_m: f64,
    stall: Duration,
    blind: Duration,
    seen: Option<Seen>,
}

#[derive(Debug, Clone, Copy)]
struct Seen {
    since: Time,
    /// `None` while the height is not known.
    height_m: Option<f64>,
}

impl Descent {
    /// Not begun yet; `on_target`: the autopilot may approach that first.
    pub(super) fn new(config: &Config, pace: Pace, on_target: bool) -> Descent {
        let stall_s = if on_target { config.landing_on_target_stall_s } else { config.landing_stall_s };
        Descent {
            least_m: config.landing_least_descent_m.get(),
            stall: pace.limit(stall_s.seconds()),
            blind: pace.limit(config.landing_blind_s.seconds()),
            seen: None,
        }
    }

    /// It begins.
    pub(super) fn begin(&mut self, now: Time) {
        self.seen = Some(Seen { since: now, height_m: None });
    }

    /// The vehicle is at this height, if that is known. Returns whether it has ceased to come down.
    pub(super) fn has_stalled(&mut self, now: Time, height_m: Option<f64>) -> bool {
        let Some(seen) = self.seen else { return false };
        let is_news = match (seen.height_m, height_m) {
            (Some(lowest_m), Some(height_m)) => height_m <= lowest_m - self.least_m,
            (lowest, height) => lowest.is_some() != height.is_some(),
        };
        if is_news {
            self.seen = Some(Seen { since: now, height_m });
        }
        self.deadline().is_some_and(|it| it <= now)
    }

    /// When it must have come down by a little more.
    pub(super) fn deadline(&self) -> Option<Time> {
        self.seen.map(|it| it.since + if it.height_m.is_some() { self.stall } else { self.blind })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The heights at each second from 0; the second at which the landing counts as stalled.
    #[track_caller]
    fn check(heights: &[Option<f64>], expected_s: Option<u64>) {
        let (stall, blind) = (Duration::from_secs(10), Duration::from_secs(30));
        let mut descent = Descent { least_m: 0.5, stall, blind, seen: None };
        descent.begin(Time::ZERO);
        let last = heights.last().copied().flatten();
        let heights = heights.iter().copied().chain(std::iter::repeat_n(last, 40));
        let at = |s| Time::after(Duration::from_secs(s));
        let stalled = (0..).zip(heights).find(|(s, height_m)| descent.has_stalled(at(*s), *height_m));
        assert_eq!(stalled.map(|(s, _)| s), expected_s);
    }

    #[test]
    fn it_counts_from_the_last_half_metre() {
        check(&[Some(3.0)], Some(10));
        check(&[Some(3.0), Some(2.6), Some(2.4), Some(2.3)], Some(12));
        check(&[Some(-40.0), Some(-41.0)], Some(11));
        let slowly = |s| Some(100.0 - 0.06 * f64::from(s));
        check(&(0..400).map(slowly).collect::<Vec<_>>(), Some(406));
        check(&[Some(3.0), Some(5.0)], Some(10));
    }

    #[test]
    fn without_a_height_it_has_longer() {
        check(&[None], Some(30));
        check(&[Some(3.0), Some(2.0), None], Some(32));
        check(&[Some(3.0), None, Some(3.0)], Some(12));
    }
}
