//! What the autopilots say, and how often.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::geodesy::{AutopilotFrame, LatLon, LocalFrame};
use domain::geometry::Ned;
use domain::time::Time;

use crate::{Kind, Telemetry};

/// A message id.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stream(pub(crate) u32);

/// When which message is due.
#[derive(Debug)]
pub(crate) struct Streams(BTreeMap<u32, (Duration, Time)>);

impl Streams {
    /// What is sent unasked: PX4's defaults, ArduPilot's heartbeat alone.
    pub(crate) fn new(kind: Kind) -> Streams {
        let hz = |rate: f64| (Duration::from_secs_f64(1.0 / rate), Time::ZERO);
        let px4 = [
            (0, 1.0),
            (245, 5.0),
            (1, 5.0),
            (147, 0.5),
            (436, 0.5),
            (242, 0.5),
            (31, 49.0),
            (32, 30.0),
            (33, 49.0),
            (24, 8.0),
        ];
        Streams(match kind {
            Kind::Px4 => px4.into_iter().map(|(id, rate)| (id, hz(rate))).collect(),
            Kind::ArduPilot => BTreeMap::from([(0, hz(1.0))]),
        })
    }

    /// Somebody asks for a message; MAV_RESULT.
    pub(crate) fn ask(&mut self, kind: Kind, id: u32, period_us: f32, now: Time) -> u8 {
        let refused = match kind {
            Kind::Px4 if id == 0 => Some(4),
            Kind::ArduPilot if [436, 331, 230, 111].contains(&id) => Some(2),
            _ => None,
        };
        if let Some(result) = refused {
            return result;
        }
        // PX4 sends the origin when it changes or when it is requested; asking for an interval sends nothing.
        if kind == Kind::Px4 && id == 49 {
            return 0;
        }
        self.0.insert(id, (Duration::from_micros(period_us.max(4_000.0) as u64), now));
        0
    }

    /// What is due.
    pub(crate) fn due(&mut self, now: Time) -> Vec<u32> {
        let mut due = Vec::new();
        for (id, (period, next)) in &mut self.0 {
            if *next <= now {
                *next = (*next + *period).max(now);
                due.push(*id);
            }
        }
        due
    }

    /// When the next is due.
    pub(crate) fn deadline(&self) -> Option<Time> {
        self.0.values().map(|(_, next)| *next).min()
    }
}

/// What the personality adds to the vehicle's telemetry.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Modes {
    pub(crate) autopilot: u8,
    pub(crate) custom_mode: u32,
    pub(crate) intended: u32,
    pub(crate) system_status: u8,
    pub(crate) landed: u8,
    pub(crate) prearm: bool,
    /// PLND_ENABLED.
    pub(crate) lands_precisely: bool,
    /// Whether a position is sent.
    pub(crate) has_position: bool,
    /// Where it was armed last, as it is in the local frame.
    pub(crate) home: [f64; 3],
    /// What it follows in guided flight: mask, position, velocity.
    pub(crate) target: Option<(u16, [f64; 3], [f64; 3])>,
}

/// The frames of one stream: id and payload.
pub(crate) fn messages(
    stream: Stream,
    vehicle: &mut Telemetry,
    frame: Option<AutopilotFrame>,
    modes: &Modes,
    boot_ms: u32,
) -> Vec<(u32, Vec<u8>)> {
    let mut payload = Payload::default();
    let local = vehicle.local.position.unwrap_or_default();
    let velocity = vehicle.local.velocity.unwrap_or_default();
    let origin = vehicle.status.origin.unwrap_or_default();
    let e7 = |degrees: f64| (degrees * 1e7).round() as i32;
    let mm = |metres: f64| (metres * 1e3).round() as i32;
    match stream.0 {
        0 => {
            // Custom modes are in use, and whether it is armed.
            let base_mode = 0x01 | if vehicle.status.armed { 0x80 } else { 0 };
            payload.u32(modes.custom_mode).bytes(&[2, modes.autopilot, base_mode, modes.system_status, 3]);
        }
        1 => {
            // GNSS, battery, prearm check.
            const USED: u32 = 1 << 5 | 1 << 25 | 1 << 28;
            let failures = vehicle.status.failures().collect::<Vec<_>>();
            let bad = |failure, bit: u32| if failures.contains(&failure) { 1 << bit } else { 0 };
            let sick = bad(kittiwake_proto::v1::FailureFlag::GnssLost, 5)
                | bad(kittiwake_proto::v1::FailureFlag::Battery, 25)
                | if modes.prearm { 0 } else { 1 << 28 };
            // A sensor for precision landing is healthy while it sees something.
            let used = USED | u32::from(modes.lands_precisely) << 7;
            payload.u32(used).u32(used).u32(USED & !sick).u16(100);
            payload.u16((vehicle.battery.voltage_v * 1e3) as u16).u16((vehicle.battery.current_a() * 100.0) as u16);
            payload.bytes(&[0; 12]).bytes(&[(vehicle.battery.remaining * 100.0) as u8]);
        }
        2 => {
            payload.u32(0).u32(0).u32(boot_ms);
        }
        // Only its coming counts.
        149 if vehicle.status.landing_target_seen == Some(true) => {
            payload.bytes(&[0; 60]);
        }
        24 => {
            let fix = if vehicle.status.failures().any(|it| it == kittiwake_proto::v1::FailureFlag::GnssLost) {
                0
            } else {
                3
            };
            payload.bytes(&[0; 28]).bytes(&[fix, 12]).u32(0);
            payload.u32(mm(vehicle.local.eph_m) as u32).u32(mm(vehicle.local.epv_m) as u32);
        }
        31 => {
            let it = &vehicle.attitude;
            payload.u32(boot_ms);
            for number in [it.q_w, it.q_x, it.q_y, it.q_z, it.roll_rate_rad_s, it.pitch_rate_rad_s, it.yaw_rate_rad_s] {
                payload.f32(number);
            }
        }
        32 if modes.has_position => {
            payload.u32(boot_ms);
            let position = [local.north_m, local.east_m, local.down_m];
            for number in position.into_iter().chain([velocity.north_m_s, velocity.east_m_s, velocity.down_m_s]) {
                payload.f32(number);
            }
        }
        33 if modes.has_position => {
            let it = &vehicle.global;
            payload.u32(boot_ms).i32(e7(it.latitude_deg)).i32(e7(it.longitude_deg)).i32(mm(it.altitude_amsl_m));
            payload.i32(mm(modes.home[2] - local.down_m)).bytes(&[0; 6]);
            let heading_deg = vehicle.local.heading_rad.to_degrees().rem_euclid(360.0);
            payload.u16((heading_deg * 100.0) as u16);
        }
        49 => {
            payload.i32(e7(origin.latitude_deg)).i32(e7(origin.longitude_deg)).i32(mm(origin.altitude_amsl_m()));
        }
        85 => {
            let (mask, position, velocity) =
                modes.target.filter(|_| modes.has_position).unwrap_or((0xDF8, [0.0; 3], [0.0; 3]));
            payload.u32(boot_ms);
            for number in position.into_iter().chain(velocity).chain([0.0; 5]) {
                payload.f32(number);
            }
            payload.u16(mask).bytes(&[1]);
        }
        147 => {
            let it = &vehicle.battery;
            // Consumption, then the temperature, the first cell for the pack, nine unused ones.
            payload.i32(0).i32(0).u16((it.temperature_c() * 100.0) as u16).u16((it.voltage_v * 1e3) as u16);
            payload.bytes(&[0xFF; 18]).u16((it.current_a() * 100.0) as u16).bytes(&[0, 0, 1]);
            let charge_state = if it.remaining < 0.07 { 3 } else { 1 };
            payload.bytes(&[(it.remaining * 100.0) as u8]).i32(0).bytes(&[charge_state]);
        }
        // To where the wind blows (PX4), and from where (ArduPilot).
        231 => {
            payload.bytes(&[0; 8]).f32(vehicle.wind.north_m_s).f32(vehicle.wind.east_m_s).bytes(&[0; 24]);
        }
        168 => {
            let (north, east) = (vehicle.wind.north_m_s, vehicle.wind.east_m_s);
            payload.f32((-east).atan2(-north).to_degrees()).f32(north.hypot(east)).f32(0.0);
        }
        // Of the gyros twice, then of the accelerometer (PX4); for each axis of that (ArduPilot).
        241 => {
            let shakes = vehicle.status.vibration_m_s2.unwrap_or(0.0);
            let [x, y, z] = if modes.autopilot == 12 { [900.0, 900.0, shakes] } else { [1.0, shakes, 1.0] };
            payload.bytes(&[0; 8]).f32(x).f32(y).f32(z).bytes(&[0; 12]);
        }
        193 => {
            payload.bytes(&[0; 20]).u16(estimator_flags(vehicle, modes)).bytes(&[0; 4]);
        }
        230 => {
            payload.bytes(&[0; 32]).f32(vehicle.local.eph_m).f32(vehicle.local.epv_m);
            payload.u16(estimator_flags(vehicle, modes));
        }
        242 => {
            let [north_m, east_m, down_m] = modes.home;
            let Some(frame) = frame else { return Vec::new() };
            let home = frame.lat_lon(Ned::new(north_m, east_m, down_m));
            payload.i32(e7(home.latitude_deg())).i32(e7(home.longitude_deg()));
            payload.i32(mm(origin.altitude_amsl_m() - down_m)).bytes(&[0; 40]);
        }
        245 => {
            payload.bytes(&[0, modes.landed]);
        }
        246 => {
            let Some(frame) = self::origin(vehicle).map(LocalFrame::at) else { return Vec::new() };
            let traffic = std::mem::take(&mut vehicle.traffic);
            return traffic.iter().map(|it| (246, aircraft(it, &frame, origin.altitude_amsl_m()))).collect();
        }
        436 => {
            payload.u32(modes.custom_mode).u32(modes.intended).bytes(&[0]);
        }
        _ => return Vec::new(),
    }
    match payload.0.is_empty() {
        true => Vec::new(),
        false => vec![(stream.0, payload.0)],
    }
}

/// The frames of a picture: PX4 says that it triggers the camera, then where that was.
pub(crate) fn picture(kind: Kind, number: u32, vehicle: &Telemetry, boot_us: u64, utc_ms: i64) -> Vec<(u32, Vec<u8>)> {
    let (it, q) = (&vehicle.global, &vehicle.attitude);
    let [latitude, longitude] = [it.latitude_deg, it.longitude_deg].map(|degrees| (degrees * 1e7).round() as i32);
    let utc_us = utc_ms as u64 * 1000;
    match kind {
        Kind::Px4 => {
            let (mut triggers, mut captured) = (Payload::default(), Payload::default());
            triggers.u64(boot_us).u32(number);
            captured.u64(utc_us).u32((boot_us / 1000) as u32).i32(latitude).i32(longitude);
            captured.i32((it.altitude_amsl_m * 1e3) as i32).i32(-1000);
            captured.f32(q.q_w).f32(q.q_x).f32(q.q_y).f32(q.q_z).u32(number).bytes(&[1, 1]);
            vec![(112, triggers.0), (263, captured.0)]
        }
        Kind::ArduPilot => {
            let mut feedback = Payload::default();
            feedback.u64(utc_us).i32(latitude).i32(longitude).f32(it.altitude_amsl_m).f32(0.0);
            feedback.f32(0.0).f32(0.0).f32(vehicle.local.heading_rad.to_degrees().rem_euclid(360.0)).f32(0.0);
            feedback.u16(number as u16);
            vec![(180, feedback.0)]
        }
    }
}

/// Where the local frame begins.
pub(crate) fn origin(vehicle: &Telemetry) -> Option<LatLon> {
    let origin = vehicle.status.origin?;
    LatLon::new(origin.latitude_deg, origin.longitude_deg).ok()
}

fn estimator_flags(vehicle: &Telemetry, modes: &Modes) -> u16 {
    let horizontal = if vehicle.local.horizontal_valid && modes.has_position { 2 | 8 | 16 | 256 | 512 } else { 128 };
    let vertical = if vehicle.local.vertical_valid { 4 | 32 } else { 0 };
    let glitches = match (vehicle.glitches, modes.autopilot) {
        (false, _) => 0,
        (true, 12) => 1 << 10,
        (true, _) => 1 << 15,
    };
    1 | horizontal | vertical | glitches
}

fn aircraft(it: &kittiwake_proto::v1::TransponderReport, frame: &LocalFrame, sea_level_m: f64) -> Vec<u8> {
    let (position, velocity) = (it.position.unwrap_or_default(), it.velocity.unwrap_or_default());
    let place = frame.lat_lon(Ned::new(position.north_m, position.east_m, position.down_m));
    let heading = velocity.east_m_s.atan2(velocity.north_m_s).to_degrees().rem_euclid(360.0);
    let mut payload = Payload::default();
    payload.u32(0x3C_65_AC).i32((place.latitude_deg() * 1e7) as i32).i32((place.longitude_deg() * 1e7) as i32);
    payload.i32(((sea_level_m - position.down_m) * 1e3) as i32).u16((heading * 100.0) as u16);
    payload.u16((velocity.north_m_s.hypot(velocity.east_m_s) * 100.0) as u16);
    payload.u16((-velocity.down_m_s * 100.0) as i16 as u16).u16(0x9F).u16(0).bytes(&[1]).bytes(b"DMO123\0\0\0");
    // ADSB_EMITTER_TYPE: an unmanned aircraft, or a light one.
    let emitter = if it.kind() == kittiwake_proto::v1::TrafficKind::Uncrewed { 14 } else { 1 };
    payload.bytes(&[emitter, 1]);
    payload.0
}

#[derive(Debug, Default)]
struct Payload(Vec<u8>);

impl Payload {
    fn bytes(&mut self, bytes: &[u8]) -> &mut Payload {
        self.0.extend_from_slice(bytes);
        self
    }

    fn u16(&mut self, number: u16) -> &mut Payload {
        self.bytes(&number.to_le_bytes())
    }

    fn u32(&mut self, number: u32) -> &mut Payload {
        self.bytes(&number.to_le_bytes())
    }

    fn u64(&mut self, number: u64) -> &mut Payload {
        self.bytes(&number.to_le_bytes())
    }

    fn i32(&mut self, number: i32) -> &mut Payload {
        self.bytes(&number.to_le_bytes())
    }

    fn f32(&mut self, number: f64) -> &mut Payload {
        self.bytes(&(number as f32).to_le_bytes())
    }
}
