//! What is each autopilot's own. A third one is one file, a variant of [`of`].

use std::time::Duration;

use domain::fmu::{Command, FlightMode, Gripper, Setpoint};
use domain::geodesy::{AutopilotFrame, LatLon};
use domain::time::Time;

use crate::procedure::Step;
use crate::said::{CommandLong, Target};
use crate::vehicle::Vehicle;

/// What the vehicle does in a mode that serves several purposes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Submode {
    /// It stays where it is.
    Holding,
    /// It climbs.
    Climbing,
    /// It follows setpoints.
    Following,
}

/// A message to ask for, and its period in microseconds.
pub(crate) type Stream = (u32, i32);

/// What an autopilot does in its own way.
pub(crate) trait Personality: std::fmt::Debug + Send {
    /// Its name.
    fn name(&self) -> &'static str;

    /// What to ask for.
    fn streams(&self) -> &'static [Stream];

    /// What the layers above know this mode as.
    fn mode(&self, custom_mode: u32, submode: Submode) -> Option<FlightMode>;

    /// Its name of a mode, for humans.
    fn mode_name(&self, custom_mode: u32) -> String;

    /// The mode to select on the ground: it can be armed in it, and says truly whether.
    fn ground_mode(&self) -> u32;

    /// The mode in which setpoints are flown.
    fn setpoint_mode(&self) -> u32;

    /// Whether it has finished starting, by MAV_STATE: a mode that is selected before may be undone.
    fn has_started(&self, system_status: u8) -> bool;

    /// How a command is carried out, or why it cannot be.
    fn steps(&self, command: Command, vehicle: &Vehicle) -> Result<Vec<Step>, String>;

    /// The command that climbs to `height_m` above the origin of the local frame, by the autopilot's own reference. `None`: what
    /// is needed for it was not heard since the vehicle was armed.
    fn takeoff(&self, height_m: f64, vehicle: &Vehicle, now: Time) -> Option<CommandLong>;

    /// The mode that lands on a target, during which LANDING_TARGET tells whether that is seen.
    fn target_mode(&self) -> Option<u32>;

    /// The mode that DO_SET_MODE is to set, as its parameters 2 and 3.
    fn mode_params(&self, custom_mode: u32) -> [f32; 2];

    /// Whether it may change from one mode to another by itself, without that anybody or a failsafe made it.
    /// `is_down`: it is on the ground or disarmed.
    fn changes_by_itself(&self, from: u32, to: u32, is_down: bool) -> bool;

    /// The texts that come with a failsafe of its own.
    fn failsafe_texts(&self) -> &'static [&'static str];

    /// Whether it says what the gripper does only by acknowledging a command, after that has moved.
    fn acknowledges_gripper(&self) -> bool;

    /// What the gripper does, where this text says so.
    fn gripper(&self, text: &str) -> Option<Gripper>;

    /// Whether it sees the target of a landing, where this text says so.
    fn landing_target(&self, text: &str) -> Option<bool>;

    /// How it maps the Earth about this origin: its metres are not quite ours.
    fn local_frame(&self, origin: LatLon) -> AutopilotFrame;

    /// How a setpoint of the layers above is passed on.
    fn following(&self, setpoint: &Setpoint) -> Following;

    /// The setpoint that stops the vehicle, where it has no mode for that.
    fn stop(&self) -> Option<Target>;

    /// How much the frame shakes, in m/s2, by what its message VIBRATION says.
    fn vibration_m_s2(&self, said: [f64; 3]) -> f64;

    /// Whether it tells which setpoint it follows, so that one of somebody else is noticed.
    fn echoes_setpoints(&self) -> bool;
}

/// How a position is flown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Following {
    /// As it is.
    Direct,
    /// By a target of our own that moves at the wanted speed; with its velocity or without.
    Carrot {
        /// The velocity is sent, too. When the stream stops the autopilot goes on at it for a while, then stands.
        with_velocity: bool,
        /// How far the vehicle may be behind it: seconds of its speed.
        lag: Duration,
        /// How fast the vehicle turns.
        turning_m_s2: f64,
    },
}

/// The personality of MAV_AUTOPILOT.
pub(crate) fn of(autopilot: u8) -> Option<Box<dyn Personality>> {
    match autopilot {
        12 => Some(Box::new(crate::px4::Px4)),
        3 => Some(Box::new(crate::ardupilot::ArduPilot)),
        _ => None,
    }
}
