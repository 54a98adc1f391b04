//! As ArduPilot Copter was measured: silent until asked, everything in GUIDED, a position held for ever, a velocity for three seconds, a
//! climb that a setpoint ends, refusals with their texts.

use std::time::Duration;

use domain::time::{Now, Time};
use kittiwake_proto::v1::{self, vehicle_command::Command};

use crate::received::Received;
use crate::spoken::Modes;
use crate::{FakeAutopilot, Pilot};

const STABILIZE: u32 = 0;
const GUIDED: u32 = 4;
const RTL: u32 = 6;
const LAND: u32 = 9;
/// The mode that the switch of its remote control names, without that anybody moves it: LOITER.
const SWITCH: u32 = 5;

/// How it brakes by default: it passes a turn at 10 m/s by 24 m, as was measured.
pub(crate) const BRAKING_M_S2: f64 = 2.0;
/// GUID_TIMEOUT.
const VELOCITY_TIMEOUT: Duration = Duration::from_secs(3);
/// From the start until initialisation ends, and until there is a position.
const INITIALISED: Duration = Duration::from_millis(2_500);
const POSITION: Duration = Duration::from_secs(40);
/// From the end of initialisation until it takes the mode of the switch.
const SWITCH_READ: Duration = Duration::from_millis(200);
const RELEASED: &str = "Gripper load released";
/// As long nothing is seen of a target that is lost.
const TARGET_TIMEOUT: Duration = Duration::from_secs(2);
/// A target is given to the vehicle this often, so that it counts as alive.
const REFRESH: Duration = Duration::from_millis(100);

/// What it follows in GUIDED.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Guided {
    /// Nothing: it holds.
    Holds,
    /// A climb to this height above the origin.
    Climbs,
    /// A setpoint of this time.
    Follows { position: Option<[f64; 3]>, velocity: [f64; 3], since: Time },
}

impl Guided {
    /// Where it flies to, and how fast. With a velocity a position moves on until that times out; alone it is held for ever.
    fn target(self, now: Time) -> Option<(Option<[f64; 3]>, [f64; 3])> {
        let Guided::Follows { position, velocity, since } = self else { return None };
        let age = now - since;
        let along_s = age.min(VELOCITY_TIMEOUT).as_secs_f64();
        let moved = position.map(|it| std::array::from_fn(|i| it[i] + velocity[i] * along_s));
        Some((moved, if VELOCITY_TIMEOUT < age { [0.0; 3] } else { velocity }))
    }

    /// What it says that it follows: the type mask, position and velocity. Where nothing was sent since it began, a velocity of zero.
    fn told(self, now: Time) -> Option<(u16, [f64; 3], [f64; 3])> {
        match (self, self.target(now)) {
            (Guided::Climbs, _) => None,
            (_, Some((Some(position), velocity))) => Some((0xDC0, position, velocity)),
            (_, Some((None, velocity))) => Some((0xDC7, [0.0; 3], velocity)),
            (_, None) => Some((0xDC7, [0.0; 3], [0.0; 3])),
        }
    }
}

/// What ArduPilot remembers beside its vehicle.
#[derive(Debug)]
pub(crate) struct ArduPilot {
    mode: u32,
    guided: Guided,
    /// When it was started; `None`: long enough ago to have its position.
    booted: Option<Time>,
    initialised: bool,
    /// When it takes the mode of the switch; `None`: it has.
    reads_switch: Option<Time>,
    home: [f64; 3],
    was_armed: bool,
    /// A battery failsafe: until it is started again.
    battery_failed: bool,
    announced: Option<u32>,
    refresh: Time,
    /// A setpoint farther from home than this is dropped, in metres.
    fence_m: f64,
    /// What its gripper did last. It says so in texts, and only when that changes.
    gripper: v1::Gripper,
    /// PLND_ENABLED. The target of its landings: when it was seen last, once it was found.
    lands_precisely: bool,
    target_seen: Option<Time>,
}

impl ArduPilot {
    /// It has its position, and becomes ready now.
    pub(crate) fn new() -> ArduPilot {
        ArduPilot {
            mode: STABILIZE,
            guided: Guided::Holds,
            booted: None,
            initialised: true,
            reads_switch: Some(Time::ZERO + SWITCH_READ),
            home: [0.0; 3],
            was_armed: false,
            battery_failed: false,
            announced: None,
            refresh: Time::ZERO,
            fence_m: f64::INFINITY,
            gripper: v1::Gripper::Unspecified,
            lands_precisely: false,
            target_seen: None,
        }
    }

    /// It was started now.
    pub(crate) fn boot(&mut self, now: Time) {
        self.booted = Some(now);
        self.initialised = false;
        self.reads_switch = Some(now + INITIALISED + SWITCH_READ);
    }

    fn has_position(&self, now: Time) -> bool {
        self.booted.is_none_or(|it| POSITION <= now - it)
    }
}

fn own(fake: &mut FakeAutopilot) -> &mut ArduPilot {
    match &mut fake.pilot {
        Pilot::ArduPilot(it) => it,
        Pilot::Px4(_) => unreachable!("a personality is chosen once"),
    }
}

/// A message has arrived.
pub(crate) fn take_in(fake: &mut FakeAutopilot, received: &Received, from: (u8, u8), now: Now) {
    match received {
        Received::Command { command, params, .. } => {
            let result = obey(fake, *command, params, now);
            fake.acknowledge(*command, result, from, now.time);
        }
        Received::Setpoint { mask, position, velocity, .. } => {
            // Silently dropped in any other mode, and on the ground.
            if own(fake).mode != GUIDED || fake.is_landed() {
                return;
            }
            let position = (mask & 7 == 0).then_some(*position);
            let ArduPilot { home, fence_m, .. } = own(fake);
            if position.is_some_and(|it| *fence_m < (it[0] - home[0]).hypot(it[1] - home[1])) {
                return;
            }
            let velocity = if mask & 0x38 == 0 { *velocity } else { [0.0; 3] };
            own(fake).guided = Guided::Follows { position, velocity, since: now.time };
            own(fake).refresh = now.time;
        }
    }
}

fn obey(fake: &mut FakeAutopilot, command: u16, params: &[f32; 7], now: Now) -> u8 {
    match command {
        176 if params[0] as u32 & 1 == 0 => 2,
        176 => set_mode(fake, params[1] as u32, now),
        400 if params[0] == 1.0 => {
            let (mode, battery_failed) = (own(fake).mode, own(fake).battery_failed);
            let refusal = match mode {
                _ if battery_failed => Some("Arm: Battery 1 failed"),
                LAND | RTL => Some("Arm: LAND mode not armable"),
                GUIDED if !is_ready(fake, now.time) => Some("Arm: Need Position Estimate"),
                _ => None,
            };
            if let Some(text) = refusal {
                fake.text(2, text, now.time);
                return 4;
            }
            if fake.command(Command::Arm(v1::Arm {}), now) { 0 } else { 4 }
        }
        400 => {
            if fake.is_landed() && fake.command(Command::Disarm(v1::Disarm {}), now) {
                0
            } else {
                4
            }
        }
        22 => {
            // NaN here ends the real autopilot's program.
            assert!(!params[6].is_nan(), "NaN as the height of a takeoff");
            let climbs = fake.is_armed() && own(fake).mode == GUIDED && fake.is_landed() && 0.0 < params[6];
            if !climbs {
                return 4;
            }
            let altitude_m = f64::from(params[6]) - own(fake).home[2];
            if !fake.command(Command::Takeoff(v1::TakeoffCommand { altitude_m }), now) {
                return 4;
            }
            own(fake).guided = Guided::Climbs;
            0
        }
        21 => set_mode(fake, LAND, now),
        211 => {
            if own(fake).gripper == v1::Gripper::Released {
                fake.text(6, RELEASED, now.time);
            }
            if fake.command(Command::Release(v1::ReleaseCommand {}), now) { 0 } else { 4 }
        }
        // A winch relaxes, moves by a length, or at a rate. It does not lock.
        42600 if params[1] <= 2.0 => 0,
        42600 => 4,
        _ => 3,
    }
}

fn is_ready(fake: &mut FakeAutopilot, now: Time) -> bool {
    let is_fit = fake.vehicle.local.horizontal_valid && fake.vehicle.status.failures.is_empty();
    is_fit && own(fake).has_position(now)
}

/// Somebody sets a mode; MAV_RESULT.
pub(crate) fn set_mode(fake: &mut FakeAutopilot, mode: u32, now: Now) -> u8 {
    if own(fake).mode == mode {
        // It does nothing: a setpoint that is followed is followed on.
        return 0;
    }
    if mode == GUIDED && fake.is_armed() && !is_ready(fake, now.time) {
        fake.text(2, "Mode change to GUIDED failed: requires position", now.time);
        return 4;
    }
    let it = own(fake);
    (it.mode, it.guided) = (mode, Guided::Holds);
    match mode {
        LAND => {
            let on_target = own(fake).lands_precisely;
            fake.command(Command::Land(v1::LandCommand { on_target }), now);
        }
        _ => _ = fake.loiter(now),
    }
    announce(fake, now.time);
    0
}

/// Sets its fence.
pub(crate) fn fence(fake: &mut FakeAutopilot, metres: f64) {
    own(fake).fence_m = if metres == 0.0 { f64::INFINITY } else { metres };
}

/// It has a sensor for precision landing.
pub(crate) fn lands_precisely(fake: &mut FakeAutopilot) {
    own(fake).lands_precisely = true;
}

/// It finds its battery low, and lands once.
pub(crate) fn battery_fails(fake: &mut FakeAutopilot, now: Now) {
    let it = own(fake);
    (it.battery_failed, it.mode, it.guided) = (true, LAND, Guided::Holds);
    fake.command(Command::Land(v1::LandCommand::default()), now);
    announce(fake, now.time);
    fake.text(4, "Battery Failsafe", now.time);
}

/// A change of mode is said at once.
fn announce(fake: &mut FakeAutopilot, now: Time) {
    let mode = own(fake).mode;
    if own(fake).announced.replace(mode) != Some(mode) {
        let modes = modes(fake, now);
        let boot_ms = fake.boot_ms(now);
        let frame = fake.frame();
        for (id, payload) in
            crate::spoken::messages(crate::spoken::Stream(0), &mut fake.vehicle, frame, &modes, boot_ms)
        {
            fake.say(id, &payload, now);
        }
    }
}

/// Does what ArduPilot does by itself.
pub(crate) fn fly(fake: &mut FakeAutopilot, now: Now) {
    let (armed, position) = (fake.is_armed(), fake.position());
    let it = own(fake);
    if !it.initialised && it.booted.is_some_and(|at| INITIALISED <= now.time - at) {
        // A mode that was set meanwhile is undone.
        (it.initialised, it.mode) = (true, STABILIZE);
        fake.text(6, "ArduPilot Ready", now.time);
    }
    let it = own(fake);
    if it.reads_switch.take_if(|at| *at <= now.time).is_some() {
        it.mode = SWITCH;
    }
    if armed && !it.was_armed {
        it.home = position;
        fake.text(6, "Arming motors", now.time);
    }
    let is_low = fake.vehicle.battery.remaining < 0.05 && fake.vehicle.battery.voltage_v > 0.0;
    if armed && is_low && !own(fake).battery_failed {
        battery_fails(fake, now);
    }
    let it = own(fake);
    let was_armed = std::mem::replace(&mut it.was_armed, armed);
    if was_armed && !armed {
        it.guided = Guided::Holds;
    }
    announce(fake, now.time);
    let gripper = fake.vehicle.status.gripper();
    if std::mem::replace(&mut own(fake).gripper, gripper) != gripper {
        let is_open = gripper == v1::Gripper::Released;
        fake.text(6, if is_open { RELEASED } else { "Gripper load grabbed" }, now.time);
    }
    look_for_target(fake, now.time);
    guide(fake, now);
}

/// Says whether it sees the target of a landing.
fn look_for_target(fake: &mut FakeAutopilot, now: Time) {
    let is_seen = fake.vehicle.status.landing_target_seen == Some(true);
    let it = own(fake);
    let text = match (it.target_seen, is_seen) {
        (before, true) => {
            it.target_seen = Some(now);
            before.is_none().then_some((6, "PrecLand: Target Found"))
        }
        (Some(at), false) if TARGET_TIMEOUT < now - at => {
            it.target_seen = None;
            Some((2, "PrecLand: Target Lost"))
        }
        (_, false) => None,
    };
    if let Some((severity, text)) = text {
        fake.text(severity, text, now);
    }
}

/// Keeps what the vehicle flies in GUIDED alive.
fn guide(fake: &mut FakeAutopilot, now: Now) {
    let climbed = fake.actual() == v1::FlightMode::Loiter && !fake.is_landed();
    let it = own(fake);
    if it.guided == Guided::Climbs && climbed {
        it.guided = Guided::Holds;
    }
    let Guided::Follows { .. } = it.guided else { return };
    if now.time < it.refresh {
        return;
    }
    it.refresh = now.time + REFRESH;
    let Some((target, velocity)) = it.guided.target(now.time) else { return };
    // The vehicle brakes towards a position as if it were to rest there: for a target that moves on it gets the place where a stop ends.
    let speed_m_s = velocity.iter().map(|it| it * it).sum::<f64>().sqrt();
    let ahead_s = speed_m_s / (2.0 * BRAKING_M_S2);
    let target = target.map(|it| std::array::from_fn(|i| it[i] + velocity[i] * ahead_s));
    fake.fly(target, velocity, now);
    if fake.actual() != v1::FlightMode::Offboard {
        fake.offboard(now);
    }
}

/// What it says of its modes.
pub(crate) fn modes(fake: &mut FakeAutopilot, now: Time) -> Modes {
    let (armed, landed, failsafe) = (fake.is_armed(), fake.is_landed(), fake.vehicle.status.failsafe);
    let climbs = fake.actual() == v1::FlightMode::Takeoff;
    let is_fit = fake.vehicle.local.horizontal_valid && fake.vehicle.status.failures.is_empty();
    let it = own(fake);
    let has_position = it.has_position(now);
    Modes {
        autopilot: 3,
        custom_mode: it.mode,
        intended: it.mode,
        system_status: match (failsafe || it.battery_failed, it.initialised, armed && !landed) {
            (_, false, _) => 1,
            (true, ..) => 5,
            (false, true, true) => 4,
            (false, true, false) => 3,
        },
        // Also of a vehicle that falls: 60 ms after its motors were stopped.
        landed: match landed || !armed {
            true => 1,
            false if climbs => 3,
            false if it.mode == LAND => 4,
            false => 2,
        },
        // True without a position in a mode that needs none.
        prearm: match it.mode {
            LAND | RTL => false,
            GUIDED => is_fit && has_position && !it.battery_failed,
            _ => true,
        },
        lands_precisely: it.lands_precisely,
        has_position,
        home: it.home,
        target: (it.mode == GUIDED).then(|| it.guided.told(now)).flatten(),
    }
}
