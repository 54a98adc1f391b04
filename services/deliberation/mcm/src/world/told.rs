//! What monitors have told and one that is started again in flight does not know.

use std::time::Duration;

use domain::time::{LONGEST_FLIGHT, Time};
use kittiwake_proto::v1;

/// Who was heard, and how long the vehicle flies.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Told {
    ground_link: bool,
    control_tower: bool,
    /// For how long it had flown, and when; `None` on the ground.
    flight: Option<(Time, Duration)>,
}

impl Told {
    /// What was told to a process before this one.
    pub(super) fn remembered(told: v1::ToldByMonitor) -> Told {
        let v1::ToldByMonitor { ground_link, control_tower, .. } = told;
        Told { ground_link, control_tower, flight: None }
    }

    pub(super) fn hear(&mut self, introspection: &v1::Introspection, now: Time) {
        let ages = introspection.ages.unwrap_or_default();
        let is_disarmed = introspection.status.as_ref().is_some_and(|it| !it.armed);
        if is_disarmed && introspection.derived.is_some_and(|it| !it.flying) {
            // The next flight misses nobody who was heard only before it.
            (self.ground_link, self.control_tower) = (false, false);
        }
        self.ground_link |= ages.ground_link_s.is_some();
        self.control_tower |= ages.control_tower_s.is_some();
        if let Some(derived) = introspection.derived {
            let told = Duration::try_from_secs_f64(derived.flight_s).ok().filter(|it| *it <= LONGEST_FLIGHT);
            // A monitor that restarted in flight may have begun to count again.
            self.flight = derived.flying.then(|| (now, told.unwrap_or_default().max(self.flight_time(now))));
        }
    }

    /// The same for monitors and for a process after this one.
    pub(super) fn to_wire(self, now: Time) -> v1::ToldByMonitor {
        let Told { ground_link, control_tower, .. } = self;
        v1::ToldByMonitor { ground_link, control_tower, flight_s: self.flight_time(now).as_secs_f64() }
    }

    fn flight_time(&self, now: Time) -> Duration {
        self.flight.map_or(Duration::ZERO, |(at, flown)| flown.saturating_add(now - at).min(LONGEST_FLIGHT))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_s(s: u64) -> Time {
        Time::after(Duration::from_secs(s))
    }

    #[test]
    fn what_monitors_have_told_is_kept_while_another_one_begins_anew() {
        let mut told = Told::default();
        let mut tell = |s: u64, flight_s: f64, flying: bool, ground_link_s: Option<f64>| {
            let ages = Some(v1::SourceAges { ground_link_s, ..Default::default() });
            let derived = Some(v1::Derived { flying, flight_s, ..Default::default() });
            told.hear(&v1::Introspection { ages, derived, ..Default::default() }, at_s(s));
            let v1::ToldByMonitor { ground_link, control_tower, flight_s } = told.to_wire(at_s(s));
            assert!(!control_tower, "it was never heard");
            (ground_link, flight_s)
        };
        assert_eq!(tell(0, 0.0, false, None), (false, 0.0));
        assert_eq!(tell(10, 7.0, true, Some(0.1)), (true, 7.0));
        assert_eq!(tell(20, 0.5, true, None), (true, 17.0));
        assert_eq!(tell(30, 10.5, true, None), (true, 27.0));
        // What makes no sense is not told.
        for (s, flight_s) in [(31, 1e19), (32, f64::NAN), (33, -1.0), (34, f64::INFINITY)] {
            assert_eq!(tell(s, flight_s, true, None), (true, s as f64 - 3.0));
        }
        assert_eq!(tell(40, 0.0, false, None), (true, 0.0));
        // The longest is published as it is: monitors refuse a longer one.
        let longest_s = LONGEST_FLIGHT.as_secs_f64();
        assert_eq!(tell(50, longest_s, true, None), (true, longest_s));
        assert_eq!(tell(60, 10.0, true, None), (true, longest_s));
    }

    #[test]
    fn a_flight_misses_nobody_who_was_heard_only_in_a_session_before() {
        /// Whether the ground counts as heard, by what a session before has told, after a current introspection.
        #[track_caller]
        fn check(armed: Option<bool>, flying: Option<bool>, ground_link_s: Option<f64>, expected: bool) {
            let before = v1::ToldByMonitor { ground_link: true, control_tower: true, flight_s: 0.0 };
            let mut told = Told::remembered(before);
            let introspection = v1::Introspection {
                status: armed.map(|armed| v1::VehicleStatus { armed, ..Default::default() }),
                derived: flying.map(|flying| v1::Derived { flying, ..Default::default() }),
                ages: Some(v1::SourceAges { ground_link_s, control_tower_s: ground_link_s, ..Default::default() }),
                ..Default::default()
            };
            told.hear(&introspection, at_s(0));
            let v1::ToldByMonitor { ground_link, control_tower, .. } = told.to_wire(at_s(0));
            assert_eq!((ground_link, control_tower), (expected, expected));
        }
        check(Some(false), Some(false), None, false);
        check(Some(false), Some(false), Some(0.1), true);
        // A manager that is started again in flight, and what is not known to stand.
        check(Some(true), Some(true), None, true);
        check(Some(true), Some(false), None, true);
        check(Some(false), Some(true), None, true);
        check(None, Some(false), None, true);
        check(Some(false), None, None, true);
    }
}
