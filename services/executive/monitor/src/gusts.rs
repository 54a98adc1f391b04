//! Gusts: the strongest wind of the last minute, each averaged over three estimates.
//!
//! Weather services tell a gust as the greatest mean over 3 s within a period (WMO No. 8, Guide to Instruments and Methods of
//! Observation, part I, chapter 5). An autopilot that averages its estimates itself shows weaker gusts than there are: a limit
//! has to allow for that.

use std::time::Duration;

use domain::fmu::Wind;
use domain::time::{Pace, Time};

use crate::recent::Greatest;

/// A gust counts for this wall time, and no longer than twice that.
const COUNTS_FOR: Duration = Duration::from_secs(60);
/// Estimates that are averaged: three at 1 Hz are three seconds.
const AVERAGED: usize = 3;

/// The recent wind.
#[derive(Debug, Clone)]
pub(crate) struct Gusts {
    last: [Option<Wind>; AVERAGED],
    greatest: Greatest,
}

impl Gusts {
    /// Nothing was estimated yet.
    pub(crate) fn new(pace: Pace) -> Gusts {
        Gusts { last: [None; AVERAGED], greatest: Greatest::within(pace.wall(COUNTS_FOR)) }
    }

    /// The wind was estimated.
    pub(crate) fn feel(&mut self, now: Time, wind: Wind) {
        self.last.rotate_right(1);
        self.last[0] = Some(wind);
        let known: Vec<Wind> = self.last.into_iter().flatten().collect();
        let count = known.len() as f64;
        let north_m_s = known.iter().map(|it| it.north_m_s).sum::<f64>() / count;
        let east_m_s = known.iter().map(|it| it.east_m_s).sum::<f64>() / count;
        self.greatest.see(now, north_m_s.hypot(east_m_s));
    }

    /// The strongest recent wind, in metres per second.
    pub(crate) fn speed_m_s(&self, now: Time) -> f64 {
        self.greatest.at(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gust_of_three_seconds_counts_for_a_minute_and_one_of_a_second_counts_by_its_third() {
        let at = |s: u32| Time::after(Duration::from_secs(1) * s);
        let blowing = |east_m_s| Wind { north_m_s: 0.0, east_m_s };
        let mut gusts = Gusts::new(Pace::REAL_TIME);
        for (s, east_m_s) in [3.0, 3.0, 3.0, 9.0, 3.0, 3.0].into_iter().enumerate() {
            gusts.feel(at(s as u32), blowing(east_m_s));
        }
        assert_eq!(gusts.speed_m_s(at(6)), 5.0);
        for s in 6..9 {
            gusts.feel(at(s), blowing(12.0));
        }
        assert_eq!((gusts.speed_m_s(at(9)), gusts.speed_m_s(at(68))), (12.0, 12.0));
        assert_eq!(gusts.speed_m_s(at(130)), 0.0);
    }
}
