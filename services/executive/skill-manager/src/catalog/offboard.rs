//! Offboard: fly by setpoints, to a position or at a velocity.

use std::time::Duration;

use domain::fmu::{Command, FlightMode, LocalPosition, Setpoint};
use domain::geometry::Ned;
use domain::speeds::Speeds;
use domain::time::Time;
use kittiwake_proto::v1::{SkillKind, SkillOutcome};

use super::forward::Forward;
use super::{Ready, Skill};
use crate::config::Config;
use crate::fsm::Ending;
use crate::vehicle::View;

/// Mode 0: straight to a position. Ends when the vehicle is there and slow, or comes no nearer.
#[derive(Debug)]
pub(crate) struct Position {
    target: Ned,
    setpoint: Setpoint,
    hold_at_target: bool,
    limits: Limits,
    forward: Forward,
    /// It was at its target, and need not come nearer since then.
    arrived: bool,
}

/// Tolerances and speeds: when the vehicle is at the target, and slow, and how fast it is to fly there.
#[derive(Debug)]
pub(crate) struct Limits {
    distance_m: f64,
    speed_m_s: f64,
    intended: Speeds,
}

impl Limits {
    /// For a flight no faster than `speed_limit_m_s` and than the vehicle's own limits.
    pub(crate) fn new(config: &Config, speed_limit_m_s: f64) -> Limits {
        let own = [config.vehicle_speed_m_s, config.vehicle_climb_m_s, config.vehicle_descent_m_s];
        let [cruise_m_s, climb_m_s, descent_m_s] = own.map(|it| it.get().min(speed_limit_m_s));
        Limits {
            distance_m: config.position_tolerance_m.get(),
            speed_m_s: config.speed_tolerance_m_s.get(),
            intended: Speeds::calm(cruise_m_s, climb_m_s, descent_m_s),
        }
    }
}

impl Position {
    /// A flight to `target` by `setpoint`.
    pub(super) fn new(
        target: Ned,
        setpoint: Setpoint,
        hold_at_target: bool,
        limits: Limits,
        forward: Forward,
    ) -> Position {
        Position { target, setpoint, hold_at_target, limits, forward, arrived: false }
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
        self.forward.begin(now);
    }

    fn progress(&mut self, view: &View, now: Time) -> Option<Ending> {
        if let Some(motion) = view.motion
            && self.is_there(&motion)
        {
            self.arrived = true;
            if !self.hold_at_target {
                return Some(Ending::success());
            }
        }
        let left_s = view.motion.map(|it| self.limits.intended.time_s(it.position, self.target));
        if self.arrived || !self.forward.has_failed(now, left_s) {
            return None;
        }
        let reason = match view.motion {
            Some(it) => format!("comes no nearer: still {:.1} m from the target", it.position.distance_m(self.target)),
            None => "the vehicle's position is not known".into(),
        };
        Some(Ending::because(SkillOutcome::TimedOut, reason))
    }

    fn deadline(&self) -> Option<Time> {
        self.forward.judged_at().filter(|_| !self.arrived)
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
