//! How a run ends.

use kittiwake_proto::v1::MissionOutcome;

use super::Flight;
use crate::oracle::State;
use crate::system::System;
use crate::trouble::{Order, Trouble};

/// How a run ends whose system has been up and is not any more.
pub(super) const NOT_BACK: &str = "the system did not stay up or come back";

impl Flight<'_> {
    /// How the run ends, if nothing more is to come.
    pub(super) fn outcome(&mut self) -> Option<String> {
        let now = self.now().time;
        let scene = self.scene.as_ref().filter(|_| self.troubles.is_empty())?;
        // Who was lost last is back by then, or it is a violation.
        if now < self.settled_from + self.oracle.interruption() || self.oracle.awaits_somebody() {
            return None;
        }
        match self.oracle.state(now) {
            State::Waits(reason) => Some(format!("on the ground, {reason}")),
            // With a launcher its exit code says so.
            State::Over(outcome) if matches!(self.system, Some(System::Supervised(_))) => {
                self.oracle.over(outcome);
                Some(self.after_hold(match outcome {
                    MissionOutcome::Success => "achieved".to_owned(),
                    other => format!("landed, mission {other:?}"),
                }))
            }
            State::Holds(reason) if !reason.is_empty() && self.last_order.is_none() => {
                scene.begin(Trouble::Ordered(Order::Abort));
                self.tell(format!("chaos: it holds: {reason}; ordered down"));
                self.last_order = Some(reason);
                None
            }
            _ => None,
        }
    }

    /// Its launcher has ended; how, in words.
    pub(super) fn launcher_ended(&mut self) -> String {
        let code = self.system.as_mut().and_then(System::exit_code);
        let (now, last_words) = (self.now(), self.last_words());
        self.oracle.ended(now, code, &last_words);
        let end = match code {
            Some(0) => "achieved".to_owned(),
            Some(3) => "landed, objectives failed".to_owned(),
            Some(4) => "landed, emergency".to_owned(),
            Some(code) => format!("exit code {code}"),
            None => NOT_BACK.to_owned(),
        };
        self.after_hold(end)
    }

    fn after_hold(&self, end: String) -> String {
        match &self.last_order {
            Some(reason) => format!("held ({reason}), ordered down, {end}"),
            None => end,
        }
    }

    /// What the launcher said last.
    pub(super) fn last_words(&self) -> String {
        let said = self.story.iter().rev().map(|it| it.1.as_str()).find(|it| !it.starts_with("chaos: "));
        said.unwrap_or("nothing was said").to_owned()
    }
}
