//! The vehicle's state as the autopilot reports it, with the noise of its sensors.
//!
//! No reading repeats to the last digit, not even at rest: a real sensor's does not, and that is
//! how one that is stuck is detected.

use domain::fmu::{Attitude, Battery, FlightMode, GlobalPosition, LandDetected, LocalPosition, Status, Wind};
use domain::time::Time;
use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1;

use crate::config::{self, Config};
use crate::frame::{ned, ned_velocity};
use crate::globe::Globe;
use crate::noise::{Noise, NoiseStream};
use crate::pilot::Mode;
use crate::traffic::Traffic;
use crate::vehicle::Vehicle;

/// Noise of the body rates, as of a consumer-grade gyroscope at 240 Hz.
const RATE_NOISE_RAD_S: f64 = 0.002;
/// Noise of the battery's voltage and current, as of a 12 bit converter.
const VOLTAGE_NOISE_V: f64 = 0.005;
const CURRENT_NOISE_A: f64 = 0.03;
/// How much a sound frame shakes. (ArduPilot's documentation: below 15 m/s2 is good.)
const USUAL_VIBRATION_M_S2: f64 = 5.0;

/// Turns the vehicle's state into messages.
#[derive(Debug)]
pub(crate) struct Telemetry {
    noise: Noise,
    config: config::Estimator,
    globe: Globe,
}

impl Telemetry {
    /// Its noise has its own random numbers.
    pub(crate) fn new(config: &Config, seed: u64) -> Telemetry {
        Telemetry {
            noise: Noise::new(seed, NoiseStream::Sensors),
            config: config.estimator.clone(),
            globe: Globe::new(&config.origin),
        }
    }

    /// The messages of `topic` at `now`; none for a topic that is not telemetry.
    pub(crate) fn messages(&mut self, topic: Topic, vehicle: &Vehicle, traffic: &Traffic, now: Time) -> Vec<Message> {
        match topic {
            Topic::VehicleStatus => vec![v1::VehicleStatus::from(self.status(vehicle, now)).into()],
            Topic::VehicleAttitude => vec![v1::VehicleAttitude::from(self.attitude(vehicle)).into()],
            Topic::VehicleLocalPosition => {
                vec![v1::VehicleLocalPosition::from(self.local_position(vehicle, now)).into()]
            }
            Topic::VehicleGlobalPosition => vec![v1::VehicleGlobalPosition::from(self.global_position(vehicle)).into()],
            Topic::VehicleLandDetected => vec![v1::VehicleLandDetected::from(land_detected(vehicle, now)).into()],
            Topic::BatteryStatus => vec![v1::BatteryStatus::from(self.battery(vehicle)).into()],
            Topic::WindEstimate => vec![v1::WindEstimate::from(wind(vehicle)).into()],
            Topic::TransponderReport => {
                traffic.reports(now).map(v1::TransponderReport::from).map(Message::from).collect()
            }
            _ => Vec::new(),
        }
    }

    fn status(&self, vehicle: &Vehicle, now: Time) -> Status {
        Status {
            armed: vehicle.is_armed(),
            intended: flight_mode(vehicle.intended()),
            actual: flight_mode(vehicle.actual()),
            failsafe: vehicle.failsafe(),
            failures: vehicle.failures(now),
            origin: Some(self.globe.origin_at(ned(-vehicle.boot.frame_offset))),
            gripper: Some(vehicle.gripper.report()),
            landing_target_seen: vehicle.landing_target_seen(),
            commanded_by_other: vehicle.others.has_chosen(),
            reason: vehicle.reason(now),
            can_arm: Some(vehicle.can_arm(now)),
            frame_epoch: vehicle.boot.epoch,
            vibration_m_s2: Some(USUAL_VIBRATION_M_S2 + vehicle.vibration_m_s2).filter(|_| vehicle.is_armed()),
            failsafe_reason: vehicle.failsafe_reason(),
            timestamp_us: vehicle.boot.microseconds(now),
        }
    }

    fn attitude(&mut self, vehicle: &Vehicle) -> Attitude {
        let attitude = vehicle.body.attitude;
        let rates = vehicle.body.rates + self.noise.vector() * RATE_NOISE_RAD_S;
        Attitude {
            q_w: attitude.w,
            q_x: attitude.i,
            q_y: attitude.j,
            q_z: attitude.k,
            roll_rate_rad_s: rates.x,
            pitch_rate_rad_s: rates.y,
            yaw_rate_rad_s: rates.z,
        }
    }

    fn local_position(&mut self, vehicle: &Vehicle, now: Time) -> LocalPosition {
        let estimate = vehicle.estimate();
        let position = estimate.position + vehicle.boot.frame_offset;
        let position = position + self.noise.vector() * self.config.position_noise_m.get();
        let velocity = estimate.velocity + self.noise.vector() * self.config.velocity_noise_m_s.get();
        LocalPosition {
            position: ned(position),
            velocity: ned_velocity(velocity),
            heading_rad: vehicle.body.heading_rad() + vehicle.heading_error_rad,
            horizontal_valid: estimate.horizontal_valid,
            vertical_valid: estimate.vertical_valid,
            eph_m: estimate.eph_m,
            epv_m: estimate.epv_m,
            timestamp_us: vehicle.boot.microseconds(now),
        }
    }

    fn global_position(&mut self, vehicle: &Vehicle) -> GlobalPosition {
        let estimate = vehicle.estimate();
        let position = estimate.position + self.noise.vector() * self.config.position_noise_m.get();
        let (latitude_deg, longitude_deg, altitude_amsl_m) = self.globe.global(ned(position));
        let (eph_m, epv_m) = (estimate.eph_m, estimate.epv_m);
        GlobalPosition { latitude_deg, longitude_deg, altitude_amsl_m, eph_m, epv_m }
    }

    fn battery(&mut self, vehicle: &Vehicle) -> Battery {
        Battery {
            voltage_v: vehicle.battery.voltage_v() + self.noise.unit() * VOLTAGE_NOISE_V,
            current_a: Some(vehicle.battery.current_a() + self.noise.unit() * CURRENT_NOISE_A),
            remaining: vehicle.battery.remaining(),
            temperature_c: Some(vehicle.battery.temperature_c()),
        }
    }
}

fn wind(vehicle: &Vehicle) -> Wind {
    let wind = vehicle.wind.estimate();
    Wind { north_m_s: wind.x, east_m_s: wind.y }
}

fn land_detected(vehicle: &Vehicle, now: Time) -> LandDetected {
    let detector = vehicle.land_detector();
    let landed = vehicle.detector_stuck.unwrap_or(detector.landed());
    let ground_contact = vehicle.detector_stuck.unwrap_or(detector.ground_contact());
    LandDetected { landed, ground_contact, timestamp_us: vehicle.boot.microseconds(now) }
}

/// A blind descent is reported as a landing, as PX4 does.
fn flight_mode(mode: Mode) -> Option<FlightMode> {
    match mode {
        Mode::Loiter => Some(FlightMode::Loiter),
        Mode::Takeoff { .. } => Some(FlightMode::Takeoff),
        Mode::Land | Mode::Descend => Some(FlightMode::Land),
        Mode::Offboard => Some(FlightMode::Offboard),
        Mode::Return => Some(FlightMode::Return),
        Mode::Manual => None,
    }
}
