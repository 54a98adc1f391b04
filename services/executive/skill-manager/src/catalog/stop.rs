//! Stop: come to rest and loiter. On the ground it leaves the armed state alone.

use domain::fmu::{Command, FlightMode};
use domain::time::Time;
use kittiwake_proto::v1::SkillKind;

use super::{Ready, Skill};
use crate::config::Config;
use crate::fsm::Ending;
use crate::vehicle::View;

/// Its only parameter is the speed that counts as rest.
#[derive(Debug)]
pub(crate) struct Stop {
    speed_tolerance_m_s: f64,
}

impl Stop {
    /// A stop.
    pub(crate) fn new(config: &Config) -> Stop {
        Stop { speed_tolerance_m_s: config.speed_tolerance_m_s.get() }
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
        // To be slow in another mode is no stop: that mode goes on flying.
        let loiters = view.status.is_some_and(|it| {
            it.intended == FlightMode::Loiter && it.actual == FlightMode::Loiter && self.is_slow(view)
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

    fn progress(&mut self, view: &View, _now: Time) -> Option<Ending> {
        self.is_slow(view).then(Ending::success)
    }
}
