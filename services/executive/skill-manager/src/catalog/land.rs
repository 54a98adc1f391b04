//! Land: descend where the vehicle is, until the land detector reports the ground.

use domain::fmu::{Command, FlightMode, LocalPosition};
use domain::time::Time;
use kittiwake_proto::v1::SkillKind;

use super::{Ready, Skill};
use crate::fsm::Ending;
use crate::vehicle::View;

/// Has no parameters.
#[derive(Debug)]
pub(crate) struct Land;

impl Skill for Land {
    fn kind(&self) -> SkillKind {
        SkillKind::Land
    }

    fn ready(&mut self, view: &View) -> Ready {
        match view.at_rest_on_ground() {
            Some(true) => Ready::AlreadyTrue,
            Some(false) => Ready::Command,
            None => Ready::Await("land detector and vehicle status"),
        }
    }

    fn command(&self, accepted: usize) -> Option<Command> {
        (accepted == 0).then_some(Command::Land)
    }

    fn mode(&self) -> FlightMode {
        FlightMode::Land
    }

    fn ends_disarmed(&self) -> bool {
        true
    }

    fn progress(&mut self, view: &View, _now: Time) -> Option<Ending> {
        (view.landed == Some(true)).then(Ending::success)
    }

    fn distance_left_m(&self, motion: &LocalPosition) -> f64 {
        motion.position.height_m().max(0.0)
    }
}
