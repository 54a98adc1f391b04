//! Who else has a say in what the vehicle flies: a pilot or another ground station, a failsafe of the autopilot that has no cause in the
//! simulation, and checks that forbid arming. All of them are faults.

use crate::pilot::Mode;

/// What somebody or something else has decided.
#[derive(Debug, Clone, Default)]
pub(crate) struct Others {
    /// The mode was chosen by somebody else since the last command.
    chosen: bool,
    /// The mode that a failsafe flies, and why.
    failsafe: Option<(Mode, String)>,
    /// Why the autopilot would not arm.
    pub(crate) not_ready: Option<String>,
}

impl Others {
    /// Somebody else chooses the mode.
    pub(crate) fn choose(&mut self) {
        (self.chosen, self.failsafe) = (true, None);
    }

    /// Whether somebody else has chosen the mode that was set last.
    pub(crate) fn has_chosen(&self) -> bool {
        self.chosen
    }

    /// A failsafe flies `mode`, until a mode is commanded or it ends.
    pub(crate) fn begin_failsafe(&mut self, mode: Mode, why: String) {
        self.failsafe = Some((mode, why));
    }

    /// The cause of the failsafe is gone.
    pub(crate) fn end_failsafe(&mut self) {
        self.failsafe = None;
    }

    /// The mode that a failsafe flies.
    pub(crate) fn failsafe(&self) -> Option<Mode> {
        self.failsafe.as_ref().map(|(mode, _)| *mode)
    }

    /// Why it flies it.
    pub(crate) fn why(&self) -> Option<&str> {
        self.failsafe.as_ref().map(|(_, why)| why.as_str())
    }

    /// The autopilot was started again, or a command was taken that sets a mode, as arming does after somebody else's. A change of mode ends a failsafe, as PX4 has it.
    pub(crate) fn commanded(&mut self) {
        (self.chosen, self.failsafe) = (false, None);
    }
}
