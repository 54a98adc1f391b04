//! Whether the motors may turn, and when the autopilot stops them by itself: on the ground and
//! going nowhere.

use std::time::Duration;

use domain::time::Time;

/// Where an armed vehicle is on its way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
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

/// The state of the motors with the limits of waiting on the ground.
#[derive(Debug, Clone)]
pub struct Arming {
    state: State,
    preflight_limit: Duration,
    landed_limit: Duration,
}

impl Arming {
    /// Disarmed. Waits so long before a flight, and so long after it.
    pub fn new(preflight_limit: Duration, landed_limit: Duration) -> Arming {
        Arming { state: State::Disarmed, preflight_limit, landed_limit }
    }

    /// Whether the motors may turn.
    pub fn is_armed(&self) -> bool {
        self.state != State::Disarmed
    }

    /// Lets the motors turn.
    pub fn arm(&mut self, now: Time) {
        if self.state == State::Disarmed {
            self.state = State::Preflight { since: now };
        }
    }

    /// Stops the motors.
    pub fn disarm(&mut self) {
        self.state = State::Disarmed;
    }

    /// Takes in whether the vehicle has landed, and whether it is about to lift off; whether it is
    /// time to disarm.
    pub fn on(&mut self, landed: bool, lifting_off: bool, now: Time) -> bool {
        use State as S;
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
    fn it_does_not_wait_on_the_ground_for_ever() {
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
