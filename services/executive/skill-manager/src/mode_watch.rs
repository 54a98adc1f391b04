//! Whether the vehicle still flies what a skill made it fly.

use std::time::Duration;

use domain::time::Time;
use kittiwake_proto::v1::{FlightMode, SkillOutcome};

use crate::catalog::Skill;
use crate::fsm::Ending;
use crate::vehicle::Status;

/// Watches the flight mode for one skill, from the acknowledgement on.
#[derive(Debug, Clone, Copy)]
pub struct ModeWatch {
    since: Time,
    /// The vehicle was seen in the skill's mode; before that, no mode is held against it.
    seen: bool,
}

impl ModeWatch {
    /// A watch that begins at this moment.
    pub fn new(now: Time) -> ModeWatch {
        ModeWatch { since: now, seen: false }
    }

    /// What a status, newer than the last acknowledgement, means for the skill; `None`: go on.
    pub fn judge(&mut self, skill: &dyn Skill, status: Status, now: Time, limit: Duration) -> Option<Ending> {
        let own = skill.mode();
        let afterwards = skill.mode_afterwards().filter(|_| self.seen);
        let is_own = |mode: FlightMode| mode == own || afterwards == Some(mode);
        let Status { armed, intended, actual, .. } = status;
        if is_own(actual) && is_own(intended) {
            self.seen = true;
        }
        if !self.seen {
            let late = limit < now - self.since;
            return late.then(|| {
                let (verb, other) = if is_own(actual) { ("is to fly", intended) } else { ("flies", actual) };
                let reason = format!("accepted, but the vehicle {verb} {}, not {}", name(other), name(own));
                Ending::because(SkillOutcome::Failed, reason)
            });
        }
        if !armed {
            // What a landed vehicle's mode says is of no interest: the land detector decides.
            return (!skill.ends_disarmed()).then(|| Ending::because(SkillOutcome::Failed, "the vehicle was disarmed"));
        }
        let preempted = |reason: String| Some(Ending::because(SkillOutcome::Preempted, reason));
        if !is_own(intended) {
            preempted(format!("somebody else set the mode to {}", name(intended)))
        } else if !is_own(actual) {
            preempted(format!("the autopilot flies {} instead of {}", name(actual), name(intended)))
        } else {
            None
        }
    }
}

fn name(mode: FlightMode) -> &'static str {
    match mode {
        FlightMode::Unspecified => "an unknown mode",
        FlightMode::Loiter => "loiter",
        FlightMode::Takeoff => "takeoff",
        FlightMode::Land => "land",
        FlightMode::Offboard => "offboard",
        FlightMode::Return => "return",
    }
}
