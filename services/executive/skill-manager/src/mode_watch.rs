//! Whether the vehicle still flies what a skill made it fly.

use std::time::Duration;

use domain::fmu::FlightMode;
use domain::time::Time;
use kittiwake_proto::v1::SkillOutcome;

use crate::catalog::Skill;
use crate::fsm::Ending;
use crate::vehicle::FlightStatus;

/// Watches the flight mode for one skill, from the acknowledgement on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ModeWatch {
    since: Time,
    /// The vehicle was seen in the skill's mode; before that, another mode is not a pre-emption.
    seen: bool,
}

impl ModeWatch {
    /// A watch that begins at this moment.
    pub(crate) fn new(now: Time) -> ModeWatch {
        ModeWatch { since: now, seen: false }
    }

    /// How the skill ends because of a status that is newer than the last acknowledgement; `None`: it
    /// goes on. `limit` is how long the mode may take to be seen; `why` are the autopilot's own words about what it flies.
    pub(crate) fn judge(
        &mut self,
        skill: &dyn Skill,
        status: FlightStatus,
        why: &str,
        now: Time,
        limit: Duration,
    ) -> Option<Ending> {
        let own = skill.mode();
        let afterwards = skill.mode_afterwards().filter(|_| self.seen);
        let is_own = |mode: Option<FlightMode>| mode == Some(own) || (mode.is_some() && afterwards == mode);
        let because = because(why);
        let FlightStatus { armed, intended, actual, .. } = status;
        if is_own(actual) && is_own(intended) {
            self.seen = true;
        }
        if !self.seen {
            let (which, other) = if is_own(actual) { ("intended", intended) } else { ("actual", actual) };
            let reason = || format!("accepted, but the {which} mode is {}, not {own}{because}", in_words(other));
            return (limit < now - self.since).then(|| Ending::because(SkillOutcome::Failed, reason()));
        }
        if !armed {
            // The mode of a landed vehicle means nothing: the land detector decides.
            return (!skill.ends_disarmed())
                .then(|| Ending::because(SkillOutcome::Preempted, "the vehicle was disarmed"));
        }
        let preempted = |reason: String| Some(Ending::because(SkillOutcome::Preempted, reason));
        if !is_own(intended) {
            preempted(format!("another controller set the mode to {}", in_words(intended)))
        } else if !is_own(actual) && !status.waits_for_us {
            let (actual, intended) = (in_words(actual), in_words(intended));
            preempted(format!("the autopilot flies {actual} instead of {intended}{because}"))
        } else {
            None
        }
    }
}

/// How a skill ends that would be flown in place of a failsafe of the autopilot's own.
pub(crate) fn left_to_autopilot(status: FlightStatus, why: &str) -> Ending {
    let reason = format!("the autopilot flies {} by a failsafe of its own{}", in_words(status.actual), because(why));
    Ending::because(SkillOutcome::Preempted, reason)
}

fn because(why: &str) -> String {
    if why.is_empty() { String::new() } else { format!(": {why}") }
}

/// The mode as users read it.
fn in_words(mode: Option<FlightMode>) -> String {
    mode.map_or_else(|| "one without a name here".to_owned(), |it| it.to_string())
}
