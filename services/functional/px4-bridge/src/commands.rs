//! Commands of the vocabulary as PX4's, and what its answers mean.

use domain::fmu::{Command, CommandId};
use domain::time::Time;

use crate::cdr::{CdrError, Definition, Record};
use crate::modes::NavState;

/// Who the bridge is among the components of its vehicle: the onboard computer (`MAV_COMP_ID_ONBOARD_COMPUTER`). The answer names
/// it, so that those to others are told apart.
pub(crate) const COMPONENT: u8 = 191;

/// PX4's numbers of commands (`VEHICLE_CMD_*`, MAVLink's `MAV_CMD_*`).
const LAND: u32 = 21;
const TAKEOFF: u32 = 22;
const SET_MODE: u32 = 176;
const GRIPPER: u32 = 211;
const ARM_DISARM: u32 = 400;
/// `MAV_MODE_FLAG_CUSTOM_MODE_ENABLED`, and PX4's numbers of main and sub modes.
const CUSTOM: f64 = 1.0;
const MAIN_AUTO: f64 = 4.0;
const MAIN_OFFBOARD: f64 = 6.0;
const SUB_LOITER: f64 = 3.0;

/// A command in PX4's words.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Px4Command {
    /// Its number, which the answer repeats.
    pub(crate) number: u32,
    params: [f64; 7],
}

impl Px4Command {
    /// Stand still in Hold.
    pub(crate) fn hold() -> Px4Command {
        Px4Command { number: SET_MODE, params: [CUSTOM, MAIN_AUTO, SUB_LOITER, 0.0, 0.0, 0.0, 0.0] }
    }

    /// `command`; a takeoff counts its height from `origin_amsl_m`. `None` where that is needed and not known.
    pub(crate) fn of(command: Command, origin_amsl_m: Option<f64>) -> Option<Px4Command> {
        const NAN: f64 = f64::NAN;
        let (number, params) = match command {
            Command::Arm => (ARM_DISARM, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
            Command::Disarm => (ARM_DISARM, [0.0; 7]),
            // Where it stands, without a heading, up to an altitude above mean sea level.
            Command::Takeoff { height_m } => (TAKEOFF, [NAN, NAN, NAN, NAN, NAN, NAN, origin_amsl_m? + height_m]),
            Command::Land | Command::LandOnTarget => (LAND, [0.0, 0.0, 0.0, NAN, NAN, NAN, NAN]),
            Command::Loiter => return Some(Px4Command::hold()),
            Command::Offboard => (SET_MODE, [CUSTOM, MAIN_OFFBOARD, 0.0, 0.0, 0.0, 0.0, 0.0]),
            // Gripper 1, action 0: release.
            Command::Release => (GRIPPER, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        };
        Some(Px4Command { number, params })
    }

    /// Its message to PX4's system `target`, sent for the `repeats`th time after the first.
    ///
    /// # Errors
    /// If this version of the message lacks a field.
    pub(crate) fn encode(self, definition: &Definition, target: (u8, u8), repeats: u8) -> Result<Vec<u8>, CdrError> {
        const PARAMS: [&str; 7] = ["param1", "param2", "param3", "param4", "param5", "param6", "param7"];
        let mut record = Record::zero(definition);
        for (name, value) in PARAMS.into_iter().zip(self.params) {
            record.set_number(name, value)?;
        }
        record.set_number("command", f64::from(self.number))?;
        record.set_number("target_system", f64::from(target.0))?;
        record.set_number("target_component", f64::from(target.1))?;
        record.set_number("source_system", f64::from(target.0))?;
        record.set_number("source_component", f64::from(COMPONENT))?;
        record.set_number("confirmation", f64::from(repeats))?;
        record.set_flag("from_external", true)?;
        Ok(record.encode())
    }
}

/// PX4's answer to a command of ours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Answer {
    /// Taken.
    Accepted,
    /// Not decided yet.
    InProgress,
    /// Not taken, for this reason.
    Refused(&'static str),
}

impl Answer {
    /// The answer in `ack`, with the number of the command; `None` for one to somebody else.
    ///
    /// # Errors
    /// If this version of the message lacks a field.
    pub(crate) fn read(ack: &Record<'_>) -> Result<Option<(u32, Answer)>, CdrError> {
        if ack.unsigned("target_component")? != u64::from(COMPONENT) {
            return Ok(None);
        }
        let answer = match ack.unsigned("result")? {
            0 => Answer::Accepted,
            1 => Answer::Refused("not now"),
            2 => Answer::Refused("denied"),
            3 => Answer::Refused("not supported"),
            4 => Answer::Refused("failed"),
            5 => Answer::InProgress,
            6 => Answer::Refused("cancelled"),
            _ => Answer::Refused("for a reason without a name"),
        };
        Ok(Some((ack.unsigned("command")? as u32, answer)))
    }
}

/// A command that PX4 has not answered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pending {
    /// The id that the acknowledgement echoes.
    pub(crate) id: CommandId,
    /// What was asked for.
    pub(crate) command: Command,
    /// How far it is.
    pub(crate) step: Step,
    /// When it came.
    pub(crate) since: Time,
    /// How often it came again.
    pub(crate) repeats: u8,
}

/// How far a command is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Step {
    /// Hold is set before the motors are armed: after a landing the mode is one in which PX4 refuses that.
    SetsHold,
    /// PX4 took that; the motors are armed once it is seen.
    AwaitsHold,
    /// The command itself was sent.
    Sent,
}

impl Pending {
    /// What PX4 is to do in this step, and the mode that it sets.
    pub(crate) fn px4(&self, origin_amsl_m: Option<f64>) -> Option<(Px4Command, Option<NavState>)> {
        match self.step {
            Step::SetsHold | Step::AwaitsHold => Some((Px4Command::hold(), Some(NavState::LOITER))),
            Step::Sent => Some((Px4Command::of(self.command, origin_amsl_m)?, NavState::of(self.command))),
        }
    }
}
