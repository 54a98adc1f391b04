//! From still motors to flight: spool-up, then a ramp of the upward speed (PX4's takeoff state
//! machine). No demand reaches the motors before the ramp.

use domain::time::Time;

use crate::config::Limits;
use crate::controller::least_thrust_m_s;

/// The stage of the lift-off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Liftoff {
    /// Disarmed.
    Off,
    /// Armed a moment ago.
    SpoolUp {
        /// When they were armed.
        since: Time,
    },
    /// On the ground, able to lift off.
    Ready,
    /// The thrust rises.
    Ramp {
        /// Since when.
        since: Time,
    },
    /// The ramp is over: only the controller limits the thrust.
    Flight,
}

/// What the next stage depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Signals {
    /// Whether the motors may turn.
    pub(crate) armed: bool,
    /// Whether the mode demands a climb.
    pub(crate) climb: bool,
    /// Whether the land detector reports the ground.
    pub(crate) landed: bool,
}

impl Liftoff {
    /// The stage after `signals` at `now`.
    pub(crate) fn on(self, signals: Signals, now: Time, limits: &Limits) -> Liftoff {
        use Liftoff as L;
        match (self, signals) {
            (_, Signals { armed: false, .. }) => L::Off,
            (L::Off, _) => L::SpoolUp { since: now },
            (L::SpoolUp { since }, _) if now - since >= limits.spool_up_s.seconds() => L::Ready,
            (L::Ready, Signals { landed: false, .. }) => L::Flight,
            (L::Ready, Signals { climb: true, .. }) => L::Ramp { since: now },
            (L::Ramp { .. }, Signals { climb: false, landed: true, .. }) => L::Ready,
            // Off the ground, and a climb is no longer demanded: the motors stay on.
            (L::Ramp { .. }, Signals { climb: false, landed: false, .. }) => L::Flight,
            (L::Ramp { since }, _) if now - since >= limits.takeoff_ramp_s.seconds() => L::Flight,
            (L::Flight, Signals { landed: true, .. }) => L::Ready,
            (state, _) => state,
        }
    }

    /// Whether demands reach the motors.
    pub(crate) fn lifts(self) -> bool {
        matches!(self, Liftoff::Ramp { .. } | Liftoff::Flight)
    }

    /// The highest upward speed allowed at `now`; below zero it means less thrust than hovering.
    pub(crate) fn climb_limit_m_s(self, now: Time, limits: &Limits) -> f64 {
        match self {
            Liftoff::Off | Liftoff::SpoolUp { .. } | Liftoff::Ready | Liftoff::Flight => f64::INFINITY,
            Liftoff::Ramp { since } => {
                let progress = (now - since).as_secs_f64() / limits.takeoff_ramp_s.get();
                let start = -least_thrust_m_s(limits);
                start + (limits.takeoff_m_s.get() - start) * progress.min(1.0)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::shipped;
    use std::time::Duration;

    #[test]
    fn every_state_meets_every_signal() {
        use Liftoff as L;
        let start = Time::ZERO;
        let (early, late) = (start + Duration::from_millis(500), start + Duration::from_secs(5));
        #[track_caller]
        fn check(state: Liftoff, armed: bool, climb: bool, landed: bool, now: Time, expected: Liftoff) {
            assert_eq!(state.on(Signals { armed, climb, landed }, now, &shipped::config().limits), expected);
        }
        for state in [L::Off, L::SpoolUp { since: start }, L::Ready, L::Ramp { since: start }, L::Flight] {
            for (climb, landed) in [(false, false), (false, true), (true, false), (true, true)] {
                check(state, false, climb, landed, late, L::Off);
                let expected = match (state, climb, landed) {
                    (L::Off, ..) => L::SpoolUp { since: late },
                    (L::SpoolUp { .. }, ..) => L::Ready,
                    (L::Ready, _, false) => L::Flight,
                    (L::Ready, true, true) => L::Ramp { since: late },
                    (L::Ready, false, true) => L::Ready,
                    (L::Ramp { .. }, false, true) => L::Ready,
                    (L::Ramp { .. }, ..) => L::Flight,
                    (L::Flight, _, true) => L::Ready,
                    (L::Flight, _, false) => L::Flight,
                };
                check(state, true, climb, landed, late, expected);
            }
        }
        check(L::SpoolUp { since: start }, true, true, true, early, L::SpoolUp { since: start });
        check(L::Ramp { since: start }, true, true, false, early, L::Ramp { since: start });
    }
}
