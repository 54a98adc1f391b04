//! Stop: come to rest and loiter. On the ground it leaves the armed state alone.

use std::time::Duration;

use domain::fmu::{Command, FlightMode};
use domain::time::{Pace, Time};
use kittiwake_proto::v1::{SkillKind, SkillOutcome};

use super::deadline::Deadline;
use super::{Ready, Skill};
use crate::config::Config;
use crate::fsm::Ending;
use crate::vehicle::{View, at_wall_rate};

/// A stop: the speed that counts as rest, and the time until then.
#[derive(Debug)]
pub(crate) struct Stop {
    speed_tolerance_m_s: f64,
    limit: Duration,
    deadline: Deadline,
}

impl Stop {
    /// A stop.
    pub(crate) fn new(config: &Config, pace: Pace) -> Stop {
        Stop {
            speed_tolerance_m_s: config.speed_tolerance_m_s.get(),
            limit: pace.limit(config.stop_limit_s.seconds()),
            deadline: Deadline::new(at_wall_rate(pace, config.data_wait_s.seconds())),
        }
    }

    fn is_slow(&self, view: &View) -> bool {
        view.motion.is_some_and(|it| it.velocity.speed_m_s() < self.speed_tolerance_m_s)
    }
}

impl Skill for Stop {
    fn kind(&self) -> SkillKind {
        SkillKind::Stop
    }

    fn ready(&mut self, view: &View) -> Ready {
        // To be slow in another mode is not a stop: that mode goes on flying.
        let loiters = view.status.is_some_and(|it| {
            // A loiter that somebody else has chosen is not ours before it is commanded.
            it.is_in(FlightMode::Loiter) && !it.of_other && self.is_slow(view)
        });
        match view.at_rest_on_ground() {
            Some(true) => Ready::AlreadyTrue,
            Some(false) if loiters => Ready::AlreadyTrue,
            Some(false) => Ready::Command,
            None => Ready::Await("land detector and vehicle status"),
        }
    }

    fn command(&self, accepted: usize) -> Option<Command> {
        (accepted == 0).then_some(Command::Loiter)
    }

    fn mode(&self) -> FlightMode {
        FlightMode::Loiter
    }

    fn execute(&mut self, now: Time) {
        self.deadline.set(now + self.limit);
    }

    fn progress(&mut self, view: &View, now: Time) -> Option<Ending> {
        if self.is_slow(view) {
            return Some(Ending::success());
        }
        self.deadline.is_missed(now, view.motion.is_some()).then(|| {
            let reason = match view.motion {
                Some(it) => format!("not at rest: still {:.1} m/s", it.velocity.speed_m_s()),
                None => "the vehicle's speed is not known".into(),
            };
            Ending::because(SkillOutcome::TimedOut, reason)
        })
    }

    fn deadline(&self) -> Option<Time> {
        self.deadline.at()
    }
}
