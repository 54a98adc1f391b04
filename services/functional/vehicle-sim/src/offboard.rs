//! What comes in from whoever flies the vehicle offboard, and whether it still comes.
//!
//! Proof of life and setpoint arrive on two topics; only a pair that fits together counts. What
//! makes no sense is ignored, so a stream of nonsense is no proof of life.

use std::time::Duration;

use domain::geometry::{Ned, NedVelocity};
use domain::time::Time;
use domain::wire::{Senseless, finite, positive};
use kittiwake_proto::v1;

/// What offboard control asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Demand {
    /// Fly straight to a position.
    Position {
        /// Where.
        target: Ned,
        /// No faster than this.
        speed_limit_m_s: f64,
        /// Where the nose shall point; `None`: as it does.
        yaw_rad: Option<f64>,
    },
    /// Fly at a velocity.
    Velocity {
        /// How.
        velocity: NedVelocity,
        /// How fast to turn.
        yaw_rate_rad_s: f64,
    },
}

/// A checked setpoint: its numbers are numbers.
#[derive(Debug, Clone, Copy)]
struct Setpoint {
    position: Option<Ned>,
    velocity: Option<NedVelocity>,
    speed_limit_m_s: Option<f64>,
    yaw_rad: Option<f64>,
    yaw_rate_rad_s: Option<f64>,
}

impl TryFrom<v1::TrajectorySetpoint> for Setpoint {
    type Error = Senseless;
    fn try_from(it: v1::TrajectorySetpoint) -> Result<Setpoint, Senseless> {
        Ok(Setpoint {
            position: it.position.map(Ned::try_from).transpose()?,
            velocity: it.velocity.map(NedVelocity::try_from).transpose()?,
            speed_limit_m_s: it.speed_limit_m_s.map(|it| positive("speed_limit_m_s", it)).transpose()?,
            yaw_rad: it.yaw_rad.map(|it| finite("yaw_rad", it)).transpose()?,
            yaw_rate_rad_s: it.yaw_rate_rad_s.map(|it| finite("yaw_rate_rad_s", it)).transpose()?,
        })
    }
}

impl Setpoint {
    fn demand(self, control: v1::OffboardControl) -> Option<Demand> {
        match control {
            v1::OffboardControl::Unspecified => None,
            v1::OffboardControl::Position => self.position.map(|target| Demand::Position {
                target,
                speed_limit_m_s: self.speed_limit_m_s.unwrap_or(f64::INFINITY),
                yaw_rad: self.yaw_rad,
            }),
            v1::OffboardControl::Velocity => self
                .velocity
                .map(|velocity| Demand::Velocity { velocity, yaw_rate_rad_s: self.yaw_rate_rad_s.unwrap_or(0.0) }),
        }
    }
}

/// The two streams, as far as they have come.
#[derive(Debug, Clone)]
pub struct Offboard {
    loss: Duration,
    control: Option<(Time, v1::OffboardControl)>,
    setpoint: Option<(Time, Setpoint)>,
    /// The last pair that fitted together, and the time of its older half.
    demand: Option<(Time, Demand)>,
}

impl Offboard {
    /// Nothing has come yet; a pair older than `loss` counts as lost.
    pub fn new(loss: Duration) -> Offboard {
        Offboard { loss, control: None, setpoint: None, demand: None }
    }

    /// Takes in a proof of life.
    pub fn proof_of_life(&mut self, it: v1::OffboardControlMode, now: Time) {
        if it.control() != v1::OffboardControl::Unspecified {
            self.control = Some((now, it.control()));
            self.pair(now);
        }
    }

    /// Takes in a setpoint; drops one that makes no sense.
    pub fn setpoint(&mut self, it: v1::TrajectorySetpoint, now: Time) {
        if let Ok(setpoint) = Setpoint::try_from(it) {
            self.setpoint = Some((now, setpoint));
            self.pair(now);
        }
    }

    /// What was asked for last.
    pub fn demand(&self) -> Option<Demand> {
        self.demand.map(|(_, demand)| demand)
    }

    /// Whether the streams are alive.
    pub fn is_alive(&self, now: Time) -> bool {
        self.demand.is_some_and(|(at, _)| now - at <= self.loss)
    }

    /// A change of control arrives in two halves, the old demand holds until both are there.
    fn pair(&mut self, now: Time) {
        let (Some((said, control)), Some((set, setpoint))) = (self.control, self.setpoint) else { return };
        let oldest = said.min(set);
        if let Some(demand) = setpoint.demand(control)
            && now - oldest <= self.loss
        {
            self.demand = Some((oldest, demand));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v1::OffboardControl::{Position, Unspecified, Velocity};

    fn at(ms: u64) -> Time {
        Time::after(Duration::from_millis(ms))
    }

    fn control(it: v1::OffboardControl) -> v1::OffboardControlMode {
        v1::OffboardControlMode { control: it as i32 }
    }

    fn target(north_m: f64) -> v1::TrajectorySetpoint {
        v1::TrajectorySetpoint { position: Some(Ned::new(north_m, 0.0, -5.0).into()), ..Default::default() }
    }

    fn offboard() -> Offboard {
        Offboard::new(Duration::from_secs(1))
    }

    #[test]
    fn it_is_lost_a_second_after_the_older_half() {
        let mut offboard = offboard();
        offboard.setpoint(target(1.0), at(0));
        assert!(!offboard.is_alive(at(0)), "a setpoint alone");
        offboard.proof_of_life(control(Position), at(300));
        assert!(offboard.is_alive(at(1000)));
        assert!(!offboard.is_alive(at(1001)));
        offboard.proof_of_life(control(Position), at(1200));
        assert!(!offboard.is_alive(at(1200)), "the setpoint is too old");
        offboard.setpoint(target(1.0), at(1300));
        assert!(offboard.is_alive(at(2200)));
    }

    #[test]
    fn nonsense_is_no_proof_of_life() {
        #[track_caller]
        fn check(spoil: impl Fn(&mut v1::TrajectorySetpoint)) {
            let mut offboard = offboard();
            let mut bad = target(1.0);
            spoil(&mut bad);
            offboard.proof_of_life(control(Position), at(0));
            offboard.setpoint(bad, at(0));
            assert!(!offboard.is_alive(at(0)), "{bad:?}");
        }
        check(|it| it.position = None);
        check(|it| it.position = Some(v1::Ned { north_m: f64::NAN, ..Default::default() }));
        check(|it| it.velocity = Some(v1::NedVelocity { down_m_s: f64::INFINITY, ..Default::default() }));
        check(|it| it.speed_limit_m_s = Some(0.0));
        check(|it| it.speed_limit_m_s = Some(f64::NAN));
        check(|it| it.yaw_rad = Some(f64::NAN));
        check(|it| it.yaw_rate_rad_s = Some(f64::NEG_INFINITY));

        let mut offboard = offboard();
        offboard.setpoint(target(1.0), at(0));
        offboard.proof_of_life(control(Unspecified), at(0));
        offboard.proof_of_life(v1::OffboardControlMode { control: 77 }, at(0));
        assert!(!offboard.is_alive(at(0)));
    }

    #[test]
    fn a_change_of_control_waits_for_its_other_half() {
        let mut offboard = offboard();
        offboard.setpoint(target(1.0), at(0));
        offboard.proof_of_life(control(Position), at(0));
        offboard.proof_of_life(control(Velocity), at(100));
        assert!(matches!(offboard.demand(), Some(Demand::Position { .. })));
        let velocity = Some(NedVelocity::new(1.0, 0.0, 0.0).into());
        offboard.setpoint(v1::TrajectorySetpoint { velocity, ..Default::default() }, at(100));
        assert!(matches!(offboard.demand(), Some(Demand::Velocity { .. })));
    }
}
