//! How long a straight leg takes: the one answer for plans, forecasts, the lengths of grants, and ways without a plan.

use std::time::Duration;

use crate::geometry::Ned;

/// How fast a vehicle flies, in metres per second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Speeds {
    /// Along its way.
    pub cruise_m_s: f64,
    /// Upwards.
    pub climb_m_s: f64,
    /// Downwards.
    pub descent_m_s: f64,
}

impl Speeds {
    /// The flight time of the straight leg from `from` to `to`, in seconds: that of its length at cruise speed, or that of its
    /// climb or descent if this takes longer.
    pub fn time_s(&self, from: Ned, to: Ned) -> f64 {
        let climb_m = to.height_m() - from.height_m();
        let vertical_s = if 0.0 < climb_m { climb_m / self.climb_m_s } else { -climb_m / self.descent_m_s };
        vertical_s.max(from.distance_m(to) / self.cruise_m_s)
    }

    /// The same as a duration; the longest one if it does not fit.
    pub fn time(&self, from: Ned, to: Ned) -> Duration {
        Duration::try_from_secs_f64(self.time_s(from, to)).unwrap_or(Duration::MAX)
    }

    /// The time that it takes to fly these points, in seconds.
    pub fn time_along_s(&self, from: Ned, way: &[Ned]) -> f64 {
        let starts = std::iter::once(&from).chain(way);
        starts.zip(way).map(|(from, to)| self.time_s(*from, *to)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leg_takes_as_long_as_its_way_or_its_climb() {
        #[track_caller]
        fn check(to: Ned, expected_s: f64) {
            let speeds = Speeds { cruise_m_s: 10.0, climb_m_s: 3.0, descent_m_s: 1.5 };
            assert_eq!(speeds.time_s(Ned::new(0.0, 0.0, -10.0), to), expected_s, "to {to}");
        }
        check(Ned::new(0.0, 500.0, -10.0), 50.0);
        check(Ned::new(0.0, 0.0, -40.0), 10.0);
        check(Ned::new(0.0, 0.0, -4.0), 4.0);
        check(Ned::new(0.0, 40.0, -40.0), 10.0);
        check(Ned::new(0.0, 400.0, -310.0), 100.0);
    }
}
