//! The telemetry of an autopilot.

use std::ops::RangeInclusive;

use kittiwake_proto::v1;

use crate::fmu::{
    Attitude, Battery, FailsafeReason, Failure, FlightMode, GlobalPosition, Gripper, LandDetected, LocalPosition,
    Status, TrafficKind, TransponderReport, Wind,
};
use crate::geodesy::Origin;
use crate::wire::{InvalidMessage, failsafe_reason, finite, flight_mode, gripper, out_of_range};

impl From<Status> for v1::VehicleStatus {
    fn from(status: Status) -> v1::VehicleStatus {
        let mode = |it: Option<FlightMode>| it.map_or(v1::FlightMode::Unspecified, v1::FlightMode::from) as i32;
        v1::VehicleStatus {
            armed: status.armed,
            intended_mode: mode(status.intended),
            actual_mode: mode(status.actual),
            failsafe: status.failsafe,
            failures: status.failures.into_iter().map(|it| v1::FailureFlag::from(it) as i32).collect(),
            origin: status.origin.map(Into::into),
            gripper: status.gripper.map_or(v1::Gripper::Unspecified, v1::Gripper::from) as i32,
            landing_target_seen: status.landing_target_seen,
            commanded_by_other: status.commanded_by_other,
            reason: status.reason,
            can_arm: status.can_arm,
            frame_epoch: status.frame_epoch,
            vibration_m_s2: status.vibration_m_s2,
            failsafe_reason: status.failsafe_reason.map_or(v1::FailsafeReason::Unspecified, Into::into) as i32,
            timestamp_us: status.timestamp_us,
        }
    }
}

/// Never invalid: failures and modes without a name here are left out, and so is an origin that no place on Earth has. Who
/// depends on the origin converts it from the message, and learns what is wrong with it.
impl From<v1::VehicleStatus> for Status {
    fn from(message: v1::VehicleStatus) -> Status {
        Status {
            armed: message.armed,
            intended: flight_mode(message.intended_mode()),
            actual: flight_mode(message.actual_mode()),
            failsafe: message.failsafe,
            failures: message.failures().filter_map(failure).collect(),
            origin: message.origin.and_then(|it| Origin::try_from(it).ok()),
            gripper: gripper(message.gripper()),
            landing_target_seen: message.landing_target_seen,
            commanded_by_other: message.commanded_by_other,
            failsafe_reason: failsafe_reason(message.failsafe_reason()),
            can_arm: message.can_arm,
            frame_epoch: message.frame_epoch,
            timestamp_us: message.timestamp_us,
            reason: message.reason,
            // One that makes no sense is not known: it must not hide the rest of the status.
            vibration_m_s2: message.vibration_m_s2.filter(|it| it.is_finite() && 0.0 <= *it),
        }
    }
}

impl From<FailsafeReason> for v1::FailsafeReason {
    fn from(reason: FailsafeReason) -> v1::FailsafeReason {
        match reason {
            FailsafeReason::Setpoints => v1::FailsafeReason::Setpoints,
            FailsafeReason::Other => v1::FailsafeReason::Other,
        }
    }
}

impl From<Gripper> for v1::Gripper {
    fn from(gripper: Gripper) -> v1::Gripper {
        match gripper {
            Gripper::Holding => v1::Gripper::Holding,
            Gripper::Released => v1::Gripper::Released,
            Gripper::Silent => v1::Gripper::Silent,
        }
    }
}

impl From<Failure> for v1::FailureFlag {
    fn from(failure: Failure) -> v1::FailureFlag {
        match failure {
            Failure::OffboardSignalLost => v1::FailureFlag::OffboardSignalLost,
            Failure::GnssLost => v1::FailureFlag::GnssLost,
            Failure::Estimator => v1::FailureFlag::Estimator,
            Failure::Motor => v1::FailureFlag::Motor,
            Failure::Battery => v1::FailureFlag::Battery,
            Failure::GroundLinkLost => v1::FailureFlag::GroundLinkLost,
        }
    }
}

fn failure(flag: v1::FailureFlag) -> Option<Failure> {
    match flag {
        v1::FailureFlag::Unspecified => None,
        v1::FailureFlag::OffboardSignalLost => Some(Failure::OffboardSignalLost),
        v1::FailureFlag::GnssLost => Some(Failure::GnssLost),
        v1::FailureFlag::Estimator => Some(Failure::Estimator),
        v1::FailureFlag::Motor => Some(Failure::Motor),
        v1::FailureFlag::Battery => Some(Failure::Battery),
        v1::FailureFlag::GroundLinkLost => Some(Failure::GroundLinkLost),
    }
}

impl From<Attitude> for v1::VehicleAttitude {
    fn from(attitude: Attitude) -> v1::VehicleAttitude {
        let Attitude { q_w, q_x, q_y, q_z, roll_rate_rad_s, pitch_rate_rad_s, yaw_rate_rad_s } = attitude;
        v1::VehicleAttitude { q_w, q_x, q_y, q_z, roll_rate_rad_s, pitch_rate_rad_s, yaw_rate_rad_s }
    }
}

impl TryFrom<v1::VehicleAttitude> for Attitude {
    type Error = InvalidMessage;
    fn try_from(message: v1::VehicleAttitude) -> Result<Attitude, InvalidMessage> {
        let v1::VehicleAttitude { q_w, q_x, q_y, q_z, .. } = message;
        // The length of a quaternion that was rounded to single precision is much closer to 1 than this.
        within("q", q_w * q_w + q_x * q_x + q_y * q_y + q_z * q_z, 0.98..=1.02, "a square of length of 1")?;
        Ok(Attitude {
            q_w,
            q_x,
            q_y,
            q_z,
            roll_rate_rad_s: finite("roll_rate_rad_s", message.roll_rate_rad_s)?,
            pitch_rate_rad_s: finite("pitch_rate_rad_s", message.pitch_rate_rad_s)?,
            yaw_rate_rad_s: finite("yaw_rate_rad_s", message.yaw_rate_rad_s)?,
        })
    }
}

impl From<LocalPosition> for v1::VehicleLocalPosition {
    fn from(local: LocalPosition) -> v1::VehicleLocalPosition {
        v1::VehicleLocalPosition {
            position: Some(local.position.into()),
            velocity: Some(local.velocity.into()),
            heading_rad: local.heading_rad,
            horizontal_valid: local.horizontal_valid,
            vertical_valid: local.vertical_valid,
            eph_m: local.eph_m,
            epv_m: local.epv_m,
            timestamp_us: local.timestamp_us,
        }
    }
}

impl TryFrom<v1::VehicleLocalPosition> for LocalPosition {
    type Error = InvalidMessage;
    fn try_from(message: v1::VehicleLocalPosition) -> Result<LocalPosition, InvalidMessage> {
        Ok(LocalPosition {
            position: message.position.ok_or(InvalidMessage::Missing("position"))?.try_into()?,
            velocity: message.velocity.ok_or(InvalidMessage::Missing("velocity"))?.try_into()?,
            heading_rad: finite("heading_rad", message.heading_rad)?,
            horizontal_valid: message.horizontal_valid,
            vertical_valid: message.vertical_valid,
            eph_m: deviation("eph_m", message.eph_m)?,
            epv_m: deviation("epv_m", message.epv_m)?,
            timestamp_us: message.timestamp_us,
        })
    }
}

impl From<GlobalPosition> for v1::VehicleGlobalPosition {
    fn from(global: GlobalPosition) -> v1::VehicleGlobalPosition {
        let GlobalPosition { latitude_deg, longitude_deg, altitude_amsl_m, eph_m, epv_m } = global;
        v1::VehicleGlobalPosition { latitude_deg, longitude_deg, altitude_amsl_m, eph_m, epv_m }
    }
}

impl TryFrom<v1::VehicleGlobalPosition> for GlobalPosition {
    type Error = InvalidMessage;
    fn try_from(message: v1::VehicleGlobalPosition) -> Result<GlobalPosition, InvalidMessage> {
        Ok(GlobalPosition {
            latitude_deg: within("latitude_deg", message.latitude_deg, -90.0..=90.0, "-90 to 90")?,
            longitude_deg: within("longitude_deg", message.longitude_deg, -180.0..=180.0, "-180 to 180")?,
            altitude_amsl_m: within("altitude_amsl_m", message.altitude_amsl_m, -1e6..=1e6, "metres within 1,000 km")?,
            eph_m: deviation("eph_m", message.eph_m)?,
            epv_m: deviation("epv_m", message.epv_m)?,
        })
    }
}

impl From<LandDetected> for v1::VehicleLandDetected {
    fn from(detected: LandDetected) -> v1::VehicleLandDetected {
        let LandDetected { landed, ground_contact, timestamp_us } = detected;
        v1::VehicleLandDetected { landed, ground_contact, timestamp_us }
    }
}

/// Never invalid: it holds no number.
impl From<v1::VehicleLandDetected> for LandDetected {
    fn from(message: v1::VehicleLandDetected) -> LandDetected {
        let v1::VehicleLandDetected { landed, ground_contact, timestamp_us } = message;
        LandDetected { landed, ground_contact, timestamp_us }
    }
}

impl From<Battery> for v1::BatteryStatus {
    fn from(battery: Battery) -> v1::BatteryStatus {
        let Battery { voltage_v, current_a, remaining, temperature_c } = battery;
        v1::BatteryStatus { voltage_v, current_a, remaining, temperature_c }
    }
}

impl TryFrom<v1::BatteryStatus> for Battery {
    type Error = InvalidMessage;
    fn try_from(message: v1::BatteryStatus) -> Result<Battery, InvalidMessage> {
        Ok(Battery {
            voltage_v: within("voltage_v", message.voltage_v, 0.0..=1e4, "0 to 10,000 V")?,
            current_a: message.current_a.map(|it| finite("current_a", it)).transpose()?,
            remaining: within("remaining", message.remaining, 0.0..=1.0, "a fraction from 0 to 1")?,
            temperature_c: message
                .temperature_c
                .map(|it| within("temperature_c", it, -273.15..=1e3, "-273.15 to 1,000 °C"))
                .transpose()?,
        })
    }
}

impl From<Wind> for v1::WindEstimate {
    fn from(Wind { north_m_s, east_m_s }: Wind) -> v1::WindEstimate {
        v1::WindEstimate { north_m_s, east_m_s }
    }
}

impl TryFrom<v1::WindEstimate> for Wind {
    type Error = InvalidMessage;
    fn try_from(message: v1::WindEstimate) -> Result<Wind, InvalidMessage> {
        let component = |field, value| within(field, value, -1e3..=1e3, "below 1,000 m/s");
        Ok(Wind {
            north_m_s: component("north_m_s", message.north_m_s)?,
            east_m_s: component("east_m_s", message.east_m_s)?,
        })
    }
}

impl From<TransponderReport> for v1::TransponderReport {
    fn from(report: TransponderReport) -> v1::TransponderReport {
        v1::TransponderReport {
            id: report.id,
            position: Some(report.position.into()),
            velocity: Some(report.velocity.into()),
            kind: match report.kind {
                TrafficKind::Crewed => v1::TrafficKind::Crewed,
                TrafficKind::Uncrewed => v1::TrafficKind::Uncrewed,
                TrafficKind::Vessel => v1::TrafficKind::Vessel,
            } as i32,
        }
    }
}

impl TryFrom<v1::TransponderReport> for TransponderReport {
    type Error = InvalidMessage;
    fn try_from(message: v1::TransponderReport) -> Result<TransponderReport, InvalidMessage> {
        if message.id.is_empty() {
            return Err(InvalidMessage::Missing("id"));
        }
        // A kind that is not known here is kept away from as from people.
        let kind = match message.kind() {
            v1::TrafficKind::Unspecified | v1::TrafficKind::Crewed => TrafficKind::Crewed,
            v1::TrafficKind::Uncrewed => TrafficKind::Uncrewed,
            v1::TrafficKind::Vessel => TrafficKind::Vessel,
        };
        Ok(TransponderReport {
            kind,
            id: message.id,
            position: message.position.ok_or(InvalidMessage::Missing("position"))?.try_into()?,
            velocity: message.velocity.ok_or(InvalidMessage::Missing("velocity"))?.try_into()?,
        })
    }
}

fn deviation(field: &'static str, value: f64) -> Result<f64, InvalidMessage> {
    within(field, value, 0.0..=1e6, "0 to 1,000 km")
}

/// `value` if it is in `range`; a value that is not a number never is.
fn within(
    field: &'static str,
    value: f64,
    range: RangeInclusive<f64>,
    expected: &'static str,
) -> Result<f64, InvalidMessage> {
    if range.contains(&value) { Ok(value) } else { Err(out_of_range(field, value, expected)) }
}
