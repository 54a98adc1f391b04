//! Commands of MAVLink to a payload, by which an autopilot carries out a declared skill: no process is needed.

use std::collections::BTreeMap;

use crate::task::{Task, Value};

/// Those that may be declared, by their names in MAV_CMD. None of them flies the vehicle, arms it, or changes its mode.
pub const PAYLOAD_COMMANDS: [(&str, u16); 20] = [
    ("DO_SET_RELAY", 181),
    ("DO_REPEAT_RELAY", 182),
    ("DO_SET_SERVO", 183),
    ("DO_REPEAT_SERVO", 184),
    ("DO_SET_ROI_LOCATION", 195),
    ("DO_SET_ROI_NONE", 197),
    ("DO_DIGICAM_CONTROL", 203),
    ("DO_MOUNT_CONTROL", 205),
    ("DO_SET_CAM_TRIGG_DIST", 206),
    ("DO_GRIPPER", 211),
    ("DO_SPRAYER", 216),
    ("DO_GIMBAL_MANAGER_PITCHYAW", 1000),
    ("IMAGE_START_CAPTURE", 2000),
    ("IMAGE_STOP_CAPTURE", 2001),
    ("DO_TRIGGER_CONTROL", 2003),
    ("VIDEO_START_CAPTURE", 2500),
    ("VIDEO_STOP_CAPTURE", 2501),
    ("USER_1", 31010),
    ("USER_2", 31011),
    ("DO_WINCH", 42600),
];

/// A command with its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct PayloadCommand {
    /// Its number in MAV_CMD.
    pub command: u16,
    /// At most seven; those that are left out are 0.
    pub params: Vec<Param>,
    /// Those that end it, if something does.
    pub cancel: Option<Vec<Param>>,
    /// Nothing was done before a picture is reported.
    pub takes_pictures: bool,
}

impl PayloadCommand {
    /// Its name in MAV_CMD.
    pub fn name(&self) -> &'static str {
        PAYLOAD_COMMANDS.iter().find(|(_, number)| *number == self.command).map_or("", |(name, _)| name)
    }
}

/// A parameter of a command.
#[derive(Debug, Clone, PartialEq)]
pub enum Param {
    /// Always this.
    Number(f64),
    /// The input of this name.
    Input(String),
}

/// The seven numbers of `params` for a task that has a number for each input that they name.
pub fn numbers(params: &[Param], task: &Task) -> [f64; 7] {
    let number = |(name, value): &'_ (String, Value)| Some((name.clone(), value.number()?));
    let inputs: BTreeMap<String, f64> = task.inputs.iter().filter_map(number).collect();
    let mut numbers = [0.0; 7];
    for (number, param) in numbers.iter_mut().zip(params) {
        *number = match param {
            Param::Number(it) => *it,
            Param::Input(name) => inputs.get(name).copied().unwrap_or(0.0),
        };
    }
    numbers
}
