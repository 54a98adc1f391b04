//! What raises a flag in the manager.

use domain::contingency::Then;
use domain::measured::Measured;

use super::{SELF, World};
use crate::journal::Entry;

impl World {
    /// Raises a flag that has a row; of one without a row only the first event is recorded.
    pub(super) fn raise(&mut self, name: &str, source: impl Into<String>, reason: impl Into<String>) {
        self.raise_by(name, source, reason, None);
    }

    /// The same for a flag that is raised by a value.
    pub(super) fn raise_by(
        &mut self,
        name: &str,
        source: impl Into<String>,
        reason: impl Into<String>,
        measured: Option<Measured>,
    ) {
        match self.flags.number(name) {
            None => {}
            // The touchdown that it is about stays what it was.
            Some(row) if self.setup.table.rows()[row].then == Then::Crashed && self.landings.crash.is_some() => {}
            Some(row) => {
                let reason = reason.into();
                if self.flags.raise(self.now.time, row, source.into(), reason.clone(), measured) {
                    self.out.journal.decided(self.now, Entry::Raised(row, reason, measured));
                }
            }
        }
    }

    /// The transition action failed: its row takes over within this tick, before anything is sent.
    pub(crate) fn raise_transition_failed(&mut self, why: &str) {
        self.raise(domain::contingency::TRANSITION_FAILED, SELF, why);
        self.take_decision();
    }

    /// The mission is over and the vehicle flies: its row brings it down.
    pub(crate) fn raise_ended_in_air(&mut self) {
        let reason = self.over().unwrap_or_default().to_owned();
        self.raise(domain::contingency::ENDED_IN_AIR, SELF, format!("over in the air: {reason}"));
    }
}
