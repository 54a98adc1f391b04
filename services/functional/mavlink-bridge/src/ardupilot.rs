//! ArduPilot Copter, as it was measured: everything is flown in GUIDED, a takeoff counts from home, a setpoint during the climb ends it,
//! and a stop is a velocity of zero.

use std::time::Duration;

use domain::fmu::{Command, FlightMode, Gripper, Setpoint};
use domain::geodesy::{AutopilotFrame, LatLon};
use domain::time::Time;

use crate::personality::{Following, Personality, Stream, Submode};
use crate::procedure::{Step, Until};
use crate::said::{CommandLong, Target, command};
use crate::vehicle::Vehicle;

/// ArduPilot Copter.
#[derive(Debug)]
pub(crate) struct ArduPilot;

const GUIDED: u32 = 4;
const RTL: u32 = 6;
const LAND: u32 = 9;

/// MAV_STATE_STANDBY: started, on the ground.
const STANDBY: u8 = 3;
/// MAV_SYS_STATUS_SENSOR_VISION_POSITION. Copter reports its precision landing by it: present with PLND_ENABLED.
const PRECISION_LANDING: u32 = 1 << 7;

impl Personality for ArduPilot {
    fn name(&self) -> &'static str {
        "ArduPilot"
    }

    fn streams(&self) -> &'static [Stream] {
        // HEARTBEAT alone comes unasked, and at once on a change of mode, but not when it is armed.
        &[
            // First: without it the local frame has no name.
            (49, 1_000_000),
            (0, 200_000),
            (245, 100_000),
            (1, 250_000),
            (32, 50_000),
            (33, 100_000),
            (31, 50_000),
            (147, 200_000),
            (24, 500_000),
            (193, 250_000),
            (85, 250_000),
            (242, 1_000_000),
            (2, 1_000_000),
            (168, 1_000_000),
            (241, 1_000_000),
            (246, 200_000),
        ]
    }

    fn mode(&self, custom_mode: u32, submode: Submode) -> Option<FlightMode> {
        Some(match (custom_mode, submode) {
            (GUIDED, Submode::Holding) => FlightMode::Loiter,
            (GUIDED, Submode::Climbing) => FlightMode::Takeoff,
            (GUIDED, Submode::Following) => FlightMode::Offboard,
            (RTL, _) => FlightMode::Return,
            (LAND, _) => FlightMode::Land,
            _ => return None,
        })
    }

    fn mode_name(&self, custom_mode: u32) -> String {
        const NAMES: [(u32, &str); 14] = [
            (0, "STABILIZE"),
            (1, "ACRO"),
            (2, "ALT_HOLD"),
            (3, "AUTO"),
            (4, "GUIDED"),
            (5, "LOITER"),
            (6, "RTL"),
            (7, "CIRCLE"),
            (9, "LAND"),
            (13, "SPORT"),
            (16, "POSHOLD"),
            (17, "BRAKE"),
            (20, "GUIDED_NOGPS"),
            (21, "SMART_RTL"),
        ];
        let name = NAMES.iter().find(|(number, _)| *number == custom_mode).map(|(_, name)| (*name).to_owned());
        name.unwrap_or_else(|| format!("mode {custom_mode}"))
    }

    fn ground_mode(&self) -> u32 {
        GUIDED
    }

    fn setpoint_mode(&self) -> u32 {
        GUIDED
    }

    fn has_started(&self, system_status: u8) -> bool {
        // A mode that is set before is accepted, and undone when it has started.
        STANDBY <= system_status
    }

    fn steps(&self, command: Command, vehicle: &Vehicle) -> Result<Vec<Step>, String> {
        let long = |command, params: [f32; 2], until| Step::Long { command: CommandLong::new(command, params), until };
        Ok(match command {
            Command::Arm if vehicle.is_armed() => Vec::new(),
            // LAND, in which it is after each landing, cannot be armed.
            Command::Arm => vec![Step::Mode(GUIDED), long(command::ARM, [1.0, 0.0], Until::Armed(true))],
            Command::Disarm => vec![long(command::ARM, [0.0, 0.0], Until::Armed(false))],
            Command::Takeoff { .. } if !vehicle.is_armed() => return Err("the vehicle is disarmed".into()),
            Command::Takeoff { .. } if !vehicle.is_on_ground() => {
                return Err("the vehicle is not known to be on the ground".into());
            }
            Command::Takeoff { height_m } => {
                vec![Step::Mode(GUIDED), Step::Takeoff { height_m, until: Until::Acknowledged }, Step::Climb]
            }
            Command::LandOnTarget if !vehicle.has_sensor(PRECISION_LANDING) => {
                return Err("the autopilot has no precision landing: its PLND_ENABLED is 0".into());
            }
            // It steers to a target that it sees by itself.
            Command::Land | Command::LandOnTarget => vec![Step::Mode(LAND)],
            // LOITER would fly the sticks of a pilot who is not there. To set GUIDED in GUIDED does nothing: it flies on.
            Command::Loiter => vec![Step::Mode(GUIDED), Step::Stop],
            Command::Offboard => vec![Step::Mode(GUIDED), Step::Follow],
            // Of the first gripper; GRIPPER_ACTION_RELEASE is 0.
            Command::Release => vec![long(command::GRIPPER, [1.0, 0.0], Until::Acknowledged)],
        })
    }

    fn takeoff(&self, height_m: f64, vehicle: &Vehicle, now: Time) -> Option<CommandLong> {
        // Home moves to where it is armed.
        let since = vehicle.armed_since?;
        let climb_m = height_m + vehicle.local_now(now)?.position[2];
        let above_home_m = vehicle.global_since(since, now)?.above_home_m + climb_m;
        // NaN in param7 ends the autopilot's program, and a value not above 0 is refused.
        (above_home_m.is_finite() && 0.0 < above_home_m)
            .then(|| CommandLong::new(command::TAKEOFF, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, above_home_m as f32]))
    }

    fn target_mode(&self) -> Option<u32> {
        None
    }

    fn mode_params(&self, custom_mode: u32) -> [f32; 2] {
        [custom_mode as f32, 0.0]
    }

    fn changes_by_itself(&self, _from: u32, _to: u32, _is_down: bool) -> bool {
        false
    }

    fn failsafe_texts(&self) -> &'static [&'static str] {
        &["ailsafe", "EKF variance", "ence", "Crash", "Terrain", "Vibration", "Dead Reckon"]
    }

    fn acknowledges_gripper(&self) -> bool {
        false
    }

    /// No message has it. A gripper on a servo says so once its servo has had the time to move, and each time that it is commanded again.
    fn gripper(&self, text: &str) -> Option<Gripper> {
        match text {
            "Gripper load grabbed" => Some(Gripper::Holding),
            "Gripper load released" => Some(Gripper::Released),
            _ => None,
        }
    }

    /// It is lost once it was not seen for 2 s. The last two texts come where it was never seen, too. Copter sends them in every mode.
    fn landing_target(&self, text: &str) -> Option<bool> {
        match text.strip_prefix("PrecLand: ")? {
            "Target Found" | "Init Complete" => Some(true),
            "Target Lost" | "Init Failed" | "Retrying" | "Failsafe Measures" => Some(false),
            _ => None,
        }
    }

    fn local_frame(&self, origin: LatLon) -> AutopilotFrame {
        AutopilotFrame::of_ardupilot(origin)
    }

    fn following(&self, setpoint: &Setpoint) -> Following {
        match setpoint {
            // A position that is sent alone is held for ever, whatever becomes of us. (Measured: it brakes by 2 m/s2.)
            Setpoint::Position { .. } => {
                Following::Carrot { with_velocity: true, lag: Duration::from_millis(2_500), turning_m_s2: 2.0 }
            }
            // After GUID_TIMEOUT, 3 s, it stands.
            Setpoint::Velocity { .. } => Following::Direct,
        }
    }

    fn stop(&self) -> Option<Target> {
        Some(Target { position: None, velocity: Some([0.0; 3]), yaw_rad: None, yaw_rate_rad_s: None })
    }

    /// The greatest axis of the accelerometer. NaN in one axis makes it unknown, not small.
    fn vibration_m_s2(&self, axes: [f64; 3]) -> f64 {
        axes.into_iter().fold(0.0, |greatest, it| if it.is_nan() || greatest < it { it } else { greatest })
    }

    fn echoes_setpoints(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frame_shakes_as_much_as_its_worst_axis_and_an_unknown_axis_is_not_calm() {
        assert_eq!(ArduPilot.vibration_m_s2([1.0, 30.0, 2.0]), 30.0);
        for axes in [[f64::NAN; 3], [f64::NAN, 1.0, 1.0], [1.0, 1.0, f64::NAN]] {
            assert!(ArduPilot.vibration_m_s2(axes).is_nan(), "{axes:?}");
        }
    }
}
