//! Release: open the gripper, hovering over a place, until the load is seen released.
//!
//! A load that has fallen cannot be taken back. So nothing is commanded away from the place, in motion, or where the
//! gripper's state is not reported; and where the load is gone already, as after a restart, nothing is commanded either.

use std::time::Duration;

use domain::fmu::{Command, FlightMode, Gripper};
use domain::geometry::Ned;
use domain::time::{Pace, Time};
use kittiwake_proto::v1::{SkillKind, SkillOutcome};

use super::deadline::Deadline;
use super::{Ready, Skill};
use crate::config::Config;
use crate::fsm::Ending;
use crate::vehicle::{View, at_wall_rate};

/// A release: the place, how near to it and how slow the vehicle must be, and the time until the load must be gone.
#[derive(Debug)]
pub(crate) struct Release {
    over: Ned,
    distance_m: f64,
    speed_tolerance_m_s: f64,
    limit: Duration,
    deadline: Deadline,
}

impl Release {
    /// A release over `over`.
    pub(crate) fn new(over: Ned, config: &Config, pace: Pace) -> Release {
        Release {
            over,
            distance_m: config.release_distance_m.get(),
            speed_tolerance_m_s: config.speed_tolerance_m_s.get(),
            limit: pace.limit(config.release_limit_s.seconds()),
            deadline: Deadline::new(at_wall_rate(pace, config.data_wait_s.seconds())),
        }
    }
}

fn gripper(view: &View) -> Option<Gripper> {
    view.status.and_then(|it| it.gripper)
}

impl Skill for Release {
    fn kind(&self) -> SkillKind {
        SkillKind::Release
    }

    fn ready(&mut self, view: &View) -> Ready {
        let Some(status) = view.status else { return Ready::Require("status") };
        if view.flying != Some(true) || !status.is_in(FlightMode::Loiter) {
            let mode = status.actual.map_or_else(|| "one without a name here".to_owned(), |it| it.to_string());
            return Ready::Refuse(format!("the vehicle does not hover: its mode is {mode}"));
        }
        match status.gripper {
            Some(Gripper::Released) => return Ready::AlreadyTrue,
            Some(Gripper::Holding) => {
                // Of a release that was interrupted, or that an earlier process may have sent: where there are several loads,
                // another command might drop the next one.
                if let Some(until) = view.may_release_until {
                    return Ready::NotBefore(until);
                }
            }
            None => return Ready::Refuse("the autopilot reports no gripper".into()),
        }
        let Some(motion) = view.motion else { return Ready::Require("position") };
        let apart_m = motion.position.horizontal_distance_m(self.over);
        let speed_m_s = motion.velocity.speed_m_s();
        if self.distance_m < apart_m {
            Ready::Refuse(format!("the vehicle is {apart_m:.1} m from the place"))
        } else if self.speed_tolerance_m_s < speed_m_s {
            Ready::Refuse(format!("the vehicle still moves at {speed_m_s:.1} m/s"))
        } else {
            Ready::Command
        }
    }

    fn command(&self, accepted: usize) -> Option<Command> {
        (accepted == 0).then_some(Command::Release)
    }

    fn mode(&self) -> FlightMode {
        FlightMode::Loiter
    }

    fn depends_on_frame(&self) -> bool {
        true
    }

    fn is_irrevocable(&self) -> bool {
        true
    }

    /// It does not change what is flown.
    fn may_start_during_failsafe(&self) -> bool {
        true
    }

    fn execute(&mut self, now: Time) {
        self.deadline.set(now + self.limit);
    }

    fn progress(&mut self, view: &View, now: Time) -> Option<Ending> {
        let gripper = gripper(view);
        if gripper == Some(Gripper::Released) {
            return Some(Ending::success());
        }
        self.deadline.is_missed(now, view.status.is_some()).then(|| {
            let reason = match gripper {
                Some(gripper) => format!("release accepted, but the gripper {gripper}"),
                None => "release accepted, but it is not known whether the gripper opened".into(),
            };
            Ending::because(SkillOutcome::TimedOut, reason)
        })
    }

    fn deadline(&self) -> Option<Time> {
        self.deadline.at()
    }
}
