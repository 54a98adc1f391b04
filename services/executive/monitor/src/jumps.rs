//! Jumps of the position: a sample that is not where the one before it, its velocity and what a vehicle can turn or brake lead.
//!
//! A receiver that is deceived, or an estimator that resets, moves the vehicle in one sample; what flies by that position steers away
//! from a place where it is not.

use std::time::Duration;

use domain::fmu::LocalPosition;
use domain::geometry::Ned;
use domain::time::{Pace, Time};

use crate::recent::Greatest;

/// A jump counts for this wall time, and no longer than twice that.
const COUNTS_FOR: Duration = Duration::from_secs(10);
/// A sample that comes later than this wall time after the one before it is not compared with it.
const COMPARABLE: Duration = Duration::from_millis(500);
/// No vehicle accelerates more, in m/s2: a multirotor that is tilted by 45 degrees does by 1 g. (ENG)
const MOST_M_S2: f64 = 10.0;

/// The last position, and the recent jumps.
#[derive(Debug, Clone)]
pub(crate) struct Jumps {
    last: Option<(Time, LocalPosition)>,
    greatest: Greatest,
    pace: Pace,
}

impl Jumps {
    /// No position was seen yet.
    pub(crate) fn new(pace: Pace) -> Jumps {
        Jumps { last: None, greatest: Greatest::within(pace.wall(COUNTS_FOR)), pace }
    }

    /// A position was measured. One that the estimator does not vouch for is compared with nothing.
    pub(crate) fn measure(&mut self, now: Time, position: &LocalPosition) {
        if !(position.horizontal_valid && position.vertical_valid) {
            self.last = None;
            return;
        }
        if let Some((at, last)) = self.last.replace((now, *position))
            && now - at <= self.pace.wall(COMPARABLE)
        {
            // By the vehicle's own clock where it runs: samples may arrive together.
            let measured = position.timestamp_us.checked_sub(last.timestamp_us).filter(|it| 0 < *it);
            let passed_s = measured.map_or((now - at).as_secs_f64(), |us| us as f64 / 1e6);
            let led = Ned::new(
                last.position.north_m + last.velocity.north_m_s * passed_s,
                last.position.east_m + last.velocity.east_m_s * passed_s,
                last.position.down_m + last.velocity.down_m_s * passed_s,
            );
            let turned_m = 0.5 * MOST_M_S2 * passed_s.powi(2);
            self.greatest.see(now, (led.distance_m(position.position) - turned_m).max(0.0));
        }
    }

    /// The greatest recent jump, in metres.
    pub(crate) fn greatest_m(&self, now: Time) -> f64 {
        self.greatest.at(now)
    }
}

#[cfg(test)]
mod tests {
    use domain::geometry::NedVelocity;

    use super::*;

    fn position(flown_m: f64, velocity_m_s: f64, vouches: bool, now: Time) -> LocalPosition {
        LocalPosition {
            position: Ned::new(flown_m, 0.0, -10.0),
            velocity: NedVelocity::new(velocity_m_s, 0.0, 0.0),
            heading_rad: 0.0,
            horizontal_valid: vouches,
            vertical_valid: true,
            eph_m: 0.4,
            epv_m: 0.6,
            timestamp_us: now.since_start().as_micros() as u64,
        }
    }

    /// Plays positions ten milliseconds apart, flown north at 10 m/s but for `jump_m` at once after a second, and returns the greatest
    /// jump two seconds after the start.
    fn greatest_m(jump_m: f64, vouches: bool) -> f64 {
        let mut jumps = Jumps::new(Pace::REAL_TIME);
        for step in 0..200_u32 {
            let now = Time::after(Duration::from_millis(10) * step);
            let flown_m = 0.1 * f64::from(step) + if 100 <= step { jump_m } else { 0.0 };
            let position = position(flown_m, 10.0, vouches || step != 100, now);
            jumps.measure(now, &position);
        }
        jumps.greatest_m(Time::after(Duration::from_secs(2)))
    }

    #[test]
    fn a_jump_is_what_the_velocity_does_not_explain() {
        assert!(greatest_m(0.0, true) < 1e-6);
        assert!((greatest_m(15.0, true) - 15.0).abs() < 1e-3);
        // The estimator has said so itself.
        assert!(greatest_m(15.0, false) < 1e-6);
    }

    #[test]
    fn who_brakes_while_nothing_is_heard_has_not_jumped() {
        // At ten times real time 0.4 s without a sample are 4 s of flight, in which it came to rest from 10 m/s.
        let mut jumps = Jumps::new(Pace::new(10.0).unwrap());
        let [before, after] = [1, 5].map(|it| Time::after(Duration::from_secs(it)));
        jumps.measure(before, &position(10.0, 10.0, true, before));
        jumps.measure(after, &position(20.0, 0.0, true, after));
        assert!(jumps.greatest_m(after) < 1e-6);
        let at_once = Time::after(Duration::from_millis(5010));
        jumps.measure(at_once, &position(120.0, 0.0, true, at_once));
        assert!((jumps.greatest_m(at_once) - 100.0).abs() < 1e-2);
    }
}
