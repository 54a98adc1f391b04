//! Commands and acknowledgements.

use kittiwake_proto::v1;

use crate::fmu::{Command, CommandAck, CommandId, CommandResult, VehicleCommand};
use crate::wire::{InvalidMessage, finite, out_of_range};

impl From<VehicleCommand> for v1::VehicleCommand {
    fn from(VehicleCommand { id, command }: VehicleCommand) -> v1::VehicleCommand {
        use v1::vehicle_command::Command as C;
        let set_mode = |mode: v1::FlightMode| C::SetMode(v1::SetMode { mode: mode as i32 });
        let command = match command {
            Command::Arm => C::Arm(v1::Arm {}),
            Command::Disarm => C::Disarm(v1::Disarm {}),
            Command::Takeoff { height_m } => C::Takeoff(v1::TakeoffCommand { altitude_m: height_m }),
            Command::Land | Command::LandOnTarget => {
                C::Land(v1::LandCommand { on_target: command == Command::LandOnTarget })
            }
            Command::Loiter => set_mode(v1::FlightMode::Loiter),
            Command::Offboard => set_mode(v1::FlightMode::Offboard),
            Command::Release => C::Release(v1::ReleaseCommand {}),
        };
        v1::VehicleCommand { id: id.0, command: Some(command) }
    }
}

/// An invalid command has an id as well, that of its message, with which it is rejected.
impl TryFrom<v1::VehicleCommand> for VehicleCommand {
    type Error = InvalidMessage;
    fn try_from(message: v1::VehicleCommand) -> Result<VehicleCommand, InvalidMessage> {
        use v1::vehicle_command::Command as C;
        let command = match message.command.ok_or(InvalidMessage::Missing("command"))? {
            C::Arm(_) => Command::Arm,
            C::Disarm(_) => Command::Disarm,
            C::Takeoff(takeoff) => Command::Takeoff { height_m: finite("altitude_m", takeoff.altitude_m)? },
            C::Land(it) if it.on_target => Command::LandOnTarget,
            C::Land(_) => Command::Land,
            C::Release(_) => Command::Release,
            C::SetMode(set_mode) => match set_mode.mode() {
                v1::FlightMode::Loiter => Command::Loiter,
                v1::FlightMode::Offboard => Command::Offboard,
                v1::FlightMode::Unspecified
                | v1::FlightMode::Takeoff
                | v1::FlightMode::Land
                | v1::FlightMode::Return => return Err(out_of_range("mode", set_mode.mode(), "Loiter or Offboard")),
            },
        };
        Ok(VehicleCommand { id: CommandId(message.id), command })
    }
}

impl From<CommandAck> for v1::VehicleCommandAck {
    fn from(ack: CommandAck) -> v1::VehicleCommandAck {
        let (result, reason) = match ack.result {
            CommandResult::Accepted => (v1::CommandResult::Accepted, String::new()),
            CommandResult::Rejected { reason } => (v1::CommandResult::Rejected, reason),
        };
        v1::VehicleCommandAck { id: ack.id.0, result: result as i32, reason }
    }
}

impl TryFrom<v1::VehicleCommandAck> for CommandAck {
    type Error = InvalidMessage;
    fn try_from(message: v1::VehicleCommandAck) -> Result<CommandAck, InvalidMessage> {
        let result = match message.result() {
            v1::CommandResult::Accepted => CommandResult::Accepted,
            v1::CommandResult::Rejected => CommandResult::Rejected { reason: message.reason },
            v1::CommandResult::Unspecified => return Err(InvalidMessage::Missing("result")),
        };
        Ok(CommandAck { id: CommandId(message.id), result })
    }
}
