//! What it sends: the body's telemetry as PX4's messages, and the commander's own.

use std::time::Duration;

use domain::geometry::Ned;
use kittiwake_proto::topics::Message;
use px4_bridge::cdr::{CdrError, Record};
use px4_bridge::modes::NavState;
use px4_bridge::port::Arrival;

use crate::{FakePx4, STATUS, STATUS_IS_LATE};

/// PX4 sends more than the message, with whatever was in its memory.
const RUBBISH: [u8; 28] = [0xa5; 28];
/// The noise of the turn rates becomes that of the attitude over this time.
const SHAKE_S: f64 = 1e-3;
/// The simulated battery of PX4: `SIM_BAT_DRAIN`, `SIM_BAT_MIN_PCT`, and the voltages of four cells.
const BATTERY_LASTS_S: f64 = 60.0;
const LEAST_CHARGE: f64 = 0.5;
const EMPTY_V: f64 = 14.4;
const FULL_V: f64 = 16.2;
/// `VehicleStatus.ARMING_STATE_DISARMED`, and armed.
const DISARMED: f64 = 1.0;
const ARMED: f64 = 2.0;
/// The modes that need each, as a quadrotor reported them.
const NEEDS: [(&str, f64); 8] = [
    ("mode_req_attitude", 8_311_166.0),
    ("mode_req_local_alt", 8_257_918.0),
    ("mode_req_local_position", 7_995_448.0),
    ("mode_req_local_position_relaxed", 262_212.0),
    ("mode_req_global_position", 56.0),
    ("mode_req_mission", 8.0),
    ("mode_req_offboard_signal", 16_384.0),
    ("mode_req_manual_control", 34_119.0),
];

impl FakePx4 {
    /// A message of the body: remembered, and sent as PX4 would.
    pub(crate) fn report(&mut self, message: Message) {
        let offset = self.commander.offset;
        let valid = self.knows_position();
        let at = self.timestamp();
        match message {
            Message::VehicleStatus(it) => self.newest.status = it,
            Message::VehicleAttitude(it) => self.send("vehicle_attitude", |sample| {
                sample.set_number("timestamp_sample", at)?;
                // No two attitudes of a real one are the same, not even on the ground.
                let (q_x, q_y) = (it.q_x + it.roll_rate_rad_s * SHAKE_S, it.q_y + it.pitch_rate_rad_s * SHAKE_S);
                for (index, value) in [it.q_w, q_x, q_y, it.q_z].into_iter().enumerate() {
                    sample.set_number_at("q", index, value)?;
                }
                Ok(())
            }),
            Message::VehicleLocalPosition(it) => {
                self.newest.position = it;
                let (p, v) = (it.position.unwrap_or_default(), it.velocity.unwrap_or_default());
                let origin = self.newest.status.origin.filter(|_| valid);
                let p = self.in_its_frame(Ned::new(p.north_m, p.east_m, p.down_m));
                self.send("vehicle_local_position", |sample| {
                    sample.set_number("timestamp_sample", at)?;
                    sample.set_flag("xy_valid", it.horizontal_valid && valid)?;
                    sample.set_flag("v_xy_valid", it.horizontal_valid && valid)?;
                    sample.set_flag("z_valid", it.vertical_valid && valid)?;
                    sample.set_flag("v_z_valid", it.vertical_valid && valid)?;
                    let numbers = [
                        ("x", p.north_m - offset.north_m),
                        ("y", p.east_m - offset.east_m),
                        ("z", p.down_m),
                        ("vx", v.north_m_s),
                        ("vy", v.east_m_s),
                        ("vz", v.down_m_s),
                        ("heading", it.heading_rad),
                        ("eph", it.eph_m),
                        ("epv", it.epv_m),
                        ("vxy_max", f64::INFINITY),
                        ("ref_lat", origin.map_or(f64::NAN, |it| it.latitude_deg)),
                        ("ref_lon", origin.map_or(f64::NAN, |it| it.longitude_deg)),
                        ("ref_alt", origin.and_then(|it| it.altitude_amsl_m).unwrap_or(f64::NAN)),
                        ("ref_timestamp", if valid { 768_000.0 } else { 0.0 }),
                    ];
                    for (field, value) in numbers {
                        sample.set_number(field, value)?;
                    }
                    sample.set_flag("xy_global", origin.is_some())?;
                    sample.set_flag("z_global", origin.is_some())
                });
            }
            Message::VehicleGlobalPosition(it) => self.send("vehicle_global_position", |sample| {
                sample.set_number("lat", it.latitude_deg)?;
                sample.set_number("lon", it.longitude_deg)?;
                sample.set_number("alt", it.altitude_amsl_m)?;
                sample.set_number("eph", it.eph_m)?;
                sample.set_number("epv", it.epv_m)?;
                sample.set_flag("lat_lon_valid", valid)?;
                sample.set_flag("alt_valid", valid)
            }),
            Message::VehicleLandDetected(it) => {
                self.newest.landed = it;
                self.send("vehicle_land_detected", |sample| {
                    sample.set_flag("ground_contact", it.ground_contact)?;
                    sample.set_flag("maybe_landed", it.landed)?;
                    sample.set_flag("landed", it.landed)
                });
            }
            Message::BatteryStatus(it) => {
                // As in SITL: half the charge within half a minute of turning motors, then constant, without noise.
                let drained = self.armed_for.as_secs_f64() / BATTERY_LASTS_S;
                let remaining = it.remaining.min((1.0 - drained).max(LEAST_CHARGE));
                let warning = f64::from(self.commander.battery_warning);
                self.send("battery_status", |sample| {
                    sample.set_flag("connected", true)?;
                    sample.set_number("voltage_v", EMPTY_V + (FULL_V - EMPTY_V) * remaining)?;
                    // As in SITL: neither the current nor the temperature is measured.
                    sample.set_number("current_a", -1.0)?;
                    sample.set_number("remaining", remaining)?;
                    sample.set_number("temperature", f64::NAN)?;
                    sample.set_number("warning", warning)
                });
            }
            _ => {}
        }
    }

    /// Status and flags, if they have changed or are due.
    pub(crate) fn report_status(&mut self) {
        let NavState(intended) = self.commander.intended;
        let NavState(actual) = self.commander.actual;
        let (armed, failsafe, passes) = (self.is_armed(), self.commander.failsafe, self.checks_pass());
        self.send_on_change("vehicle_status", |sample| {
            sample.set_number("arming_state", if armed { ARMED } else { DISARMED })?;
            sample.set_number("nav_state_user_intention", f64::from(intended))?;
            sample.set_number("nav_state", f64::from(actual))?;
            sample.set_flag("failsafe", failsafe)?;
            sample.set_flag("gcs_connection_lost", true)?;
            sample.set_number("system_id", 1.0)?;
            sample.set_number("component_id", 1.0)?;
            sample.set_flag("pre_flight_checks_pass", passes)
        });
        let (blind, lost) = (!self.knows_position(), !self.is_fresh());
        let (breached, warning) = (self.commander.breached, f64::from(self.commander.battery_warning));
        self.send_on_change("failsafe_flags", |sample| {
            for (field, modes) in NEEDS {
                sample.set_number(field, modes)?;
            }
            for field in ["local_position_invalid", "local_altitude_invalid", "global_position_invalid"] {
                sample.set_flag(field, blind)?;
            }
            sample.set_flag("offboard_control_signal_lost", lost)?;
            sample.set_flag("manual_control_signal_lost", true)?;
            sample.set_flag("gcs_connection_lost", true)?;
            sample.set_flag("auto_mission_missing", true)?;
            sample.set_flag("geofence_breached", breached)?;
            sample.set_number("battery_warning", warning)
        });
    }

    fn send_on_change(&mut self, topic: &'static str, fill: impl Fn(&mut Record<'_>) -> Result<(), CdrError>) {
        let definition = self.definitions.newest(topic).expect("a topic of the table").clone();
        let mut sample = Record::zero(&definition);
        fill(&mut sample).expect("fields of the table");
        let content = sample.encode();
        let is_due = self.next_status.get(topic).is_none_or(|it| *it <= self.now);
        if is_due || self.last_status.get(topic) != Some(&content) {
            self.next_status.insert(topic, self.now + STATUS);
            self.last_status.insert(topic, content);
            self.send(topic, fill);
        }
    }

    /// Sends a message of `topic`, with its time.
    pub(crate) fn send(&mut self, topic: &'static str, fill: impl Fn(&mut Record<'_>) -> Result<(), CdrError>) {
        if self.muted.contains(&topic) {
            return;
        }
        let definition = self.definitions.newest(topic).expect("a topic of the table");
        let mut sample = Record::zero(definition);
        let filled = sample.set_number("timestamp", self.timestamp()).and_then(|()| fill(&mut sample));
        filled.expect("fields of the table");
        let key =
            format!("0/fmu/out/{topic}/px4_msgs::msg::dds_::{}_/RIHS01_{}", definition.type_name, definition.hash);
        let payload = [sample.encode(), RUBBISH.to_vec()].concat();
        let delay = if topic == "vehicle_status" { STATUS_IS_LATE } else { Duration::ZERO };
        self.outgoing.push((self.now + delay, Arrival::Sample { key, payload }));
    }

    /// Microseconds since it was started.
    fn timestamp(&self) -> f64 {
        (self.now - self.boot).as_micros() as f64
    }
}
