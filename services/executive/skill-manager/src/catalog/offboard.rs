//! Offboard: fly by setpoints, to a position or at a velocity.

use std::time::Duration;

use domain::fmu::{Command, FlightMode, LocalPosition, Setpoint};
use domain::geometry::Ned;
use domain::time::{Pace, Time};
use kittiwake_proto::v1::{SkillKind, SkillOutcome};

use super::deadline::Deadline;
use super::{Ready, Skill};
use crate::config::Config;
use crate::fsm::Ending;
use crate::vehicle::{View, at_wall_rate};

/// Mode 0: straight to a position. Ends when the vehicle is there and slow.
#[derive(Debug)]
pub(crate) struct Position {
    target: Ned,
    setpoint: Setpoint,
    hold_at_target: bool,
    limits: Limits,
    started: Option<Time>,
    /// Set once the first position after the start has arrived.
    deadline: Deadline,
    /// It was at its target, and has no deadline since then.
    arrived: bool,
}

/// Tolerances and speeds: when the vehicle is at the target, slow, and late.
#[derive(Debug)]
pub(crate) struct Limits {
    distance_m: f64,
    speed_m_s: f64,
    cruise_m_s: f64,
    climb_m_s: f64,
    descent_m_s: f64,
    slack: f64,
    margin_s: f64,
    data_wait: Duration,
}

impl Limits {
    /// For a flight no faster than `speed_limit_m_s` and than the vehicle's own limits.
    pub(crate) fn new(config: &Config, pace: Pace, speed_limit_m_s: f64) -> Limits {
        Limits {
            distance_m: config.position_tolerance_m.get(),
            speed_m_s: config.speed_tolerance_m_s.get(),
            cruise_m_s: config.vehicle_speed_m_s.get().min(speed_limit_m_s),
            climb_m_s: config.vehicle_climb_m_s.get().min(speed_limit_m_s),
            descent_m_s: config.vehicle_descent_m_s.get().min(speed_limit_m_s),
            slack: config.deadline_slack.get(),
            margin_s: config.deadline_margin_s.get(),
            data_wait: at_wall_rate(pace, config.data_wait_s.seconds()),
        }
    }

    /// How long the flight may take; `None`: longer than a `Duration` can hold.
    fn time_for(&self, from: Ned, to: Ned) -> Option<Duration> {
        let climb_m = to.height_m() - from.height_m();
        let vertical_s = if 0.0 < climb_m { climb_m / self.climb_m_s } else { -climb_m / self.descent_m_s };
        let nominal_s = (from.distance_m(to) / self.cruise_m_s).max(vertical_s);
        seconds(nominal_s * (1.0 + self.slack) + self.margin_s)
    }
}

impl Position {
    /// A flight to `target` by `setpoint`.
    pub(crate) fn new(target: Ned, setpoint: Setpoint, hold_at_target: bool, limits: Limits) -> Position {
        let deadline = Deadline::new(limits.data_wait);
        Position { target, setpoint, hold_at_target, limits, started: None, deadline, arrived: false }
    }

    /// Until when the first position is awaited: without one nothing says how long the flight may take.
    fn blind_until(&self) -> Option<Time> {
        Some(self.started? + seconds(self.limits.margin_s)?)
    }

    fn is_there(&self, motion: &LocalPosition) -> bool {
        motion.position.distance_m(self.target) < self.limits.distance_m
            && motion.velocity.speed_m_s() < self.limits.speed_m_s
    }
}

impl Skill for Position {
    fn kind(&self) -> SkillKind {
        SkillKind::Offboard
    }

    fn ready(&mut self, view: &View) -> Ready {
        match view.motion {
            // Holding the target takes the skill, even if the vehicle is there.
            _ if self.hold_at_target => Ready::Command,
            // Nor is it held by somebody else for ever.
            Some(motion) if self.is_there(&motion) && !view.status.is_some_and(|it| it.of_other) => Ready::AlreadyTrue,
            Some(_) => Ready::Command,
            None => Ready::Await("position"),
        }
    }

    fn command(&self, accepted: usize) -> Option<Command> {
        (accepted == 0).then_some(Command::Offboard)
    }

    fn mode(&self) -> FlightMode {
        FlightMode::Offboard
    }

    fn depends_on_frame(&self) -> bool {
        true
    }

    fn setpoint(&self) -> Option<Setpoint> {
        Some(self.setpoint)
    }

    fn execute(&mut self, now: Time) {
        self.started = Some(now);
    }

    fn progress(&mut self, view: &View, now: Time) -> Option<Ending> {
        if let Some(motion) = view.motion {
            if self.is_there(&motion) {
                self.arrived = true;
                if !self.hold_at_target {
                    return Some(Ending::success());
                }
            }
            let time = self.limits.time_for(motion.position, self.target);
            if let Some((started, time)) = self.started.zip(time) {
                self.deadline.set(started + time);
            }
        }
        let is_blind = self.deadline.at().is_none() && self.blind_until().is_some_and(|until| until <= now);
        if self.arrived || !(is_blind || self.deadline.is_missed(now, view.motion.is_some())) {
            return None;
        }
        let reason = match view.motion {
            Some(it) => format!("still {:.1} m from the target", it.position.distance_m(self.target)),
            None => "the vehicle's position is not known".into(),
        };
        Some(Ending::because(SkillOutcome::TimedOut, reason))
    }

    fn deadline(&self) -> Option<Time> {
        self.deadline.at().or_else(|| self.blind_until()).filter(|_| !self.arrived)
    }

    fn distance_left_m(&self, motion: &LocalPosition) -> f64 {
        motion.position.distance_m(self.target)
    }
}

/// Mode 1: at a velocity until the timeout.
#[derive(Debug)]
pub(crate) struct Velocity {
    setpoint: Setpoint,
    /// `None`: without end.
    timeout: Option<Duration>,
    deadline: Option<Time>,
}

impl Velocity {
    /// A flight by `setpoint` for `timeout_s` mission seconds.
    pub(crate) fn new(setpoint: Setpoint, timeout_s: Option<f64>) -> Velocity {
        Velocity { setpoint, timeout: timeout_s.and_then(seconds), deadline: None }
    }
}

impl Skill for Velocity {
    fn kind(&self) -> SkillKind {
        SkillKind::Offboard
    }

    fn ready(&mut self, _view: &View) -> Ready {
        Ready::Command
    }

    fn command(&self, accepted: usize) -> Option<Command> {
        (accepted == 0).then_some(Command::Offboard)
    }

    fn mode(&self) -> FlightMode {
        FlightMode::Offboard
    }

    fn setpoint(&self) -> Option<Setpoint> {
        Some(self.setpoint)
    }

    fn execute(&mut self, now: Time) {
        self.deadline = self.timeout.map(|it| now + it);
    }

    fn progress(&mut self, _view: &View, now: Time) -> Option<Ending> {
        self.deadline.filter(|it| *it <= now).map(|_| Ending::success())
    }

    fn deadline(&self) -> Option<Time> {
        self.deadline
    }
}

/// The seconds as a duration; `None`, which is without end, if they are more than it can hold.
fn seconds(seconds: f64) -> Option<Duration> {
    Duration::try_from_secs_f64(seconds).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_deadline_is_distance_over_speed_with_a_margin() {
        #[track_caller]
        fn check(to: Ned, cruise_m_s: f64, expected_s: Option<u64>) {
            let limits = Limits {
                distance_m: 1.0,
                speed_m_s: 0.3,
                cruise_m_s,
                climb_m_s: 3.0,
                descent_m_s: 1.5,
                slack: 1.0,
                margin_s: 20.0,
                data_wait: Duration::ZERO,
            };
            let time = limits.time_for(Ned::new(0.0, 0.0, -10.0), to);
            assert_eq!(time.map(|it| it.as_secs()), expected_s);
        }
        check(Ned::new(0.0, 500.0, -10.0), 10.0, Some(120));
        check(Ned::new(0.0, 0.0, -40.0), 10.0, Some(40));
        check(Ned::new(0.0, 0.0, -4.0), 10.0, Some(28));
        check(Ned::new(0.0, 500.0, -10.0), 1e-300, None);
    }
}
