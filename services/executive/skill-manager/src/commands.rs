//! Commands to the autopilot: one in flight at a time, each answered or given up.

use std::fmt;
use std::time::Duration;

use domain::time::{Now, Time};
use kittiwake_proto::v1::{self, FlightMode};

use crate::fsm::SkillId;

/// What the autopilot can be told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// Let the motors turn.
    Arm,
    /// Stop them.
    Disarm,
    /// Climb to a height above the origin.
    Takeoff {
        /// That height.
        altitude_m: f64,
    },
    /// Land here.
    Land,
    /// Come to rest here.
    Loiter,
    /// Follow the setpoints.
    Offboard,
}

impl Command {
    /// Its message.
    pub fn to_wire(self, id: u64) -> v1::VehicleCommand {
        use v1::vehicle_command::Command as C;
        let set_mode = |mode: FlightMode| C::SetMode(v1::SetMode { mode: mode as i32 });
        let command = match self {
            Command::Arm => C::Arm(v1::Arm {}),
            Command::Disarm => C::Disarm(v1::Disarm {}),
            Command::Takeoff { altitude_m } => C::Takeoff(v1::TakeoffCommand { altitude_m }),
            Command::Land => C::Land(v1::LandCommand {}),
            Command::Loiter => set_mode(FlightMode::Loiter),
            Command::Offboard => set_mode(FlightMode::Offboard),
        };
        v1::VehicleCommand { id, command: Some(command) }
    }
}

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Command::Arm => f.write_str("arm"),
            Command::Disarm => f.write_str("disarm"),
            Command::Takeoff { altitude_m } => write!(f, "takeoff to {altitude_m:.1} m"),
            Command::Land => f.write_str("land"),
            Command::Loiter => f.write_str("loiter"),
            Command::Offboard => f.write_str("offboard"),
        }
    }
}

/// What a command is sent for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// To start this skill.
    Start(SkillId),
    /// To cancel this skill.
    Cancel(SkillId),
    /// To undo the arming of a takeoff that was refused.
    UndoArming,
    /// To hold a vehicle that no skill flies.
    Idle,
}

/// A command that is not answered yet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InFlight {
    id: u64,
    until: Time,
    /// What was sent.
    pub command: Command,
    /// And what for.
    pub purpose: Purpose,
}

/// What became of a command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Answer {
    /// Taken; whether it happens is what the vehicle's data will show.
    Accepted,
    /// Refused by the autopilot, with its reason.
    Rejected(String),
    /// Not acknowledged in time; the vehicle may have obeyed all the same.
    Unanswered,
}

/// The only way to the autopilot.
#[derive(Debug)]
pub struct CommandLine {
    timeout: Duration,
    next_id: u64,
    in_flight: Option<InFlight>,
}

impl CommandLine {
    /// A free line; commands are given up after `timeout`, in mission time.
    pub fn new(timeout: Duration) -> CommandLine {
        CommandLine { timeout, next_id: 0, in_flight: None }
    }

    /// Whether a command waits for its answer, so that no other may go out.
    pub fn is_busy(&self) -> bool {
        self.in_flight.is_some()
    }

    /// Sends a command; the line must not be busy.
    pub fn send(&mut self, command: Command, purpose: Purpose, now: Now) -> v1::VehicleCommand {
        debug_assert!(!self.is_busy(), "one command in flight at a time");
        let id = next_id(&mut self.next_id, now);
        self.in_flight = Some(InFlight { id, until: now.time + self.timeout, command, purpose });
        command.to_wire(id)
    }

    /// The command that an acknowledgement answers. A second one for the same command, one that
    /// comes too late, and one for somebody else's command answer nothing.
    pub fn answered(&mut self, id: u64) -> Option<InFlight> {
        self.in_flight.take_if(|it| it.id == id)
    }

    /// The command that is given up at this moment.
    pub fn given_up(&mut self, now: Time) -> Option<InFlight> {
        self.in_flight.take_if(|it| it.until <= now)
    }

    /// When the command in flight will be given up.
    pub fn deadline(&self) -> Option<Time> {
        self.in_flight.map(|it| it.until)
    }
}

/// The next of a row of ids. The first one counts from the date, so that a process that was
/// restarted does not take the ids, and the late answers, of its former life for its own.
pub fn next_id(last: &mut u64, now: Now) -> u64 {
    if *last == 0 {
        *last = u64::try_from(now.utc_ms).unwrap_or(0);
    }
    *last += 1;
    *last
}
