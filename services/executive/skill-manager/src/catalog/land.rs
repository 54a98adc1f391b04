//! Land: descend where the vehicle is, until it stands on the ground, by the rule that all processes share
//! ([`domain::flight_state`]). One that stands there already is disarmed.

use domain::fmu::{Command, FlightMode, LocalPosition};
use domain::time::{Pace, Time};
use kittiwake_proto::v1::{SkillKind, SkillOutcome};

use super::descent::Descent;
use super::{Ready, Skill};
use crate::config::Config;
use crate::fsm::Ending;
use crate::vehicle::View;

/// A landing, which has to come down all the time.
#[derive(Debug)]
pub(crate) struct Land {
    descent: Descent,
    on_target: bool,
    /// It stands on the ground with its motors on: there is nothing to come down from.
    disarms: bool,
}

impl Land {
    /// A landing; `on_target`: which the autopilot's sensor sees.
    pub(crate) fn new(config: &Config, pace: Pace, on_target: bool) -> Land {
        Land { descent: Descent::new(config, pace, on_target), on_target, disarms: false }
    }
}

impl Skill for Land {
    fn kind(&self) -> SkillKind {
        SkillKind::Land
    }

    fn ready(&mut self, view: &View) -> Ready {
        // Once commanded it may lift off; an autopilot refuses to disarm then, and the next try lands.
        let is_armed = view.status.is_some_and(|it| it.armed);
        self.disarms = view.stands_still && is_armed;
        match view.at_rest_on_ground() {
            Some(true) if !is_armed => Ready::AlreadyTrue,
            // It has landed, and is not where it stood before.
            Some(true) if !self.disarms => Ready::AlreadyTrue,
            Some(_) => Ready::Command,
            None => Ready::Await("land detector and vehicle status"),
        }
    }

    fn command(&self, accepted: usize) -> Option<Command> {
        let command = match (self.disarms, self.on_target) {
            (true, _) => Command::Disarm,
            (false, true) => Command::LandOnTarget,
            (false, false) => Command::Land,
        };
        (accepted == 0).then_some(command)
    }

    fn mode(&self) -> FlightMode {
        FlightMode::Land
    }

    fn ends_disarmed(&self) -> bool {
        true
    }

    /// A landing on the spot is the most severe response: nothing safer is given up for it.
    fn may_start_during_failsafe(&self) -> bool {
        true
    }

    fn execute(&mut self, now: Time) {
        self.descent.begin(now);
    }

    fn progress(&mut self, view: &View, now: Time) -> Option<Ending> {
        let is_done = match self.disarms {
            true => view.status.is_some_and(|it| !it.armed),
            false => view.flying == Some(false),
        };
        if is_done {
            return Some(Ending::success());
        }
        let height_m = view.vertical.map(|it| it.position.height_m());
        if !self.descent.has_stalled(now, height_m) {
            return None;
        }
        if self.disarms {
            // A status that is frozen shows nothing else.
            return Some(Ending::because(SkillOutcome::TimedOut, "was disarmed, and is still reported as armed"));
        }
        let reason = match height_m {
            Some(height_m) => format!("did not come down: still at a height of {height_m:.1} m"),
            None => "did not come down as far as is known: the height is not".into(),
        };
        Some(Ending::because(SkillOutcome::TimedOut, reason))
    }

    fn deadline(&self) -> Option<Time> {
        self.descent.deadline()
    }

    fn distance_left_m(&self, motion: &LocalPosition) -> f64 {
        motion.position.height_m().max(0.0)
    }
}
