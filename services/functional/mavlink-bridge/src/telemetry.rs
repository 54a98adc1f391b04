//! What the autopilot said, in the vocabulary of the `fmu/` topics. What it does not say is left out.

use std::time::Duration;

use domain::fmu;
use domain::geodesy::{LatLon, LocalFrame, Origin};
use domain::geometry::{Ned, NedVelocity};
use domain::time::{Now, Time};
use kittiwake_proto::v1;
use node::Effect;

use crate::heard::{Battery, GlobalPosition, Heard, LocalPosition, Traffic};
use crate::personality::Personality;
use crate::vehicle::{FRESH, Vehicle, landed};

/// ESTIMATOR_STATUS_FLAGS, the same bits in ArduPilot's EKF_STATUS_REPORT.
mod flags {
    pub(super) const POS_HORIZ_ABS: u16 = 16;
    pub(super) const POS_VERT_ABS: u16 = 32;
    pub(super) const CONST_POS_MODE: u16 = 128;
}

/// A receiver that gives no accuracy: worse than this it is not in the open. (ENG)
const UNKNOWN_ACCURACY_M: f64 = 10.0;
/// GPS_FIX_TYPE_3D_FIX.
const FIX_3D: u8 = 3;

/// What is published of a message.
pub(crate) fn published(heard: &Heard, vehicle: &Vehicle, now: Now) -> Option<Effect> {
    Some(match heard {
        Heard::Landed(it) => Effect::publish(v1::VehicleLandDetected::from(land_detected(*it, vehicle, now)?)),
        Heard::LocalPosition(it) => Effect::publish(v1::VehicleLocalPosition::from(local_position(it, vehicle, now)?)),
        Heard::GlobalPosition(it) => {
            Effect::publish(v1::VehicleGlobalPosition::from(global_position(it, vehicle, now.time)?))
        }
        Heard::Attitude { q, rates } => Effect::publish(v1::VehicleAttitude::from(attitude(*q, *rates)?)),
        Heard::Battery(it) => Effect::publish(v1::BatteryStatus::from(battery(it)?)),
        Heard::Wind([north_m_s, east_m_s]) if north_m_s.is_finite() && east_m_s.is_finite() => {
            let wind = fmu::Wind { north_m_s: *north_m_s, east_m_s: *east_m_s };
            Effect::publish(v1::WindEstimate::from(wind))
        }
        Heard::Traffic(it) => Effect::publish(v1::TransponderReport::from(traffic(it, origin(vehicle))?)),
        _ => return None,
    })
}

/// A measure of vibration counts for this long: it is sent once a second, and a silent link must first count as silent
/// before that changes anything.
const VIBRATION_AGE: Duration = Duration::from_secs(10);

/// How much the frame shakes, in m/s2, while the motors run.
pub(crate) fn vibration_m_s2(vehicle: &Vehicle, personality: &dyn Personality, now: Time) -> Option<f64> {
    let (_, said) = vehicle.vibration.filter(|(at, _)| vehicle.is_armed() && now - *at <= VIBRATION_AGE)?;
    Some(personality.vibration_m_s2(said)).filter(|it| (0.0..=1e3).contains(it))
}

/// Whether the estimator vouches for the position, horizontally and vertically. One that is silent does not.
fn validity(vehicle: &Vehicle, now: Time) -> (bool, bool) {
    match vehicle.estimator {
        Some((at, flags, ..)) if now - at <= FRESH => {
            (flags & flags::POS_HORIZ_ABS != 0 && flags & flags::CONST_POS_MODE == 0, flags & flags::POS_VERT_ABS != 0)
        }
        _ => (false, false),
    }
}

/// One standard deviation, horizontal and vertical: the estimator's own, that of the receiver, or that of a poor one.
fn accuracy_m(vehicle: &Vehicle, now: Time) -> (f64, f64) {
    let of_estimator = vehicle.estimator.filter(|(at, ..)| now - *at <= FRESH).and_then(|(_, _, it, _)| it);
    let of_receiver = vehicle.gnss.filter(|(at, ..)| now - *at <= FRESH).and_then(|(.., it)| it);
    let finite = |it: &(f64, f64)| it.0.is_finite() && it.1.is_finite() && 0.0 <= it.0 && 0.0 <= it.1;
    of_estimator.filter(finite).or(of_receiver).unwrap_or((UNKNOWN_ACCURACY_M, UNKNOWN_ACCURACY_M))
}

/// The position in the local frame, whose origin is the estimator's. `None` if one of its values is not a number.
fn local_position(it: &LocalPosition, vehicle: &Vehicle, now: Now) -> Option<fmu::LocalPosition> {
    let [north_m, east_m, down_m] = it.position;
    let [north_m_s, east_m_s, down_m_s] = it.velocity;
    let heading_rad = vehicle.global.and_then(|(_, it)| it.heading_rad).unwrap_or(0.0);
    let (horizontal_valid, vertical_valid) = validity(vehicle, now.time);
    let (eph_m, epv_m) = accuracy_m(vehicle, now.time);
    let is_finite = it.position.iter().chain(&it.velocity).all(|it| it.is_finite());
    is_finite.then(|| fmu::LocalPosition {
        position: Ned::new(north_m, east_m, down_m),
        velocity: NedVelocity::new(north_m_s, east_m_s, down_m_s),
        heading_rad: wrapped(heading_rad),
        horizontal_valid,
        vertical_valid,
        eph_m,
        epv_m,
        timestamp_us: timestamp_us(now),
    })
}

/// The position on the globe; `None` while the satellite receiver has no fix, since it is (0, 0) then.
pub(crate) fn global_position(it: &GlobalPosition, vehicle: &Vehicle, now: Time) -> Option<fmu::GlobalPosition> {
    let is_known = it.latitude_deg != 0.0 || it.longitude_deg != 0.0;
    let (eph_m, epv_m) = accuracy_m(vehicle, now);
    (is_known && LatLon::new(it.latitude_deg, it.longitude_deg).is_ok()).then_some(fmu::GlobalPosition {
        latitude_deg: it.latitude_deg,
        longitude_deg: it.longitude_deg,
        altitude_amsl_m: it.altitude_m,
        eph_m,
        epv_m,
    })
}

/// The attitude; `None` if the numbers are not one.
fn attitude(q: [f64; 4], rates: [f64; 3]) -> Option<fmu::Attitude> {
    let length = q.iter().map(|it| it * it).sum::<f64>().sqrt();
    let is_attitude = (length - 1.0).abs() < 0.01 && rates.iter().all(|it| it.is_finite());
    let [q_w, q_x, q_y, q_z] = q.map(|it| it / length);
    let [roll_rate_rad_s, pitch_rate_rad_s, yaw_rate_rad_s] = rates;
    is_attitude.then_some(fmu::Attitude { q_w, q_x, q_y, q_z, roll_rate_rad_s, pitch_rate_rad_s, yaw_rate_rad_s })
}

/// The land detector's statement; `None` while it is undecided, and where it reports the ground of a vehicle that falls: both
/// autopilots do so after a disarming in the air.
fn land_detected(state: u8, vehicle: &Vehicle, now: Now) -> Option<fmu::LandDetected> {
    /// Faster than this up or down nothing stands. (ENG: ten times the noise of a vehicle that stands.)
    const MOVING_M_S: f64 = 1.0;
    let moves = vehicle.local_now(now.time).is_some_and(|it| MOVING_M_S < it.velocity[2].abs());
    let is_known = state != landed::UNDEFINED && state <= 4 && !(state == landed::ON_GROUND && moves);
    let landed = state == landed::ON_GROUND;
    is_known.then(|| fmu::LandDetected { landed, ground_contact: landed, timestamp_us: timestamp_us(now) })
}

/// The battery; `None` if it does not measure its charge and its voltage.
fn battery(it: &Battery) -> Option<fmu::Battery> {
    Some(fmu::Battery {
        voltage_v: it.voltage_v?,
        remaining: it.remaining?,
        current_a: it.current_a,
        temperature_c: it.temperature_c,
    })
}

/// Another aircraft, where the origin of the local frame is known.
fn traffic(it: &Traffic, origin: Option<Origin>) -> Option<fmu::TransponderReport> {
    /// ADSB_EMITTER_TYPE_UAV.
    const UAV: u8 = 14;
    let origin = origin?;
    let place = LatLon::new(it.latitude_deg, it.longitude_deg).ok()?;
    let [north_m_s, east_m_s, down_m_s] = it.velocity;
    let height_m = it.altitude_m - origin.altitude_m?;
    Some(fmu::TransponderReport {
        id: it.id.clone(),
        position: LocalFrame::at(origin.place).local(place).at_height(height_m),
        velocity: NedVelocity::new(north_m_s, east_m_s, down_m_s),
        // What is not known to be without people counts as with them.
        kind: if it.emitter == UAV { fmu::TrafficKind::Uncrewed } else { fmu::TrafficKind::Crewed },
    })
}

/// The origin of the local frame.
pub(crate) fn origin(vehicle: &Vehicle) -> Option<Origin> {
    let [latitude, longitude, altitude] = vehicle.origin?;
    let place = LatLon::new(f64::from(latitude) * 1e-7, f64::from(longitude) * 1e-7).ok()?;
    Some(Origin { place, altitude_m: Some(f64::from(altitude) / 1e3) })
}

/// The failures that have a name here.
pub(crate) fn failures(vehicle: &Vehicle, signal_lost: bool, now: Time) -> Vec<fmu::Failure> {
    /// MAV_BATTERY_CHARGE_STATE_CRITICAL, and worse up to UNHEALTHY; CHARGING is 7.
    const CRITICAL: std::ops::RangeInclusive<u8> = 3..=6;
    let no_fix = vehicle.gnss.is_some_and(|(at, fix, _)| now - at <= FRESH && fix < FIX_3D);
    let glitches = vehicle.estimator.is_some_and(|(at, .., glitches)| now - at <= FRESH && glitches);
    let (horizontal, vertical) = validity(vehicle, now);
    let is_critical = vehicle.battery.is_some_and(|(at, it)| now - at <= FRESH && CRITICAL.contains(&it.charge_state));
    let failures = [
        (signal_lost, fmu::Failure::OffboardSignalLost),
        (no_fix || glitches, fmu::Failure::GnssLost),
        (!horizontal || !vertical, fmu::Failure::Estimator),
        (is_critical, fmu::Failure::Battery),
    ];
    failures.into_iter().filter_map(|(holds, failure)| holds.then_some(failure)).collect()
}

/// UTC: it goes on when the autopilot or this process is started again.
fn timestamp_us(now: Now) -> u64 {
    now.utc_ms.max(0) as u64 * 1_000
}

fn wrapped(angle_rad: f64) -> f64 {
    angle_rad.sin().atan2(angle_rad.cos())
}
