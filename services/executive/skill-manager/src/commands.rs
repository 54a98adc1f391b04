//! Commands to the autopilot: one in flight at a time, each acknowledged or given up.

use std::time::Duration;

use domain::fmu::{Command, CommandId, CommandResult, VehicleCommand};
use domain::time::{Now, Time};

use crate::fsm::SkillId;
use crate::ids::IdSequence;

/// Why a command is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// To start this skill.
    Start(SkillId),
    /// To cancel this skill.
    Cancel(SkillId),
    /// To disarm after a takeoff that armed the vehicle and was then refused.
    UndoArming,
    /// To hold a vehicle that no skill flies.
    Idle,
    /// For nothing any more: since it was sent, somebody else has begun to fly.
    Abandoned,
}

/// A command that was not acknowledged yet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct InFlight {
    id: CommandId,
    until: Time,
    /// Whether it was sent a second time.
    repeated: bool,
    /// What was sent.
    pub(crate) command: Command,
    /// Why.
    pub(crate) purpose: Purpose,
}

/// What became of a command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Acknowledgement {
    /// The autopilot took it or did not.
    Answered(CommandResult),
    /// It did not come in time; the vehicle may have obeyed nevertheless.
    Missing,
}

impl Acknowledgement {
    /// Whether the autopilot took the command.
    pub(crate) fn is_accepted(&self) -> bool {
        *self == Acknowledgement::Answered(CommandResult::Accepted)
    }

    /// What became of `command`, for operators: `land rejected: not now`.
    pub(crate) fn describe(&self, command: Command) -> String {
        match self {
            Acknowledgement::Answered(CommandResult::Accepted) => format!("{command} accepted"),
            Acknowledgement::Answered(CommandResult::Rejected { reason }) if reason.is_empty() => {
                format!("{command} rejected")
            }
            Acknowledgement::Answered(CommandResult::Rejected { reason }) => format!("{command} rejected: {reason}"),
            Acknowledgement::Missing => format!("{command} not acknowledged"),
        }
    }
}

impl InFlight {
    /// Whether it was sent a second time already.
    pub(crate) fn is_repeated(&self) -> bool {
        self.repeated
    }
}

/// Sends one command at a time.
#[derive(Debug)]
pub(crate) struct CommandLine {
    timeout: Duration,
    ids: IdSequence,
    in_flight: Option<InFlight>,
}

impl CommandLine {
    /// A free line; commands are given up after `timeout`, in mission time.
    pub(crate) fn new(timeout: Duration) -> CommandLine {
        CommandLine { timeout, ids: IdSequence::default(), in_flight: None }
    }

    /// Whether a command waits for its acknowledgement, so that no other may be sent.
    pub(crate) fn is_busy(&self) -> bool {
        self.in_flight.is_some()
    }

    /// Sends a command; the line must not be busy.
    pub(crate) fn send(&mut self, command: Command, purpose: Purpose, now: Now) -> VehicleCommand {
        debug_assert!(!self.is_busy(), "one command in flight at a time");
        let id = CommandId(self.ids.next(now));
        self.in_flight = Some(InFlight { id, until: now.time + self.timeout, repeated: false, command, purpose });
        VehicleCommand { id, command }
    }

    /// Sends a command that was given up once more, under its own number: an acknowledgement of either sending counts.
    pub(crate) fn repeat(&mut self, given_up: InFlight, now: Now) -> VehicleCommand {
        debug_assert!(!self.is_busy(), "one command in flight at a time");
        self.in_flight = Some(InFlight { until: now.time + self.timeout, repeated: true, ..given_up });
        VehicleCommand { id: given_up.id, command: given_up.command }
    }

    /// The command that an acknowledgement belongs to. A second one for the same command, one that
    /// comes too late, and one for the command of another sender belong to none.
    pub(crate) fn acknowledged(&mut self, id: CommandId) -> Option<InFlight> {
        self.in_flight.take_if(|it| it.id == id)
    }

    /// What becomes of the command in flight counts no longer, and it is not repeated. The line stays busy as long as the autopilot may
    /// still be at it.
    pub(crate) fn abandon(&mut self) {
        if let Some(in_flight) = &mut self.in_flight {
            in_flight.purpose = Purpose::Abandoned;
        }
    }

    /// The command that is given up at this moment.
    pub(crate) fn give_up(&mut self, now: Time) -> Option<InFlight> {
        self.in_flight.take_if(|it| it.until <= now)
    }

    /// When the command in flight will be given up.
    pub(crate) fn deadline(&self) -> Option<Time> {
        self.in_flight.map(|it| it.until)
    }
}
