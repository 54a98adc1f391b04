//! Commands of the vocabulary as PX4's, and what its answers mean.

use autopilot::command::NumberedCommand;
use autopilot::gripper;
use domain::fmu::{Command, CommandId};
use domain::time::Time;

use crate::cdr::{CdrError, Definition, Record};
use crate::modes::NavState;

/// Who the bridge is among the components of its vehicle: the onboard computer (`MAV_COMP_ID_ONBOARD_COMPUTER`). The answer names
/// it, so that those to others are told apart.
pub(crate) const COMPONENT: u8 = 191;

/// PX4's numbers of commands (`VEHICLE_CMD_*`, MAVLink's `MAV_CMD_*`).
const LAND: u16 = 21;
const TAKEOFF: u16 = 22;
const SET_MODE: u16 = 176;
const ARM_DISARM: u16 = 400;
/// `MAV_MODE_FLAG_CUSTOM_MODE_ENABLED`, and PX4's numbers of main and sub modes.
const CUSTOM: f64 = 1.0;
const MAIN_AUTO: f64 = 4.0;
const MAIN_OFFBOARD: f64 = 6.0;
const SUB_LOITER: f64 = 3.0;
const SUB_PRECISION_LAND: f64 = 9.0;

/// Stand still in Hold.
pub(crate) fn hold() -> NumberedCommand {
    set_mode(MAIN_AUTO, SUB_LOITER)
}

fn set_mode(main: f64, sub: f64) -> NumberedCommand {
    NumberedCommand { number: SET_MODE, params: [CUSTOM, main, sub, 0.0, 0.0, 0.0, 0.0], repeats: 0 }
}

/// `command` in PX4's words; a takeoff counts its height from `origin_amsl_m`. `None` where that is needed and not known.
fn numbered(command: Command, origin_amsl_m: Option<f64>) -> Option<NumberedCommand> {
    const NAN: f64 = f64::NAN;
    let (number, params) = match command {
        Command::Arm => (ARM_DISARM, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        Command::Disarm => (ARM_DISARM, [0.0; 7]),
        // Where it stands, without a heading, up to an altitude above mean sea level.
        Command::Takeoff { height_m } => (TAKEOFF, [NAN, NAN, NAN, NAN, NAN, NAN, origin_amsl_m? + height_m]),
        Command::Land => (LAND, [0.0, 0.0, 0.0, NAN, NAN, NAN, NAN]),
        Command::LandOnTarget => return Some(set_mode(MAIN_AUTO, SUB_PRECISION_LAND)),
        Command::Loiter => return Some(hold()),
        Command::Offboard => return Some(set_mode(MAIN_OFFBOARD, 0.0)),
        // Gripper 1, action 0: release.
        Command::Release => (gripper::COMMAND, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    };
    Some(NumberedCommand { number, params, repeats: 0 })
}

/// The message of `command` to PX4's system `target`.
///
/// # Errors
/// If this version of the message lacks a field.
pub(crate) fn encode(
    command: &NumberedCommand,
    definition: &Definition,
    target: (u8, u8),
) -> Result<Vec<u8>, CdrError> {
    const PARAMS: [&str; 7] = ["param1", "param2", "param3", "param4", "param5", "param6", "param7"];
    let mut record = Record::zero(definition);
    for (name, value) in PARAMS.into_iter().zip(command.params) {
        record.set_number(name, value)?;
    }
    record.set_number("command", f64::from(command.number))?;
    record.set_number("target_system", f64::from(target.0))?;
    record.set_number("target_component", f64::from(target.1))?;
    record.set_number("source_system", f64::from(target.0))?;
    record.set_number("source_component", f64::from(COMPONENT))?;
    record.set_number("confirmation", f64::from(command.repeats))?;
    record.set_flag("from_external", true)?;
    Ok(record.encode())
}

/// PX4's acknowledgement of a command of ours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Ack {
    /// The number of the command.
    pub(crate) number: u16,
    /// `VEHICLE_CMD_RESULT_*`, MAVLink's `MAV_RESULT`.
    pub(crate) result: u8,
}

impl Ack {
    /// What `ack` says; `None` for one to somebody else, and for commands that only PX4 itself gives.
    ///
    /// # Errors
    /// If this version of the message lacks a field.
    pub(crate) fn read(ack: &Record<'_>) -> Result<Option<Ack>, CdrError> {
        let (number, result) = (ack.unsigned("command")?, ack.unsigned("result")? as u8);
        let is_ours = ack.unsigned("target_component")? == u64::from(COMPONENT);
        Ok(u16::try_from(number).ok().filter(|_| is_ours).map(|number| Ack { number, result }))
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
    /// What a result means.
    pub(crate) fn of(result: u8) -> Answer {
        match result {
            0 => Answer::Accepted,
            1 => Answer::Refused("not now"),
            2 => Answer::Refused("denied"),
            3 => Answer::Refused("not supported"),
            4 => Answer::Refused("failed"),
            5 => Answer::InProgress,
            6 => Answer::Refused("cancelled"),
            _ => Answer::Refused("for a reason without a name"),
        }
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
    pub(crate) fn px4(&self, origin_amsl_m: Option<f64>) -> Option<(NumberedCommand, Option<NavState>)> {
        let (px4, mode) = match self.step {
            Step::SetsHold | Step::AwaitsHold => (hold(), Some(NavState::LOITER)),
            Step::Sent => (numbered(self.command, origin_amsl_m)?, NavState::of(self.command)),
        };
        Some((NumberedCommand { repeats: self.repeats, ..px4 }, mode))
    }
}
