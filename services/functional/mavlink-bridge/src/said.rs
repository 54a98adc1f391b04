//! What the bridge says to the autopilot: payloads, and the numbers of commands and modes.

use autopilot::command::NumberedCommand;

use crate::frame::Frame;

/// Our own component: an onboard computer (MAV_COMP_ID_ONBOARD_COMPUTER). Never 1, which is the autopilot itself: ArduPilot drops that
/// as its own echo.
pub(crate) const OUR_COMPONENT: u8 = 191;

/// MAV_CMD, those that are used.
pub(crate) mod command {
    pub(crate) const TAKEOFF: u16 = 22;
    pub(crate) const SET_MODE: u16 = 176;
    pub(crate) const GRIPPER: u16 = 211;
    pub(crate) const ARM: u16 = 400;
    pub(crate) const SET_INTERVAL: u16 = 511;
    pub(crate) const REQUEST_MESSAGE: u16 = 512;
}

/// A command of seven numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CommandLong {
    /// MAV_CMD.
    pub(crate) command: u16,
    /// Its parameters.
    pub(crate) params: [f32; 7],
}

impl CommandLong {
    /// With the first parameters, the others 0.
    pub(crate) fn new<const N: usize>(command: u16, first: [f32; N]) -> CommandLong {
        let mut params = [0.0; 7];
        params[..N].copy_from_slice(&first);
        CommandLong { command, params }
    }
}

/// Something to be sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Said {
    /// That we are there.
    Heartbeat,
    /// A command; `confirmation` counts repetitions.
    Command {
        /// What to do.
        command: CommandLong,
        /// 0 at first.
        confirmation: u8,
    },
    /// A setpoint.
    Setpoint(Target),
    /// A request to read a parameter.
    ParameterRead([u8; 16]),
    /// A request to change a parameter.
    ParameterSet {
        /// Its name.
        name: [u8; 16],
        /// Its value as it travels.
        value: f32,
        /// MAV_PARAM_TYPE.
        kind: u8,
    },
}

impl From<NumberedCommand> for Said {
    fn from(NumberedCommand { number, params, repeats }: NumberedCommand) -> Said {
        let command = CommandLong { command: number, params: params.map(|it| it as f32) };
        Said::Command { command, confirmation: repeats }
    }
}

/// A setpoint in the local frame; what is `None` is ignored by the autopilot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Target {
    /// NED.
    pub(crate) position: Option<[f64; 3]>,
    /// NED.
    pub(crate) velocity: Option<[f64; 3]>,
    /// From north over east.
    pub(crate) yaw_rad: Option<f64>,
    /// Turn rate.
    pub(crate) yaw_rate_rad_s: Option<f64>,
}

impl Target {
    /// POSITION_TARGET_TYPEMASK: what is to be ignored. Accelerations always are.
    pub(crate) fn mask(&self) -> u16 {
        const ACCELERATION: u16 = 0x1C0;
        let part = |is_there: bool, bits: u16| if is_there { 0 } else { bits };
        ACCELERATION
            | part(self.position.is_some(), 0x007)
            | part(self.velocity.is_some(), 0x038)
            | part(self.yaw_rad.is_some(), 0x400)
            | part(self.yaw_rate_rad_s.is_some(), 0x800)
    }

    /// Whether every number in it is one. ArduPilot stops at one that is not.
    pub(crate) fn is_finite(&self) -> bool {
        let vectors = self.position.into_iter().chain(self.velocity).flatten();
        vectors.chain(self.yaw_rad).chain(self.yaw_rate_rad_s).all(f64::is_finite)
    }
}

/// Writes frames of our component for one vehicle.
#[derive(Debug, Default)]
pub(crate) struct Speaker {
    sequence: u8,
}

impl Speaker {
    /// The frame of `said` to the autopilot of `system`.
    pub(crate) fn frame(&mut self, said: Said, system: u8) -> Frame {
        let (id, payload) = payload(said, system);
        self.sequence = self.sequence.wrapping_add(1);
        Frame::new(self.sequence, system, OUR_COMPONENT, id, &payload)
    }
}

fn payload(said: Said, system: u8) -> (u32, Vec<u8>) {
    /// The autopilot's component. ArduPilot would also obey a command to a component that does not exist.
    const AUTOPILOT: u8 = 1;
    match said {
        // An onboard controller (18) that is not an autopilot (8) and is active (4).
        Said::Heartbeat => (0, vec![0, 0, 0, 0, 18, 8, 0, 4, 3]),
        Said::Command { command: CommandLong { command, params }, confirmation } => {
            let mut payload = params.iter().flat_map(|it| it.to_le_bytes()).collect::<Vec<_>>();
            payload.extend(command.to_le_bytes());
            payload.extend([system, AUTOPILOT, confirmation]);
            (76, payload)
        }
        Said::Setpoint(target) => {
            let [x, y, z] = target.position.unwrap_or_default();
            let [vx, vy, vz] = target.velocity.unwrap_or_default();
            let (yaw, yaw_rate) = (target.yaw_rad.unwrap_or(0.0), target.yaw_rate_rad_s.unwrap_or(0.0));
            // Both autopilots ignore the time.
            let mut payload = 1_u32.to_le_bytes().to_vec();
            let numbers = [x, y, z, vx, vy, vz, 0.0, 0.0, 0.0, yaw, yaw_rate];
            payload.extend(numbers.iter().flat_map(|it| (*it as f32).to_le_bytes()));
            payload.extend(target.mask().to_le_bytes());
            // MAV_FRAME_LOCAL_NED.
            payload.extend([system, AUTOPILOT, 1]);
            (84, payload)
        }
        Said::ParameterRead(name) => {
            let mut payload = (-1_i16).to_le_bytes().to_vec();
            payload.extend([system, AUTOPILOT]);
            payload.extend(name);
            (20, payload)
        }
        Said::ParameterSet { name, value, kind } => {
            let mut payload = value.to_le_bytes().to_vec();
            payload.extend([system, AUTOPILOT]);
            payload.extend(name);
            payload.push(kind);
            (23, payload)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mavlink::dialects::ardupilotmega::MavMessage;
    use mavlink::{MavlinkVersion, Message as _};

    fn parsed(said: Said) -> MavMessage {
        let frame = Speaker::default().frame(said, 3);
        assert_eq!((frame.system(), frame.component()), (3, 191));
        MavMessage::parse(MavlinkVersion::V2, frame.id(), frame.payload()).expect("the dialect reads it")
    }

    #[test]
    fn the_dialect_reads_what_is_said() {
        assert!(matches!(parsed(Said::Heartbeat), MavMessage::HEARTBEAT(_)));
        let command = CommandLong::new(command::TAKEOFF, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 12.5]);
        let MavMessage::COMMAND_LONG(it) = parsed(Said::Command { command, confirmation: 2 }) else { panic!() };
        assert_eq!((it.param7, it.target_system, it.target_component, it.confirmation), (12.5, 3, 1, 2));
        let target = Target { position: Some([1.0, 2.0, -3.0]), velocity: None, yaw_rad: None, yaw_rate_rad_s: None };
        let MavMessage::SET_POSITION_TARGET_LOCAL_NED(it) = parsed(Said::Setpoint(target)) else { panic!() };
        assert_eq!((it.x, it.y, it.z, it.type_mask.bits(), it.target_system), (1.0, 2.0, -3.0, 0xDF8, 3));
        let mut name = [0; 16];
        name[..7].copy_from_slice(b"FS_TEST");
        assert!(matches!(parsed(Said::ParameterRead(name)), MavMessage::PARAM_REQUEST_READ(_)));
        let MavMessage::PARAM_SET(it) = parsed(Said::ParameterSet { name, value: 1.0, kind: 9 }) else { panic!() };
        assert_eq!(it.param_value, 1.0);
    }

    #[test]
    fn the_mask_says_what_is_ignored() {
        #[track_caller]
        fn check(position: bool, velocity: bool, expected: u16) {
            let vector = |is_there: bool| is_there.then_some([0.0; 3]);
            let target =
                Target { position: vector(position), velocity: vector(velocity), yaw_rad: None, yaw_rate_rad_s: None };
            assert_eq!(target.mask(), expected);
        }
        check(true, false, 0xDF8);
        check(false, true, 0xDC7);
        check(true, true, 0xDC0);
    }
}
