//! How the vehicle is, by where it is and by what its mission manager says now.

use std::fmt::Write as _;
use std::time::Duration;

use domain::time::Time;
use kittiwake_proto::v1;

use super::{Oracle, Violation};

/// One that rests for this mission time, and this wall time, holds.
const HOLDS: (Duration, Duration) = (Duration::from_secs(40), Duration::from_secs(8));

/// How the vehicle is.
#[derive(Debug, Clone, PartialEq)]
pub enum State {
    /// In the air, on its way.
    Flies,
    /// In the air, at rest for a while, for this reason; none if it is empty.
    Holds(String),
    /// On the ground, and stays there until an operator wants otherwise, for this reason.
    Waits(String),
    /// On the ground after the end of the mission.
    Over(v1::MissionOutcome),
    /// On the ground, and about to do something.
    Stands,
}

impl Oracle {
    /// How the vehicle is. A reason, or an end, counts only from a manager that is still heard.
    pub fn state(&self, now: Time) -> State {
        let manager = self.manager_of(now).cloned().unwrap_or_default();
        let reason = if manager.start_awaited { "waits for an operator" } else { manager.acting.as_str() };
        let (mission, wall) = HOLDS;
        let rests = self.rest.is_some_and(|(_, since)| since + mission.max(self.pace.wall(wall)) < now);
        match (self.witness.is_airborne(), rests) {
            (true, true) => State::Holds(reason.to_owned()),
            (true, false) => State::Flies,
            (false, true) if manager.report.is_some() => {
                State::Over(manager.report.as_ref().map(v1::MissionReport::outcome).unwrap_or_default())
            }
            (false, true) if !reason.is_empty() => State::Waits(reason.to_owned()),
            (false, _) => State::Stands,
        }
    }

    /// What the mission manager says, unless it was last heard longer ago than the death of a process may take, or before the
    /// power was lost: then nobody knows whether there is one.
    ///
    /// It is heard on board, so that a fault of the link takes nothing away.
    fn manager_of(&self, now: Time) -> Option<&v1::McmStatus> {
        let said = self.manager_said?;
        (now <= said + self.interruption).then_some(&self.manager)
    }

    /// The time of the run is up.
    pub fn never_ended(&mut self, now: Time) {
        let phase = match self.manager_of(now) {
            Some(it) => format!("mission {:?}", it.phase()),
            None => "its mission manager is not heard".to_owned(),
        };
        let mut how = format!("{:?}, {phase}", self.state(now));
        for victim in self.comes_back.awaited() {
            // Writing to a string does not fail.
            let _ = write!(how, ", {victim} is not back");
        }
        self.violations.push(Violation::NeverEnded(how));
    }
}
