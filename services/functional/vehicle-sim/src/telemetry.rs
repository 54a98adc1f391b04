//! The vehicle's state as it says it on the wire, with the noise of its sensors.
//!
//! No reading repeats to the last digit, not even at rest: a real sensor's does not, and that is
//! how one that is stuck gives itself away.

use domain::time::Time;
use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1;

use crate::config::{self, Config};
use crate::frame::{ned, ned_velocity};
use crate::globe::Tangent;
use crate::noise::{Noise, Use};
use crate::pilot::Mode;
use crate::traffic::Traffic;
use crate::vehicle::Vehicle;

/// Noise of the body rates, as of a consumer-grade gyroscope at 240 Hz.
const RATE_NOISE_RAD_S: f64 = 0.002;
/// Noise of the battery's voltage and current, as of a 12 bit converter.
const VOLTAGE_NOISE_V: f64 = 0.005;
const CURRENT_NOISE_A: f64 = 0.03;

/// Makes messages of the vehicle's state.
#[derive(Debug)]
pub struct Telemetry {
    noise: Noise,
    config: config::Estimator,
    tangent: Tangent,
}

impl Telemetry {
    /// With noise of its own.
    pub fn new(config: &Config, seed: u64) -> Telemetry {
        Telemetry {
            noise: Noise::new(seed, Use::Sensors),
            config: config.estimator.clone(),
            tangent: Tangent::new(config.origin.clone()),
        }
    }

    /// What there is to say on `topic` at `now`; nothing on one that is not telemetry.
    pub fn messages(&mut self, topic: Topic, vehicle: &Vehicle, traffic: &Traffic, now: Time) -> Vec<Message> {
        match topic {
            Topic::VehicleStatus => vec![status(vehicle, now).into()],
            Topic::VehicleAttitude => vec![self.attitude(vehicle).into()],
            Topic::VehicleLocalPosition => vec![self.local_position(vehicle, now).into()],
            Topic::VehicleGlobalPosition => vec![self.global_position(vehicle).into()],
            Topic::VehicleLandDetected => vec![land_detected(vehicle, now).into()],
            Topic::BatteryStatus => vec![self.battery(vehicle).into()],
            Topic::WindEstimate => vec![wind(vehicle).into()],
            Topic::TransponderReport => traffic.reports(now).map(Message::from).collect(),
            _ => Vec::new(),
        }
    }

    fn attitude(&mut self, vehicle: &Vehicle) -> v1::VehicleAttitude {
        let attitude = vehicle.body.attitude;
        let rates = vehicle.body.rates + self.noise.vector() * RATE_NOISE_RAD_S;
        v1::VehicleAttitude {
            q_w: attitude.w,
            q_x: attitude.i,
            q_y: attitude.j,
            q_z: attitude.k,
            roll_rate_rad_s: rates.x,
            pitch_rate_rad_s: rates.y,
            yaw_rate_rad_s: rates.z,
        }
    }

    fn local_position(&mut self, vehicle: &Vehicle, now: Time) -> v1::VehicleLocalPosition {
        let estimate = vehicle.estimate();
        let position = estimate.position + self.noise.vector() * self.config.position_noise_m.get();
        let velocity = estimate.velocity + self.noise.vector() * self.config.velocity_noise_m_s.get();
        v1::VehicleLocalPosition {
            position: Some(ned(position).into()),
            velocity: Some(ned_velocity(velocity).into()),
            heading_rad: vehicle.body.heading_rad(),
            horizontal_valid: estimate.horizontal_valid,
            vertical_valid: estimate.vertical_valid,
            eph_m: estimate.eph_m,
            epv_m: estimate.epv_m,
            timestamp_us: microseconds(now),
        }
    }

    fn global_position(&mut self, vehicle: &Vehicle) -> v1::VehicleGlobalPosition {
        let estimate = vehicle.estimate();
        let position = estimate.position + self.noise.vector() * self.config.position_noise_m.get();
        let (latitude_deg, longitude_deg, altitude_amsl_m) = self.tangent.global(ned(position));
        v1::VehicleGlobalPosition {
            latitude_deg,
            longitude_deg,
            altitude_amsl_m,
            eph_m: estimate.eph_m,
            epv_m: estimate.epv_m,
        }
    }

    fn battery(&mut self, vehicle: &Vehicle) -> v1::BatteryStatus {
        v1::BatteryStatus {
            voltage_v: vehicle.battery.voltage_v() + self.noise.unit() * VOLTAGE_NOISE_V,
            current_a: vehicle.battery.current_a() + self.noise.unit() * CURRENT_NOISE_A,
            remaining: vehicle.battery.remaining(),
            temperature_c: vehicle.battery.temperature_c(),
        }
    }
}

fn status(vehicle: &Vehicle, now: Time) -> v1::VehicleStatus {
    v1::VehicleStatus {
        armed: vehicle.is_armed(),
        intended_mode: flight_mode(vehicle.intended()) as i32,
        actual_mode: flight_mode(vehicle.actual()) as i32,
        failsafe: vehicle.failsafe(),
        failures: vehicle.failures(now).into_iter().map(|it| it as i32).collect(),
    }
}

fn wind(vehicle: &Vehicle) -> v1::WindEstimate {
    let wind = vehicle.wind.estimate();
    v1::WindEstimate { north_m_s: wind.x, east_m_s: wind.y }
}

fn land_detected(vehicle: &Vehicle, now: Time) -> v1::VehicleLandDetected {
    let detector = vehicle.land_detector();
    let (landed, ground_contact) = (detector.landed(), detector.ground_contact());
    v1::VehicleLandDetected { landed, ground_contact, timestamp_us: microseconds(now) }
}

/// On the vehicle's clock, which starts with it.
fn microseconds(now: Time) -> u64 {
    now.since_start().as_micros() as u64
}

/// A blind descent shows as a landing, as it does with PX4.
fn flight_mode(mode: Mode) -> v1::FlightMode {
    match mode {
        Mode::Loiter => v1::FlightMode::Loiter,
        Mode::Takeoff { .. } => v1::FlightMode::Takeoff,
        Mode::Land | Mode::Descend => v1::FlightMode::Land,
        Mode::Offboard => v1::FlightMode::Offboard,
    }
}
