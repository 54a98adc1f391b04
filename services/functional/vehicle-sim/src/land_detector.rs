//! Whether the vehicle stands on the ground, detected in stages as PX4 does: contact, maybe landed,
//! landed. Each stage must last before the next one begins, so that a bounce is not a landing.

use std::time::Duration;

use domain::time::Time;

use crate::multirotor::GRAVITY_M_S2;

/// How long each stage must last; the sum is what was measured on PX4.
const UNTIL_CONTACT: Duration = Duration::from_millis(350);
const UNTIL_MAYBE_LANDED: Duration = Duration::from_millis(350);
const UNTIL_LANDED: Duration = Duration::from_millis(340);
/// A thrust below this share of the weight means that something else carries the vehicle.
const LOW_THRUST: f64 = 0.9;

/// The stage of the detection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LandDetector {
    /// In the air.
    Airborne,
    /// Something carries the vehicle.
    Touching {
        /// Since when.
        since: Time,
    },
    /// It is the ground.
    GroundContact {
        /// Since when.
        since: Time,
    },
    /// It stays there.
    MaybeLanded {
        /// Since when.
        since: Time,
    },
    /// Landed.
    Landed,
}

impl LandDetector {
    /// The stage after `now`, from whether the vehicle rests on something and the force of its motors
    /// per mass.
    pub(crate) fn on(self, resting: bool, thrust_m_s2: f64, now: Time) -> LandDetector {
        use LandDetector as L;
        if !resting {
            return L::Airborne;
        }
        let low = thrust_m_s2 < LOW_THRUST * GRAVITY_M_S2;
        match self {
            L::Airborne if low => L::Touching { since: now },
            L::Airborne => L::Airborne,
            L::Touching { .. } | L::GroundContact { .. } | L::MaybeLanded { .. } if !low => L::Airborne,
            L::Touching { since } if now - since >= UNTIL_CONTACT => L::GroundContact { since: now },
            L::GroundContact { since } if now - since >= UNTIL_MAYBE_LANDED => L::MaybeLanded { since: now },
            L::MaybeLanded { since } if now - since >= UNTIL_LANDED => L::Landed,
            // More thrust alone does not end a landing: that takes a lift-off.
            state => state,
        }
    }

    /// Whether the vehicle has landed.
    pub(crate) fn landed(self) -> bool {
        self == LandDetector::Landed
    }

    /// Whether the vehicle certainly touches the ground.
    pub(crate) fn ground_contact(self) -> bool {
        use LandDetector as L;
        matches!(self, L::GroundContact { .. } | L::MaybeLanded { .. } | L::Landed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_landing_passes_all_stages_and_a_bounce_none() {
        let mut state = LandDetector::Airborne;
        let mut seen = Vec::new();
        for ms in 0..3000 {
            let now = Time::after(Duration::from_millis(ms));
            // It bounces once, at 0.3 s.
            let before = (state.ground_contact(), state.landed());
            state = state.on(ms != 300, 5.0, now);
            if (state.ground_contact(), state.landed()) != before {
                seen.push((ms, state.ground_contact(), state.landed()));
            }
        }
        assert_eq!(seen, [(651, true, false), (1341, true, true)]);
        assert_eq!(state.on(true, 20.0, Time::ZERO), LandDetector::Landed);
        assert_eq!(state.on(false, 20.0, Time::ZERO), LandDetector::Airborne);
    }
}
