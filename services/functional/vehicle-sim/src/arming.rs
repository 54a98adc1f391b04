//! Whether the motors may turn, and when the autopilot disarms by itself: when it waits on the ground
//! for too long.

use std::time::Duration;

use domain::time::Time;

/// How far the vehicle is between arming and disarming.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ArmingState {
    Disarmed,
    /// Armed, has not flown yet.
    Preflight {
        since: Time,
    },
    Flying,
    /// Has flown.
    Landed {
        since: Time,
    },
}

/// The arming state, with the limits for waiting on the ground.
#[derive(Debug, Clone)]
pub(crate) struct Arming {
    state: ArmingState,
    preflight_limit: Duration,
    landed_limit: Duration,
}

impl Arming {
    /// Disarmed. The limits say how long an armed vehicle waits on the ground before a flight, and after it.
    pub(crate) fn new(preflight_limit: Duration, landed_limit: Duration) -> Arming {
        Arming { state: ArmingState::Disarmed, preflight_limit, landed_limit }
    }

    /// Whether the motors may turn.
    pub(crate) fn is_armed(&self) -> bool {
        self.state != ArmingState::Disarmed
    }

    /// Lets the motors turn.
    pub(crate) fn arm(&mut self, now: Time) {
        if self.state == ArmingState::Disarmed {
            self.state = ArmingState::Preflight { since: now };
        }
    }

    /// Stops the motors.
    pub(crate) fn disarm(&mut self) {
        self.state = ArmingState::Disarmed;
    }

    /// Takes in whether the vehicle has landed, and whether it is about to lift off. Returns whether
    /// it is time to disarm.
    pub(crate) fn on(&mut self, landed: bool, lifting_off: bool, now: Time) -> bool {
        use ArmingState as S;
        self.state = match (self.state, landed) {
            (S::Preflight { .. } | S::Landed { .. }, false) => S::Flying,
            (S::Flying, true) => S::Landed { since: now },
            (state, _) => state,
        };
        match self.state {
            S::Preflight { since } => !lifting_off && now - since >= self.preflight_limit,
            S::Landed { since } => !lifting_off && now - since >= self.landed_limit,
            S::Disarmed | S::Flying => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(s: u64) -> Time {
        Time::after(Duration::from_secs(s))
    }

    #[test]
    fn an_armed_vehicle_does_not_wait_on_the_ground_forever() {
        let mut arming = Arming::new(Duration::from_secs(10), Duration::from_secs(2));
        assert!(!arming.on(true, false, at(100)), "disarmed anyway");
        arming.arm(at(100));
        arming.arm(at(105));
        assert!(!arming.on(true, false, at(109)));
        assert!(arming.on(true, false, at(110)), "ten seconds after the first arming");
        assert!(!arming.on(true, true, at(110)), "about to lift off");
        assert!(!arming.on(false, false, at(111)));
        assert!(!arming.on(true, false, at(200)), "just landed");
        assert!(arming.on(true, false, at(202)));
        assert!(!arming.on(false, false, at(203)), "off again");
        arming.disarm();
        assert!(!arming.is_armed());
    }
}
