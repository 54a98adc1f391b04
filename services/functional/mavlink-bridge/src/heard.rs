//! What the autopilot says, read out of its frames.
//!
//! Messages with enumerations are read from their bytes: the `mavlink` crate refuses a whole message if one enumeration has a value that
//! it does not know, and a heartbeat of a newer type or an acknowledgement of an unknown command would be lost. Offsets are those of
//! the wire: by size of the field, extensions at the end.

use autopilot::picture::roll_pitch_yaw;
use domain::geodesy::LatLon;
use mavlink::dialects::ardupilotmega::MavMessage;
use mavlink::{MavlinkVersion, Message as _};

use crate::frame::Frame;
use crate::said::OUR_COMPONENT;

/// A message that the bridge understands.
#[derive(Debug, Clone, PartialEq)]
pub enum Heard {
    /// Who speaks, and what it does.
    Heartbeat(Heartbeat),
    /// The answer to a command.
    Ack(Ack),
    /// Which mode is flown, and which one was asked for (PX4).
    CurrentMode {
        /// What is flown.
        custom_mode: u32,
        /// What was asked for.
        intended: u32,
    },
    /// The land detector: MAV_LANDED_STATE.
    Landed(u8),
    /// Health of the sensors, as bit masks.
    Health(Health),
    /// The battery.
    Battery(Battery),
    /// A text for humans.
    Text {
        /// MAV_SEVERITY: 0 emergency to 7 debug.
        severity: u8,
        /// What it says.
        text: String,
    },
    /// It sees the target of a landing: LANDING_TARGET, which PX4 sends as long as it does.
    LandingTarget,
    /// Where it is in its local frame.
    LocalPosition(LocalPosition),
    /// Where it is on the globe.
    GlobalPosition(GlobalPosition),
    /// How it is turned.
    Attitude {
        /// Rotation from body to NED: w, x, y, z.
        q: [f64; 4],
        /// Body rates.
        rates: [f64; 3],
    },
    /// What the estimator thinks of itself: ESTIMATOR_STATUS_FLAGS, and its accuracy where it says so.
    Estimator {
        /// The flags.
        flags: u16,
        /// One standard deviation, horizontal and vertical.
        accuracy_m: Option<(f64, f64)>,
        /// It does not believe its satellite receiver.
        gnss_glitches: bool,
    },
    /// The satellite receiver: fix and accuracy.
    Gnss {
        /// GPS_FIX_TYPE.
        fix: u8,
        /// One standard deviation, horizontal and vertical, if it says so.
        accuracy_m: Option<(f64, f64)>,
    },
    /// Where the local frame has its origin, in 1e-7 degrees and mm.
    Origin([i32; 3]),
    /// Where home is, in 1e-7 degrees and mm.
    Home([i32; 3]),
    /// Milliseconds since it was started.
    SystemTime(u32),
    /// The setpoint that it follows.
    Target(Echo),
    /// How much the frame shakes: three numbers, of which each autopilot means something else.
    Vibration([f64; 3]),
    /// Where the wind blows to, north and east.
    Wind([f64; 2]),
    /// Another aircraft.
    Traffic(Traffic),
    /// A parameter.
    Parameter(Parameter),
    /// A picture was taken.
    Picture(Picture),
}

impl Heard {
    /// Whether it says what has happened, and not what is: that holds however late it comes.
    pub(crate) fn is_event(&self) -> bool {
        matches!(self, Heard::Ack(_) | Heard::Text { .. } | Heard::Parameter(_) | Heard::Traffic(_) | Heard::Picture(_))
    }
}

/// HEARTBEAT.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Heartbeat {
    /// The autopilot's own number of the mode.
    pub custom_mode: u32,
    /// MAV_TYPE.
    pub kind: u8,
    /// MAV_AUTOPILOT.
    pub autopilot: u8,
    /// Whether the motors may turn.
    pub armed: bool,
    /// MAV_STATE.
    pub system_status: u8,
}

/// COMMAND_ACK.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ack {
    /// MAV_CMD.
    pub command: u16,
    /// MAV_RESULT.
    pub result: u8,
    /// Whom it is for; zeros: it does not say.
    pub target: (u8, u8),
}

impl Ack {
    /// Whether it answers our command to the autopilot of `system`. One without a target is of an older autopilot.
    pub(crate) fn is_ours(&self, system: u8) -> bool {
        self.target == (0, 0) || self.target == (system, OUR_COMPONENT)
    }
}

/// SYS_STATUS.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Health {
    /// Which sensors there are.
    pub present: u32,
    /// Which of them are used.
    pub enabled: u32,
    /// Which of them are healthy.
    pub healthy: u32,
}

/// BATTERY_STATUS of the first battery; what it does not measure is left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Battery {
    /// Of the whole pack.
    pub voltage_v: Option<f64>,
    /// Drawn.
    pub current_a: Option<f64>,
    /// 0 to 1.
    pub remaining: Option<f64>,
    /// Of the cells.
    pub temperature_c: Option<f64>,
    /// MAV_BATTERY_CHARGE_STATE.
    pub charge_state: u8,
}

/// What the autopilot says that it follows, in the local frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Echo {
    /// NED; `None`: it follows no position.
    pub position: Option<[f64; 3]>,
    /// NED; `None`: it follows no velocity.
    pub velocity: Option<[f64; 3]>,
}

impl Echo {
    /// POSITION_TARGET_LOCAL_NED; `mask` is its POSITION_TARGET_TYPEMASK.
    fn new(mask: u16, position: [f64; 3], velocity: [f64; 3]) -> Echo {
        let has = |parts: u16| mask & parts != parts;
        Echo { position: has(0x007).then_some(position), velocity: has(0x038).then_some(velocity) }
    }
}

/// LOCAL_POSITION_NED.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalPosition {
    /// Since the autopilot was started.
    pub boot_ms: u32,
    /// NED.
    pub position: [f64; 3],
    /// NED.
    pub velocity: [f64; 3],
}

/// GLOBAL_POSITION_INT.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GlobalPosition {
    /// Since the autopilot was started.
    pub boot_ms: u32,
    /// North is positive.
    pub latitude_deg: f64,
    /// East is positive.
    pub longitude_deg: f64,
    /// Above mean sea level.
    pub altitude_m: f64,
    /// Above home.
    pub above_home_m: f64,
    /// Where the nose points; `None` if unknown.
    pub heading_rad: Option<f64>,
}

/// ADSB_VEHICLE.
#[derive(Debug, Clone, PartialEq)]
pub struct Traffic {
    /// ICAO address and call sign.
    pub id: String,
    /// North is positive.
    pub latitude_deg: f64,
    /// East is positive.
    pub longitude_deg: f64,
    /// Above mean sea level.
    pub altitude_m: f64,
    /// NED.
    pub velocity: [f64; 3],
    /// ADSB_EMITTER_TYPE.
    pub emitter: u8,
}

/// PARAM_VALUE.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Its value as it travels.
    pub value: f32,
    /// MAV_PARAM_TYPE.
    pub kind: u8,
}

/// What is said of a picture; what is not known is left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Picture {
    /// By which message.
    pub report: PictureReport,
    /// Which camera of the sender.
    pub camera: u8,
    /// As the sender counts them.
    pub number: u32,
    /// Microseconds: of UTC, or since a start.
    pub time_us: u64,
    /// Latitude and longitude in degrees, metres above mean sea level.
    pub place: Option<[f64; 3]>,
    /// Roll, pitch and yaw.
    pub attitude_rad: Option<[f64; 3]>,
}

/// The messages that report a picture, the one that knows most first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PictureReport {
    /// CAMERA_IMAGE_CAPTURED: of cameras and PX4.
    Captured,
    /// CAMERA_FEEDBACK: of ArduPilot.
    Feedback,
    /// CAMERA_TRIGGER: of PX4, when it triggers the camera.
    Trigger,
}

/// What `frame` says; `None` if it is nothing that the bridge listens to, or does not decode.
pub fn heard(frame: &Frame) -> Option<Heard> {
    if !frame.is_known() {
        return None;
    }
    let bytes = Bytes(frame.payload());
    let heard = match frame.id() {
        0 => Heard::Heartbeat(Heartbeat {
            custom_mode: bytes.u32(0),
            kind: bytes.u8(4),
            autopilot: bytes.u8(5),
            armed: bytes.u8(6) & 0x80 != 0,
            system_status: bytes.u8(7),
        }),
        1 => Heard::Health(Health { present: bytes.u32(0), enabled: bytes.u32(4), healthy: bytes.u32(8) }),
        24 => Heard::Gnss {
            fix: bytes.u8(28),
            accuracy_m: match (bytes.u32(34), bytes.u32(38)) {
                (0, _) | (_, 0) => None,
                (horizontal, vertical) => Some((f64::from(horizontal) / 1e3, f64::from(vertical) / 1e3)),
            },
        },
        77 => Heard::Ack(Ack { command: bytes.u16(0), result: bytes.u8(2), target: (bytes.u8(8), bytes.u8(9)) }),
        85 => {
            let [position, velocity] = [4, 16].map(|at| [at, at + 4, at + 8].map(|at| bytes.f32(at)));
            Heard::Target(Echo::new(bytes.u16(48), position, velocity))
        }
        112 => Heard::Picture(Picture {
            report: PictureReport::Trigger,
            camera: 0,
            number: bytes.u32(8),
            time_us: bytes.u64(0),
            place: None,
            attitude_rad: None,
        }),
        149 => Heard::LandingTarget,
        147 => battery(&bytes)?,
        180 => feedback(&bytes)?,
        263 => captured(&bytes)?,
        // From where it blows, ArduPilot; to where, PX4.
        168 => {
            let (from_rad, speed_m_s) = (bytes.f32(0).to_radians(), bytes.f32(4));
            Heard::Wind([-from_rad.cos() * speed_m_s, -from_rad.sin() * speed_m_s])
        }
        231 => Heard::Wind([bytes.f32(8), bytes.f32(12)]),
        241 => Heard::Vibration([8, 12, 16].map(|at| bytes.f32(at))),
        // EKF_GPS_GLITCHING, and ESTIMATOR_GPS_GLITCH: the only bits with another meaning in each.
        193 => {
            let flags = bytes.u16(20);
            Heard::Estimator { flags, accuracy_m: None, gnss_glitches: flags & 1 << 15 != 0 }
        }
        230 => {
            let (flags, accuracy_m) = (bytes.u16(40), Some((bytes.f32(32), bytes.f32(36))));
            Heard::Estimator { flags, accuracy_m, gnss_glitches: flags & 1 << 10 != 0 }
        }
        22 => Heard::Parameter(Parameter { name: bytes.text(8, 16), value: bytes.f32(0) as f32, kind: bytes.u8(24) }),
        245 => Heard::Landed(bytes.u8(1)),
        246 => traffic(&bytes)?,
        253 => Heard::Text { severity: bytes.u8(0), text: bytes.text(1, 50) },
        436 => Heard::CurrentMode { custom_mode: bytes.u32(0), intended: bytes.u32(4) },
        _ => return of_dialect(frame),
    };
    Some(heard)
}

/// Messages without enumerations, as the dialect reads them.
fn of_dialect(frame: &Frame) -> Option<Heard> {
    let message = MavMessage::parse(MavlinkVersion::V2, frame.id(), frame.payload()).ok()?;
    Some(match message {
        MavMessage::SYSTEM_TIME(it) => Heard::SystemTime(it.time_boot_ms),
        MavMessage::ATTITUDE_QUATERNION(it) => Heard::Attitude {
            q: [it.q1, it.q2, it.q3, it.q4].map(f64::from),
            rates: [it.rollspeed, it.pitchspeed, it.yawspeed].map(f64::from),
        },
        MavMessage::LOCAL_POSITION_NED(it) => Heard::LocalPosition(LocalPosition {
            boot_ms: it.time_boot_ms,
            position: [it.x, it.y, it.z].map(f64::from),
            velocity: [it.vx, it.vy, it.vz].map(f64::from),
        }),
        MavMessage::GLOBAL_POSITION_INT(it) => Heard::GlobalPosition(GlobalPosition {
            boot_ms: it.time_boot_ms,
            latitude_deg: degrees(it.lat),
            longitude_deg: degrees(it.lon),
            altitude_m: f64::from(it.alt) / 1e3,
            above_home_m: f64::from(it.relative_alt) / 1e3,
            heading_rad: (it.hdg != u16::MAX).then(|| (f64::from(it.hdg) / 100.0).to_radians()),
        }),
        MavMessage::GPS_GLOBAL_ORIGIN(it) => Heard::Origin([it.latitude, it.longitude, it.altitude]),
        MavMessage::HOME_POSITION(it) => Heard::Home([it.latitude, it.longitude, it.altitude]),
        _ => return None,
    })
}

fn battery(bytes: &Bytes<'_>) -> Option<Heard> {
    // The first battery flies the vehicle.
    if bytes.u8(32) != 0 {
        return None;
    }
    let cells = (0..10).map(|cell| bytes.u16(10 + 2 * cell)).take_while(|it| *it != u16::MAX);
    let millivolts = cells.map(u32::from).sum::<u32>();
    let (temperature, current, remaining) = (bytes.i16(8), bytes.i16(30), bytes.u8(35) as i8);
    Some(Heard::Battery(Battery {
        voltage_v: (0 < millivolts).then(|| f64::from(millivolts) / 1e3),
        current_a: (0 <= current).then(|| f64::from(current) / 100.0),
        remaining: (0..=100).contains(&remaining).then(|| f64::from(remaining) / 100.0),
        temperature_c: (temperature != i16::MAX).then(|| f64::from(temperature) / 100.0),
        charge_state: bytes.u8(40),
    }))
}

fn traffic(bytes: &Bytes<'_>) -> Option<Heard> {
    /// ADSB_FLAGS: coordinates, altitude, heading and velocity are valid.
    const NEEDED: u16 = 1 | 2 | 4 | 8;
    if bytes.u16(22) & NEEDED != NEEDED {
        return None;
    }
    let (heading_rad, speed_m_s) = ((f64::from(bytes.u16(16)) / 100.0).to_radians(), f64::from(bytes.u16(18)) / 100.0);
    Some(Heard::Traffic(Traffic {
        id: format!("{:06X} {}", bytes.u32(0), bytes.text(27, 9)).trim_end().to_owned(),
        latitude_deg: degrees(bytes.u32(4) as i32),
        longitude_deg: degrees(bytes.u32(8) as i32),
        altitude_m: f64::from(bytes.u32(12) as i32) / 1e3,
        velocity: [
            heading_rad.cos() * speed_m_s,
            heading_rad.sin() * speed_m_s,
            // Upwards on the wire.
            -f64::from(bytes.i16(20)) / 100.0,
        ],
        emitter: bytes.u8(36),
    }))
}

/// CAMERA_FEEDBACK.
fn feedback(bytes: &Bytes<'_>) -> Option<Heard> {
    const VIDEO: u8 = 1;
    (bytes.u8(44) != VIDEO).then(|| {
        Heard::Picture(Picture {
            report: PictureReport::Feedback,
            camera: bytes.u8(43),
            number: u32::from(bytes.u16(40)),
            time_us: bytes.u64(0),
            place: place([bytes.u32(8), bytes.u32(12)], bytes.f32(16)),
            attitude_rad: Some([24, 28, 32].map(|at| bytes.f32(at).to_radians()))
                .filter(|it| it.iter().all(|it| it.is_finite())),
        })
    })
}

/// CAMERA_IMAGE_CAPTURED; a capture that has failed does not count. PX4 says -1 where the camera gives no answer.
fn captured(bytes: &Bytes<'_>) -> Option<Heard> {
    const FAILED: u8 = 0;
    (bytes.u8(49) != FAILED).then(|| {
        Heard::Picture(Picture {
            report: PictureReport::Captured,
            camera: bytes.u8(48),
            number: bytes.u32(44),
            time_us: bytes.u64(0),
            place: place([bytes.u32(12), bytes.u32(16)], f64::from(bytes.u32(20) as i32) / 1e3),
            attitude_rad: roll_pitch_yaw([28, 32, 36, 40].map(|at| bytes.f32(at))),
        })
    })
}

/// Latitude and longitude as they travel, with the altitude; zeros are what is sent without a position.
fn place(at: [u32; 2], altitude_m: f64) -> Option<[f64; 3]> {
    let [latitude_deg, longitude_deg] = at.map(|it| degrees(it as i32));
    let is_known = at != [0, 0] && LatLon::new(latitude_deg, longitude_deg).is_ok() && altitude_m.is_finite();
    is_known.then_some([latitude_deg, longitude_deg, altitude_m])
}

fn degrees(tenths_of_micro: i32) -> f64 {
    f64::from(tenths_of_micro) * 1e-7
}

/// A payload; what was left out at its end is zero.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn array<const N: usize>(&self, at: usize) -> [u8; N] {
        std::array::from_fn(|i| self.0.get(at + i).copied().unwrap_or(0))
    }

    fn u8(&self, at: usize) -> u8 {
        u8::from_le_bytes(self.array(at))
    }

    fn u16(&self, at: usize) -> u16 {
        u16::from_le_bytes(self.array(at))
    }

    fn i16(&self, at: usize) -> i16 {
        i16::from_le_bytes(self.array(at))
    }

    fn u32(&self, at: usize) -> u32 {
        u32::from_le_bytes(self.array(at))
    }

    fn u64(&self, at: usize) -> u64 {
        u64::from_le_bytes(self.array(at))
    }

    fn f32(&self, at: usize) -> f64 {
        f64::from(f32::from_le_bytes(self.array(at)))
    }

    fn text(&self, at: usize, length: usize) -> String {
        let bytes = (at..at + length).map(|it| self.0.get(it).copied().unwrap_or(0)).take_while(|it| *it != 0);
        String::from_utf8_lossy(&bytes.collect::<Vec<_>>()).trim().to_owned()
    }
}
