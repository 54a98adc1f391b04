//! Who flies the vehicle: the skill manager, or somebody else, a pilot or another ground station.
//!
//! A real autopilot obeys the last command, also ours against a pilot's hands: not to fight is our own rule. So as soon
//! as somebody else flies, nothing is commanded any more, and nothing is again before an operator orders it
//! ([`Control::take_back`]) or the vehicle stands with its motors off.
//!
//! Two witnesses say that somebody else flies: the backend ([`domain::fmu::Status::is_flown_by_other`]), and a mode that differs from the
//! one that was commanded here last. The second one outlives a restart of the backend, the first one of this process. Where both are
//! started again at once the mission manager remembers it, and asks for nothing.

use domain::fmu::{Command, FlightMode};

use crate::vehicle::FlightStatus;

/// Who flies, and what is expected to be flown.
#[derive(Debug, Default)]
pub(crate) struct Control {
    who: Who,
    expected: Option<Expected>,
}

#[derive(Debug, Default, PartialEq, Eq)]
enum Who {
    /// This process, or nobody.
    #[default]
    Here,
    /// Somebody else, as seen by this.
    Other(String),
    /// An operator has ordered to take control back: until the vehicle is seen to obey, it still is what it was.
    Taking,
}

/// The mode that was commanded last.
#[derive(Debug, Clone, Copy)]
struct Expected {
    mode: FlightMode,
    /// The vehicle was seen in it: before that, another mode says nothing.
    seen: bool,
}

impl Control {
    /// How it is known that somebody else flies; `None`: nobody else does.
    pub(crate) fn other(&self) -> Option<&str> {
        match &self.who {
            Who::Other(how) => Some(how),
            Who::Here | Who::Taking => None,
        }
    }

    /// A command was accepted. One that sets a mode is expected to be obeyed.
    pub(crate) fn commanded(&mut self, command: Command) {
        if let Some(mode) = command.mode() {
            self.expected = Some(Expected { mode, seen: false });
        }
    }

    /// What the vehicle flies cannot be expected any more: a command may have been obeyed or not, or the autopilot was started again.
    pub(crate) fn expect_nothing(&mut self) {
        self.expected = None;
    }

    /// An operator has ordered to take control back.
    pub(crate) fn take_back(&mut self) {
        if self.other().is_some() {
            self.who = Who::Taking;
            self.expected = None;
        }
    }

    /// Takes in a status, with the `words` of the autopilot. `settled`: no command is on its way; `is_busy`: a skill runs or waits; `stands`: the vehicle does not fly.
    /// Returns how it is seen that somebody else flies, if that is so since this status.
    pub(crate) fn judge(
        &mut self,
        status: FlightStatus,
        words: &str,
        settled: bool,
        is_busy: bool,
        stands: bool,
    ) -> Option<&str> {
        if !status.armed && stands {
            // Nobody flies.
            *self = Control::default();
            return None;
        }
        let deviates = settled && self.deviates(status);
        let how = match &self.who {
            Who::Other(_) => return None,
            Who::Taking if !status.of_other => {
                self.who = Who::Here;
                return None;
            }
            Who::Taking if is_busy => return None,
            Who::Here | Who::Taking if status.of_other => "somebody else has chosen the mode",
            Who::Here | Who::Taking if deviates => "the mode is not the one that was commanded",
            Who::Here | Who::Taking => return None,
        };
        let mode = status.intended.map_or_else(|| "one without a name here".to_owned(), |it| it.to_string());
        let words = if words.is_empty() { String::new() } else { format!(": {words}") };
        self.who = Who::Other(format!("{how}: {mode}{words}"));
        self.other()
    }

    /// Whether the intended mode is another one than was commanded last, once that was seen.
    fn deviates(&mut self, status: FlightStatus) -> bool {
        let Some(expected) = &mut self.expected else { return false };
        match status.intended {
            Some(mode) if mode == expected.mode => expected.seen = true,
            // At its height a takeoff becomes a loiter by itself.
            Some(FlightMode::Loiter) if expected.mode == FlightMode::Takeoff && expected.seen => {
                expected.mode = FlightMode::Loiter;
            }
            // Where the autopilot itself has changed the mode it says so.
            _ => return expected.seen && status.armed && !status.failsafe,
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use FlightMode::{Land, Loiter, Offboard, Takeoff};

    fn status(intended: Option<FlightMode>, of_other: bool) -> FlightStatus {
        FlightStatus { intended, actual: intended, of_other, ..FlightStatus::flying() }
    }

    #[test]
    fn the_backend_says_it_or_the_mode_is_not_the_one_that_was_commanded() {
        /// Commands, then statuses; whether somebody else flies after them.
        #[track_caller]
        fn check(command: Option<Command>, statuses: &[(Option<FlightMode>, bool)], expected: bool) {
            let mut control = Control::default();
            command.into_iter().for_each(|it| control.commanded(it));
            for (intended, of_other) in statuses {
                control.judge(status(*intended, *of_other), "", true, true, false);
            }
            assert_eq!(control.other().is_some(), expected, "{command:?} {statuses:?}");
        }
        check(None, &[(Some(Loiter), false)], false);
        check(None, &[(Some(Loiter), true)], true);
        check(None, &[(None, true), (Some(Loiter), false)], true);
        check(Some(Command::Offboard), &[(Some(Loiter), false), (Some(Offboard), false)], false);
        check(Some(Command::Offboard), &[(Some(Offboard), false), (Some(Loiter), false)], true);
        check(Some(Command::Offboard), &[(Some(Offboard), false), (None, false)], true);
        let climb = Command::Takeoff { height_m: 10.0 };
        check(Some(climb), &[(Some(Loiter), false), (Some(Takeoff), false), (Some(Loiter), false)], false);
        check(Some(climb), &[(Some(Takeoff), false), (Some(Loiter), false), (Some(Land), false)], true);
        check(Some(Command::Arm), &[(Some(Loiter), false), (Some(Land), false)], false);
    }

    #[test]
    fn a_status_that_came_before_the_answer_to_a_command_says_nothing_about_its_mode() {
        let mut control = Control::default();
        control.commanded(Command::Offboard);
        control.judge(status(Some(Offboard), false), "", true, true, false);
        assert_eq!(control.judge(status(Some(Loiter), false), "", false, true, false), None);
        assert!(control.judge(status(Some(Loiter), true), "", false, true, false).is_some(), "the backend says it");
    }

    #[test]
    fn control_comes_back_by_an_order_or_once_the_motors_are_off() {
        let mut control = Control::default();
        control.judge(status(None, true), "", true, true, false);
        control.judge(status(Some(Loiter), false), "", true, false, false);
        assert!(control.other().is_some(), "not by itself");
        control.take_back();
        assert_eq!(control.judge(status(None, true), "", true, true, false), None, "a skill is on its way to take it");
        control.judge(status(Some(Loiter), false), "", true, true, false);
        assert!(control.judge(status(None, true), "", true, true, false).is_some(), "taken again");
        control.take_back();
        assert!(control.judge(status(None, true), "", true, false, false).is_some(), "no skill has taken it");
        control.judge(FlightStatus { armed: false, ..status(None, true) }, "", true, false, true);
        assert_eq!(control.other(), None);
    }
}
