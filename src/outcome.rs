//! How the program ends, as an exit code.

use kittiwake_proto::v1::MissionOutcome;

/// Why the program ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// All objectives achieved, or the command carried out.
    Success,
    /// The request could not be carried out: no process serves it, or no system runs.
    Unavailable,
    /// The mission cannot be flown as it is.
    NotFlyable,
    /// A simulated flight broke a rule, or a process one of the exchange of its skill.
    Breached,
    /// What was compared is not the same.
    Differs,
    /// A file or an argument is wrong; nothing was started.
    BadInput,
    /// The system refused the order.
    Refused,
    /// The gateway, or the process it asked, did not answer.
    Unreachable,
    /// The mission ended with objectives failed.
    ObjectivesFailed,
    /// The mission ended by an emergency response.
    Emergency,
    /// The vehicle crashed.
    Crash,
    /// The system could not be brought up or kept up.
    NotKeptUp,
    /// Ended by Ctrl-C or SIGTERM before the mission was over.
    Interrupted,
}

impl From<Outcome> for u8 {
    fn from(it: Outcome) -> u8 {
        match it {
            Outcome::Success => 0,
            Outcome::Unavailable | Outcome::NotFlyable | Outcome::Breached | Outcome::Differs => 1,
            Outcome::BadInput => 2,
            Outcome::ObjectivesFailed | Outcome::Refused => 3,
            Outcome::Emergency => 4,
            Outcome::NotKeptUp | Outcome::Unreachable => 5,
            Outcome::Crash => 6,
            // As shells report a process that SIGINT ended.
            Outcome::Interrupted => 130,
        }
    }
}

impl From<MissionOutcome> for Outcome {
    fn from(it: MissionOutcome) -> Outcome {
        match it {
            MissionOutcome::Success => Outcome::Success,
            MissionOutcome::Failure => Outcome::ObjectivesFailed,
            MissionOutcome::Emergency => Outcome::Emergency,
            MissionOutcome::Crash => Outcome::Crash,
            MissionOutcome::Unspecified => Outcome::NotKeptUp,
        }
    }
}
