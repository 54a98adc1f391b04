//! What the bridge says to the autopilot.

use mavlink_bridge::frame::Frame;

/// A message that the autopilots obey.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Received {
    /// COMMAND_LONG.
    Command {
        /// Whom it is for.
        target: (u8, u8),
        /// MAV_CMD.
        command: u16,
        /// Its parameters.
        params: [f32; 7],
    },
    /// SET_POSITION_TARGET_LOCAL_NED.
    Setpoint {
        /// Whom it is for.
        target: (u8, u8),
        /// POSITION_TARGET_TYPEMASK.
        mask: u16,
        /// NED.
        position: [f64; 3],
        /// NED.
        velocity: [f64; 3],
    },
}

impl Received {
    /// Whether it is for this autopilot.
    pub(crate) fn is_for(&self, system: u8) -> bool {
        let (Received::Command { target, .. } | Received::Setpoint { target, .. }) = self;
        target.0 == system && target.1 <= 1
    }
}

/// What a frame says.
pub(crate) fn received(frame: &Frame) -> Option<Received> {
    let mut bytes = frame.payload().to_vec();
    bytes.resize(64, 0);
    let float = |at: usize| f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
    let short = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
    match frame.id() {
        76 => Some(Received::Command {
            target: (bytes[30], bytes[31]),
            command: short(28),
            params: std::array::from_fn(|i| float(4 * i)),
        }),
        84 => Some(Received::Setpoint {
            target: (bytes[50], bytes[51]),
            mask: short(48),
            position: [4, 8, 12].map(|at| f64::from(float(at))),
            velocity: [16, 20, 24].map(|at| f64::from(float(at))),
        }),
        _ => None,
    }
}
