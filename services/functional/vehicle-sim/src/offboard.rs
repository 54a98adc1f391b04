//! The two streams that fly the vehicle offboard, and whether they are alive.
//!
//! Proof of life and setpoint arrive on two topics; only a pair that fits together counts.

use std::time::Duration;

use domain::fmu::{OffboardControl, Setpoint};
use domain::time::Time;

/// The newest of both streams.
#[derive(Debug, Clone)]
pub(crate) struct Offboard {
    loss: Duration,
    control: Option<(Time, OffboardControl)>,
    setpoint: Option<(Time, Setpoint)>,
    /// The last setpoint that fitted its control, and the time of the older half of the pair.
    followed: Option<(Time, Setpoint)>,
}

impl Offboard {
    /// Nothing has come yet; a pair older than `loss` counts as lost.
    pub(crate) fn new(loss: Duration) -> Offboard {
        Offboard { loss, control: None, setpoint: None, followed: None }
    }

    /// Nothing has come since a start of the autopilot.
    pub(crate) fn forget(&mut self) {
        (self.control, self.setpoint, self.followed) = (None, None, None);
    }

    /// Takes in a proof of life.
    pub(crate) fn proof_of_life(&mut self, control: OffboardControl, now: Time) {
        self.control = Some((now, control));
        self.pair(now);
    }

    /// Takes in a setpoint.
    pub(crate) fn setpoint(&mut self, setpoint: Setpoint, now: Time) {
        self.setpoint = Some((now, setpoint));
        self.pair(now);
    }

    /// The setpoint to follow: the last one that was part of a pair.
    pub(crate) fn followed(&self) -> Option<Setpoint> {
        self.followed.map(|(_, setpoint)| setpoint)
    }

    /// Whether both streams are alive.
    pub(crate) fn is_alive(&self, now: Time) -> bool {
        self.followed.is_some_and(|(at, _)| now - at <= self.loss)
    }

    /// A change of control arrives in two halves; the old setpoint is followed until both are there.
    fn pair(&mut self, now: Time) {
        let (Some((control_at, control)), Some((setpoint_at, setpoint))) = (self.control, self.setpoint) else {
            return;
        };
        let oldest = control_at.min(setpoint_at);
        if setpoint.control() == control && now - oldest <= self.loss {
            self.followed = Some((oldest, setpoint));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use OffboardControl::{Position, Velocity};
    use domain::geometry::{Ned, NedVelocity};

    fn at(ms: u64) -> Time {
        Time::after(Duration::from_millis(ms))
    }

    fn target(north_m: f64) -> Setpoint {
        Setpoint::Position { target: Ned::new(north_m, 0.0, -5.0), speed_limit_m_s: None, yaw_rad: None }
    }

    fn offboard() -> Offboard {
        Offboard::new(Duration::from_secs(1))
    }

    #[test]
    fn it_is_lost_a_second_after_the_older_half() {
        let mut offboard = offboard();
        offboard.setpoint(target(1.0), at(0));
        assert!(!offboard.is_alive(at(0)), "a setpoint alone");
        offboard.proof_of_life(Position, at(300));
        assert!(offboard.is_alive(at(1000)));
        assert!(!offboard.is_alive(at(1001)));
        offboard.proof_of_life(Position, at(1200));
        assert!(!offboard.is_alive(at(1200)), "the setpoint is too old");
        offboard.setpoint(target(1.0), at(1300));
        assert!(offboard.is_alive(at(2200)));
    }

    #[test]
    fn a_setpoint_of_another_control_is_no_pair() {
        let mut offboard = offboard();
        offboard.setpoint(target(1.0), at(0));
        offboard.proof_of_life(Velocity, at(0));
        assert!(!offboard.is_alive(at(0)));
        assert_eq!(offboard.followed(), None);
    }

    #[test]
    fn a_change_of_control_waits_for_its_other_half() {
        let mut offboard = offboard();
        offboard.setpoint(target(1.0), at(0));
        offboard.proof_of_life(Position, at(0));
        offboard.proof_of_life(Velocity, at(100));
        assert_eq!(offboard.followed(), Some(target(1.0)));
        let velocity = Setpoint::Velocity { velocity: NedVelocity::new(1.0, 0.0, 0.0), yaw_rate_rad_s: None };
        offboard.setpoint(velocity, at(100));
        assert_eq!(offboard.followed(), Some(velocity));
    }
}
