//! Release: open the gripper, hovering over a place, until the load is seen released.
//!
//! A load that has fallen cannot be taken back. So nothing is commanded away from the place, in motion, or where the
//! gripper reports nothing; and where the load is gone already, as after a restart, nothing is commanded either.

use std::time::Duration;

use domain::fmu::{Command, FlightMode, Gripper};
use domain::geometry::Ned;
use domain::time::{Pace, Time};
use kittiwake_proto::v1::{SkillKind, SkillOutcome};

use super::deadline::Deadline;
use super::hover::Hover;
use super::{Ready, Skill};
use crate::config::Config;
use crate::fsm::Ending;
use crate::vehicle::{View, at_wall_rate};

/// A release: the place, and the time until the load must be gone.
#[derive(Debug)]
pub(crate) struct Release {
    hover: Hover,
    limit: Duration,
    deadline: Deadline,
}

impl Release {
    /// A release over `over`.
    pub(crate) fn new(over: Ned, config: &Config, pace: Pace) -> Release {
        Release {
            hover: Hover::new(over, config),
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
        let status = match Hover::status(view) {
            Ok(status) => status,
            Err(not_yet) => return not_yet,
        };
        match status.gripper {
            Some(Gripper::Released) => return Ready::AlreadyTrue,
            Some(Gripper::Holding | Gripper::Silent) => {
                // Of a release that was interrupted, or that an earlier process may have sent: where there are several loads,
                // another command might drop the next one.
                if let Some(until) = view.may_release_until {
                    return Ready::NotBefore(until);
                }
            }
            None => return Ready::Refuse("the autopilot reports no gripper".into()),
        }
        self.hover.ready(view)
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
