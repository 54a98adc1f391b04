//! As PX4 was measured: a mode is acknowledged twice, a takeoff is taken while disarmed and counts from sea level, offboard needs a
//! stream and comes back by itself.

use std::time::Duration;

use domain::time::{Now, Time};
use kittiwake_proto::v1::{self, vehicle_command::Command};

use crate::received::Received;
use crate::spoken::Modes;
use crate::{FakeAutopilot, Pilot};

const fn mode(main: u32, sub: u32) -> u32 {
    main << 16 | sub << 24
}

pub(crate) const OFFBOARD: u32 = mode(6, 0);
pub(crate) const TAKEOFF: u32 = mode(4, 2);
pub(crate) const LOITER: u32 = mode(4, 3);
pub(crate) const LAND: u32 = mode(4, 6);
/// It tells where the target is by LANDING_TARGET, as long as the vehicle sees it.
const PRECISION_LAND: u32 = mode(4, 9);
/// It arms in neither, and goes back to the mode before once it has disarmed.
const LANDINGS: [u32; 2] = [LAND, PRECISION_LAND];

/// What PX4 remembers beside its vehicle.
#[derive(Debug)]
pub(crate) struct Px4 {
    intended: u32,
    /// The mode before a landing, to which it returns.
    before_landing: u32,
    last_setpoint: Option<Time>,
    home: [f64; 3],
    was_armed: bool,
    was_landed: bool,
    /// When its gripper counts as open, since it was told to open.
    gripper_opens: Option<Time>,
}

impl Px4 {
    /// Just started.
    pub(crate) fn new() -> Px4 {
        Px4 {
            intended: LOITER,
            before_landing: LOITER,
            last_setpoint: None,
            home: [0.0; 3],
            was_armed: false,
            was_landed: true,
            gripper_opens: None,
        }
    }
}

fn own(fake: &mut FakeAutopilot) -> &mut Px4 {
    match &mut fake.pilot {
        Pilot::Px4(it) => it,
        Pilot::ArduPilot(_) => unreachable!("a personality is chosen once"),
    }
}

/// A message has arrived.
pub(crate) fn take_in(fake: &mut FakeAutopilot, received: &Received, from: (u8, u8), now: Now) {
    match received {
        Received::Command { command: 176, params, .. } => {
            // The first acknowledgement says nothing.
            fake.acknowledge(176, 0, from, now.time);
            let result = set_mode(fake, mode(params[1] as u32, params[2] as u32), now);
            fake.acknowledge(176, result, from, now.time + Duration::from_millis(8));
        }
        Received::Command { command: 211, .. } => open_gripper(fake, from, now),
        // No module of its answers.
        Received::Command { command: 42600, .. } => {}
        Received::Command { command, params, .. } => {
            let result = obey(fake, *command, params, now);
            fake.acknowledge(*command, result, from, now.time);
        }
        Received::Setpoint { mask, position, velocity, .. } => {
            own(fake).last_setpoint = Some(now.time);
            let position = (mask & 7 == 0).then_some(*position);
            fake.fly(position, *velocity, now);
        }
    }
}

/// MAV_RESULT of a command.
fn obey(fake: &mut FakeAutopilot, command: u16, params: &[f32; 7], now: Now) -> u8 {
    match command {
        400 if params[0] == 1.0 => {
            let intended = own(fake).intended;
            // It does not arm in these, and not without what a flight needs.
            if LANDINGS.contains(&intended) || (intended == OFFBOARD && !has_stream(fake, now.time)) || !is_ready(fake)
            {
                return 1;
            }
            if fake.command(Command::Arm(v1::Arm {}), now) { 0 } else { 1 }
        }
        400 => {
            if fake.is_landed() && fake.command(Command::Disarm(v1::Disarm {}), now) {
                0
            } else {
                1
            }
        }
        22 => {
            // Also taken while disarmed: the mode changes, and nothing flies.
            let sea_level_m = fake.vehicle.status.origin.unwrap_or_default().altitude_amsl_m();
            let altitude_m = f64::from(params[6]) - sea_level_m;
            own(fake).intended = TAKEOFF;
            fake.command(Command::Takeoff(v1::TakeoffCommand { altitude_m }), now);
            0
        }
        21 => set_mode(fake, LAND, now),
        _ => 3,
    }
}

/// The gripper has no sensor: it counts as open after `PD_GRIPPER_TO`.
fn open_gripper(fake: &mut FakeAutopilot, from: (u8, u8), now: Now) {
    const MOVES: Duration = Duration::from_secs(1);
    match own(fake).gripper_opens {
        Some(at) => fake.acknowledge(211, u8::from(now.time < at), from, now.time),
        None => {
            let opens = now.time + MOVES;
            own(fake).gripper_opens = Some(opens);
            fake.command(Command::Release(v1::ReleaseCommand {}), now);
            fake.acknowledge(211, 5, from, now.time);
            fake.acknowledge(211, 0, from, opens);
        }
    }
}

fn is_ready(fake: &FakeAutopilot) -> bool {
    fake.vehicle.local.horizontal_valid && fake.vehicle.status.failures.is_empty()
}

fn has_stream(fake: &mut FakeAutopilot, now: Time) -> bool {
    own(fake).last_setpoint.is_some_and(|it| now - it <= Duration::from_secs(1))
}

/// Somebody sets a mode; MAV_RESULT.
pub(crate) fn set_mode(fake: &mut FakeAutopilot, asked: u32, now: Now) -> u8 {
    if asked == OFFBOARD && fake.is_armed() && !has_stream(fake, now.time) {
        return 1;
    }
    let done = match asked {
        LOITER => fake.loiter(now),
        OFFBOARD => fake.offboard(now) || !fake.is_armed(),
        LAND | PRECISION_LAND => {
            let before = own(fake).intended;
            own(fake).before_landing = before;
            let on_target = asked == PRECISION_LAND;
            fake.command(Command::Land(v1::LandCommand { on_target }), now) || fake.is_landed()
        }
        // A pilot's mode, or a return: the vehicle stays where it is.
        _ => fake.loiter(now),
    };
    if done {
        own(fake).intended = asked;
    }
    if done { 0 } else { 1 }
}

/// Does what PX4 does by itself.
pub(crate) fn fly(fake: &mut FakeAutopilot, _now: Now) {
    let (armed, landed, actual, position) = (fake.is_armed(), fake.is_landed(), fake.actual(), fake.position());
    let it = own(fake);
    // Home is where it was armed, and where it took off last.
    if (armed && !it.was_armed) || (!landed && it.was_landed) {
        it.home = position;
    }
    it.was_landed = landed;
    // The end of a climb is a change of mode; that of a landing a return to the mode before.
    if it.intended == TAKEOFF && it.was_armed && armed && actual == v1::FlightMode::Loiter {
        it.intended = LOITER;
    }
    if !armed && it.was_armed && LANDINGS.contains(&it.intended) {
        it.intended = it.before_landing;
    }
    it.was_armed = armed;
}

/// What it says of its modes.
pub(crate) fn modes(fake: &mut FakeAutopilot) -> Modes {
    let (armed, actual, landed, failsafe) =
        (fake.is_armed(), fake.actual(), fake.is_landed(), fake.vehicle.status.failsafe);
    let ready = is_ready(fake);
    let it = own(fake);
    // It holds when its setpoints stop: COM_OBL_RC_ACT is 5, as docs/autopilots.md asks.
    let custom_mode = match (failsafe, actual) {
        (true, v1::FlightMode::Loiter) => LOITER,
        (true, _) => LAND,
        (false, _) => it.intended,
    };
    let climbs = armed && actual == v1::FlightMode::Takeoff;
    let landed_state = match landed {
        true => 1,
        false if climbs => 3,
        false if actual == v1::FlightMode::Land => 4,
        false => 2,
    };
    Modes {
        lands_precisely: false,
        autopilot: 12,
        custom_mode,
        intended: it.intended,
        system_status: match (failsafe, armed) {
            (true, _) => 5,
            (false, true) => 4,
            (false, false) => 3,
        },
        landed: landed_state,
        prearm: ready && !LANDINGS.contains(&it.intended) && it.intended != OFFBOARD,
        has_position: true,
        home: it.home,
        target: None,
    }
}
