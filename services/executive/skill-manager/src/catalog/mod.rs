//! The skills there are. A new one is a file here, a variant of the goal, and an arm of [`skill_for`].

use domain::skill::Goal;
use domain::time::{Pace, Time};
use kittiwake_proto::v1::{FlightMode, SkillKind};

use crate::commands::Command;
use crate::config::Config;
use crate::fsm::Ending;
use crate::stream::Setpoint;
use crate::vehicle::{Motion, View};

mod land;
mod offboard;
mod stop;
mod takeoff;

/// What one kind of skill adds to the life that all of them share.
pub trait Skill: std::fmt::Debug + Send {
    /// Its name on the wire.
    fn kind(&self) -> SkillKind;

    /// Looks at the vehicle before anything is commanded; called again with newer data while it waits.
    fn ready(&mut self, view: &View) -> Ready;

    /// The command to be sent when so many of its commands have been accepted; `None`: that was all.
    fn command(&self, accepted: usize) -> Option<Command>;

    /// The mode that the vehicle flies while it executes.
    fn mode(&self) -> FlightMode;

    /// The mode into which the autopilot may change by itself when it is through.
    fn mode_afterwards(&self) -> Option<FlightMode> {
        None
    }

    /// Whether the autopilot may disarm by itself at its end.
    fn ends_disarmed(&self) -> bool {
        false
    }

    /// What is to be streamed while it executes.
    fn setpoint(&self) -> Option<Setpoint> {
        None
    }

    /// Its commands have been accepted.
    fn execute(&mut self, now: Time) {
        let _ = now;
    }

    /// Whether it is over: its postcondition is seen, or it cannot be reached any more. Once its
    /// deadline has come it is over, or has another deadline.
    fn progress(&mut self, view: &View, now: Time) -> Option<Ending>;

    /// When it ends, or must look again, even if no data come.
    fn deadline(&self) -> Option<Time> {
        None
    }

    /// How far it still has to go, where it has a way to go.
    fn distance_left_m(&self, motion: &Motion) -> f64 {
        let _ = motion;
        0.0
    }
}

/// Whether a skill can start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ready {
    /// Command it.
    Command,
    /// Its postcondition holds already; command nothing.
    AlreadyTrue,
    /// Data are missing or too old. If they do not come, the autopilot may judge the command.
    Await(&'static str),
    /// Data are missing or too old, and it cannot be commanded without.
    Require(&'static str),
}

/// The skill that flies `goal`.
pub fn skill_for(goal: Goal, config: &Config, pace: Pace) -> Box<dyn Skill> {
    match goal {
        Goal::Land => Box::new(land::Land),
        Goal::Takeoff { climb_m } => Box::new(takeoff::Takeoff::new(climb_m, config)),
        Goal::Stop => Box::new(stop::Stop::new(config)),
        Goal::Position { target, speed_limit_m_s, yaw_rad, hold_at_target } => {
            let setpoint = Setpoint::Position { target, speed_limit_m_s, yaw_rad };
            let limits = offboard::Limits::new(config, pace, speed_limit_m_s);
            Box::new(offboard::Position::new(target, setpoint, hold_at_target, limits))
        }
        Goal::Velocity { velocity, yaw_rate_rad_s, timeout_s } => {
            Box::new(offboard::Velocity::new(Setpoint::Velocity { velocity, yaw_rate_rad_s }, timeout_s))
        }
    }
}
