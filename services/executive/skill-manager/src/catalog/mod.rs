//! The skills. A new one is a file here, a variant of the goal, and an arm of [`skill_for`].

use std::time::Duration;

use domain::fmu::{Command, FlightMode, LocalPosition, Setpoint};
use domain::skill::Goal;
use domain::time::{Pace, Time};
use kittiwake_proto::v1::SkillKind;

use crate::config::Config;
use crate::fsm::Ending;
use crate::messages::{TaskOrder, TaskReport};
use crate::vehicle::View;

mod deadline;
mod descent;
mod forward;
mod hover;
mod land;
mod offboard;
mod release;
mod stop;
mod takeoff;
pub(crate) mod task;

use forward::Forward;

/// What distinguishes one kind of skill. The life that all of them share is in [`crate::fsm`].
pub(crate) trait Skill: std::fmt::Debug + Send {
    /// Its kind, for messages.
    fn kind(&self) -> SkillKind;

    /// Whether it can start. Called before anything is commanded, and again with newer data while it
    /// waits.
    fn ready(&mut self, view: &View) -> Ready;

    /// The command to send after this many of its commands were accepted; `None`: there is no other.
    fn command(&self, accepted: usize) -> Option<Command>;

    /// The mode that the vehicle flies while it executes.
    fn mode(&self) -> FlightMode;

    /// The mode to which the autopilot may change by itself at the end.
    fn mode_afterwards(&self) -> Option<FlightMode> {
        None
    }

    /// Whether the autopilot may disarm by itself at the end.
    fn ends_disarmed(&self) -> bool {
        false
    }

    /// Whether its goal is a place or a height in the local frame, which means nothing once the frame has moved.
    fn depends_on_frame(&self) -> bool {
        false
    }

    /// Whether it is used by a vehicle that stands: no mode is flown, and nothing is commanded.
    fn stands(&self) -> bool {
        false
    }

    /// Whether nothing undoes what it has commanded: cancelled, it still ends with what was seen to happen.
    fn is_irrevocable(&self) -> bool {
        false
    }

    /// Whether it may start while the autopilot flies a failsafe of its own, though no operator has ordered it.
    fn may_start_during_failsafe(&self) -> bool {
        false
    }

    /// What is to be streamed while it executes.
    fn setpoint(&self) -> Option<Setpoint> {
        None
    }

    /// What its own process is to be told now.
    fn take_order(&mut self, now: Time) -> Option<TaskOrder> {
        let _ = now;
        None
    }

    /// What ends it in its own process, if it goes on there, and how long that may take.
    fn order_to_end(&self) -> Option<(TaskOrder, Duration)> {
        None
    }

    /// A process has reported about a declared skill.
    fn hear(&mut self, report: &TaskReport, now: Time) {
        let _ = (report, now);
    }

    /// It executes from now on: its commands were accepted.
    fn execute(&mut self, now: Time) {
        let _ = now;
    }

    /// How it ends, if its postcondition is seen or can no longer be reached. Once its deadline has
    /// come it ends, or has another deadline.
    fn progress(&mut self, view: &View, now: Time) -> Option<Ending>;

    /// When it ends, or must look again, even if no data come.
    fn deadline(&self) -> Option<Time> {
        None
    }

    /// How far it still has to fly; 0 for a skill without a target.
    fn distance_left_m(&self, motion: &LocalPosition) -> f64 {
        let _ = motion;
        0.0
    }
}

/// Whether a skill can start.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Ready {
    /// It can be commanded.
    Command,
    /// Its postcondition holds already; nothing is to be commanded.
    AlreadyTrue,
    /// These data are missing or too old. If they do not come, the autopilot may judge the command.
    Await(&'static str),
    /// These data are missing or too old, and it cannot be commanded without them.
    Require(&'static str),
    /// It must not be commanded as the vehicle is now, for this reason; it fails unless that changes as soon as data may come.
    Refuse(String),
    /// It must not be commanded before this time. Until then only its postcondition ends the wait.
    NotBefore(Time),
}

/// The skill that flies `goal`, which was requested by this name.
pub(crate) fn skill_for(goal: Goal, request_id: &str, config: &Config, pace: Pace) -> Box<dyn Skill> {
    match goal {
        Goal::Land => Box::new(land::Land::new(config, pace, false)),
        Goal::LandOnTarget => Box::new(land::Land::new(config, pace, true)),
        Goal::Takeoff { climb_m } => Box::new(takeoff::Takeoff::new(climb_m, config, pace)),
        Goal::Stop => Box::new(stop::Stop::new(config, pace)),
        Goal::Position { target, speed_limit_m_s, yaw_rad, hold_at_target } => {
            let setpoint = Setpoint::Position { target, speed_limit_m_s: Some(speed_limit_m_s), yaw_rad };
            let (limits, forward) = (offboard::Limits::new(config, speed_limit_m_s), Forward::new(config, pace));
            Box::new(offboard::Position::new(target, setpoint, hold_at_target, limits, forward))
        }
        Goal::Velocity { velocity, yaw_rate_rad_s, timeout_s } => {
            Box::new(offboard::Velocity::new(Setpoint::Velocity { velocity, yaw_rate_rad_s }, timeout_s))
        }
        Goal::Release { over } => Box::new(release::Release::new(over, config, pace)),
        Goal::Task(goal) => Box::new(task::Task::new(goal, request_id, config, pace)),
    }
}
