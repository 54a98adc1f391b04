//! PX4, as it was measured: two acknowledgements of a mode, a takeoff to an altitude above sea level, offboard that needs a stream.

use std::time::Duration;

use domain::fmu::{Command, FlightMode, Gripper, Setpoint};
use domain::geodesy::{AutopilotFrame, LatLon};
use domain::time::Time;

use crate::personality::{Following, Personality, Stream, Submode};
use crate::procedure::{Step, Until};
use crate::said::{CommandLong, Target, command};
use crate::vehicle::Vehicle;

/// PX4.
#[derive(Debug)]
pub(crate) struct Px4;

const fn mode(main: u32, sub: u32) -> u32 {
    main << 16 | sub << 24
}

const OFFBOARD: u32 = mode(6, 0);
const TAKEOFF: u32 = mode(4, 2);
const LOITER: u32 = mode(4, 3);
const RETURN: u32 = mode(4, 5);
const LAND: u32 = mode(4, 6);
const PRECISION_LAND: u32 = mode(4, 9);

impl Personality for Px4 {
    fn name(&self) -> &'static str {
        "PX4"
    }

    fn streams(&self) -> &'static [Stream] {
        // CURRENT_MODE is the only way to see a failsafe of less than a second: HEARTBEAT stays at 1 Hz.
        &[
            // First: without it the local frame has no name.
            (49, 1_000_000),
            (436, 50_000),
            (245, 100_000),
            (1, 250_000),
            (32, 33_333),
            (33, 50_000),
            (31, 20_000),
            (147, 200_000),
            (24, 250_000),
            (230, 250_000),
            (242, 1_000_000),
            (2, 1_000_000),
            (231, 1_000_000),
            (241, 1_000_000),
            (246, 200_000),
            (149, 200_000),
        ]
    }

    fn mode(&self, custom_mode: u32, _submode: Submode) -> Option<FlightMode> {
        Some(match custom_mode {
            OFFBOARD => FlightMode::Offboard,
            TAKEOFF => FlightMode::Takeoff,
            LOITER => FlightMode::Loiter,
            RETURN => FlightMode::Return,
            LAND | PRECISION_LAND => FlightMode::Land,
            _ => return None,
        })
    }

    fn mode_name(&self, custom_mode: u32) -> String {
        let (main, sub) = (custom_mode >> 16 & 0xFF, custom_mode >> 24);
        match main {
            1 => "MANUAL".into(),
            2 => "ALTCTL".into(),
            3 => "POSCTL".into(),
            4 => match sub {
                2 => "AUTO.TAKEOFF".into(),
                3 => "AUTO.LOITER".into(),
                4 => "AUTO.MISSION".into(),
                5 => "AUTO.RTL".into(),
                6 => "AUTO.LAND".into(),
                9 => "AUTO.PRECLAND".into(),
                _ => format!("AUTO.{sub}"),
            },
            5 => "ACRO".into(),
            6 => "OFFBOARD".into(),
            7 => "STABILIZED".into(),
            _ => format!("mode {main}.{sub}"),
        }
    }

    fn ground_mode(&self) -> u32 {
        LOITER
    }

    fn setpoint_mode(&self) -> u32 {
        OFFBOARD
    }

    fn has_started(&self, _system_status: u8) -> bool {
        // A mode that is set early is kept.
        true
    }

    fn steps(&self, command: Command, vehicle: &Vehicle) -> Result<Vec<Step>, String> {
        let long = |command, params: [f32; 1], until| Step::Long { command: CommandLong::new(command, params), until };
        Ok(match command {
            // After a landing the mode is offboard again, in which it does not arm.
            Command::Arm if vehicle.is_armed() => Vec::new(),
            Command::Arm => vec![Step::Mode(LOITER), long(command::ARM, [1.0], Until::Armed(true))],
            Command::Disarm => vec![long(command::ARM, [0.0], Until::Armed(false))],
            // Taken while disarmed, it changes the mode and nothing flies; taken in the air, it climbs away.
            Command::Takeoff { .. } if !vehicle.is_armed() => return Err("the vehicle is disarmed".into()),
            Command::Takeoff { .. } if !vehicle.is_on_ground() => {
                return Err("the vehicle is not known to be on the ground".into());
            }
            Command::Takeoff { height_m } => vec![Step::Takeoff { height_m, until: Until::Mode(TAKEOFF) }],
            Command::Land => vec![Step::Mode(LAND)],
            Command::LandOnTarget => vec![Step::Mode(PRECISION_LAND)],
            Command::Loiter => vec![Step::Mode(LOITER)],
            Command::Offboard => vec![Step::Follow, Step::Stream, Step::Mode(OFFBOARD)],
            Command::Release => vec![long(command::GRIPPER, [1.0], Until::Acknowledged)],
        })
    }

    fn takeoff(&self, height_m: f64, vehicle: &Vehicle, now: Time) -> Option<CommandLong> {
        let since = vehicle.armed_since?;
        let climb_m = height_m + vehicle.local_now(now)?.position[2];
        let altitude_m = vehicle.global_since(since, now)?.altitude_m + climb_m;
        let nan = f32::NAN;
        Some(CommandLong::new(command::TAKEOFF, [nan, nan, nan, nan, nan, nan, altitude_m as f32]))
    }

    fn target_mode(&self) -> Option<u32> {
        Some(PRECISION_LAND)
    }

    fn mode_params(&self, custom_mode: u32) -> [f32; 2] {
        [(custom_mode >> 16 & 0xFF) as f32, (custom_mode >> 24) as f32]
    }

    fn changes_by_itself(&self, from: u32, to: u32, is_down: bool) -> bool {
        // A finished climb loiters; a landing ends in the mode that was flown before.
        (from == TAKEOFF && to == LOITER) || ([LAND, PRECISION_LAND].contains(&from) && is_down)
    }

    fn failsafe_texts(&self) -> &'static [&'static str] {
        &["Failsafe", "failsafe"]
    }

    fn acknowledges_gripper(&self) -> bool {
        true
    }

    fn gripper(&self, _text: &str) -> Option<Gripper> {
        None
    }

    fn landing_target(&self, _text: &str) -> Option<bool> {
        None
    }

    fn local_frame(&self, origin: LatLon) -> AutopilotFrame {
        AutopilotFrame::of_px4(origin)
    }

    fn following(&self, setpoint: &Setpoint) -> Following {
        match setpoint {
            // Its own limit in offboard is MPC_XY_VEL_MAX, which no command changes.
            Setpoint::Position { speed_limit_m_s: Some(_), .. } => {
                // MPC_XY_P, 0.95 1/s, makes it follow a moving position by a second; the rest is for gaining speed. It turns by
                // MPC_ACC_HOR_MAX, 5 m/s2.
                Following::Carrot { with_velocity: false, lag: Duration::from_millis(2_500), turning_m_s2: 5.0 }
            }
            _ => Following::Direct,
        }
    }

    fn stop(&self) -> Option<Target> {
        None
    }

    /// The first two are of the gyros; the third is of the accelerometer.
    fn vibration_m_s2(&self, [_, _, of_accelerometer]: [f64; 3]) -> f64 {
        of_accelerometer
    }

    fn echoes_setpoints(&self) -> bool {
        false
    }
}
