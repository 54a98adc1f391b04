//! The gateway's document as ROS's messages: metres and radians; east, north, up in the frame `map`, whose origin is the take-off point;
//! forward, left, up in `base_link` (REP 103, REP 105).

use kittiwake_proto::v1;
use kittiwake_proto::v1::{Alarm, FailureFlag};

use crate::cdr::Writer;
use crate::stamp::Stamp;

/// The frames, with the vehicle's name before them.
#[derive(Debug)]
pub(crate) struct Frames {
    map: String,
    base: String,
}

impl Frames {
    pub(crate) fn of(vehicle: &str) -> Frames {
        Frames { map: format!("{vehicle}/map"), base: format!("{vehicle}/base_link") }
    }

    /// `sensor_msgs/msg/NavSatFix`; `None` while the place is not known.
    ///
    /// The altitude is not a number: ROS wants it above the ellipsoid, and the vehicle knows it above mean sea level.
    pub(crate) fn fix(&self, stamp: Stamp, it: &v1::vehicle::Aircraft) -> Option<Vec<u8>> {
        let place = it.global_position.as_ref()?;
        let lost = it.status.as_ref().is_some_and(|it| it.failures().any(|it| it == FailureFlag::GnssLost));
        let (horizontal, vertical) = (place.eph_m.powi(2), place.epv_m.powi(2));
        let message = Writer::default()
            .header(stamp, &self.base)
            // STATUS_NO_FIX or STATUS_FIX, of GPS.
            .i8(if lost { -1 } else { 0 })
            .u16(1)
            .f64s([place.latitude_deg, place.longitude_deg, f64::NAN])
            .f64s([horizontal, 0.0, 0.0, 0.0, horizontal, 0.0, 0.0, 0.0, vertical])
            // COVARIANCE_TYPE_DIAGONAL_KNOWN.
            .u8(2);
        Some(message.end())
    }

    /// `nav_msgs/msg/Odometry`; `None` while position or attitude are not known. Covariances that are not known are zero.
    pub(crate) fn odometry(&self, stamp: Stamp, it: &v1::vehicle::Aircraft) -> Option<Vec<u8>> {
        let (local, attitude) = (it.local_position.as_ref()?, it.attitude.as_ref()?);
        let (position, velocity) = (local.position.as_ref()?, local.velocity.as_ref()?);
        let mut of_pose = [0.0; 36];
        for (axis, deviation_m) in [(0, local.eph_m), (7, local.eph_m), (14, local.epv_m)] {
            of_pose[axis] = deviation_m.powi(2);
        }
        let message = Writer::default()
            .header(stamp, &self.map)
            .string(&self.base)
            .f64s(east_north_up(position))
            .f64s(orientation(attitude))
            .f64s(of_pose)
            .f64s(in_body([velocity.north_m_s, velocity.east_m_s, velocity.down_m_s], attitude))
            .f64s([attitude.roll_rate_rad_s, -attitude.pitch_rate_rad_s, -attitude.yaw_rate_rad_s])
            .f64s([0.0; 36]);
        Some(message.end())
    }

    /// `sensor_msgs/msg/BatteryState`; `None` while it is not known. What is not measured is not a number.
    pub(crate) fn battery(&self, stamp: Stamp, it: &v1::vehicle::Aircraft) -> Option<Vec<u8>> {
        let battery = it.battery.as_ref()?;
        let message = Writer::default()
            .header(stamp, &self.base)
            .f32(battery.voltage_v)
            .f32(battery.temperature_c.unwrap_or(f64::NAN))
            // Negative while it discharges.
            .f32(battery.current_a.map_or(f64::NAN, |it| -it))
            // Charge, capacity and design capacity, in ampere hours.
            .f32(f64::NAN)
            .f32(f64::NAN)
            .f32(f64::NAN)
            .f32(battery.remaining)
            // Status, health and technology: unknown.
            .bytes(&[0, 0, 0])
            .bool(true)
            .each([], Writer::f32)
            .each([], Writer::f32)
            .string("")
            .string("");
        Some(message.end())
    }

    /// `nav_msgs/msg/Path`: from where the vehicle is to the ends of the steps that are left. Empty without a plan.
    pub(crate) fn plan(&self, stamp: Stamp, it: &v1::Vehicle) -> Vec<u8> {
        let steps = it.plan.iter().flat_map(|it| &it.action_track);
        let mut places: Vec<_> = steps.filter_map(|it| it.goal_state.as_ref()?.position).collect();
        let here = it.aircraft.as_ref().and_then(|it| it.local_position.as_ref()?.position);
        if let (Some(here), false) = (here, places.is_empty()) {
            places.insert(0, here);
        }
        let pose = |writer: Writer, place: v1::Ned| {
            writer.header(stamp, &self.map).f64s(east_north_up(&place)).f64s([0.0, 0.0, 0.0, 1.0])
        };
        Writer::default().header(stamp, &self.map).each(places, pose).end()
    }
}

/// How well something is, as `diagnostic_msgs/msg/DiagnosticStatus` has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Level {
    Ok = 0,
    Warn = 1,
    Error = 2,
    Stale = 3,
}

/// One status: its name, how well it is, and why.
pub(crate) type Diagnosis = (String, Level, String);

/// The contact, the mission, each contingency and each process.
pub(crate) fn diagnose(it: &v1::Vehicle) -> Vec<Diagnosis> {
    let mut all = Vec::new();
    let contact = it.contact.unwrap_or_default();
    let heard = contact.wall_age_s.map_or("never heard".to_owned(), |age| format!("heard {age:.1} s ago"));
    all.push(("contact".to_owned(), if contact.lost { Level::Stale } else { Level::Ok }, heard));
    if let Some(mission) = &it.mission {
        let phase = lower(mission.phase().as_str_name(), "MISSION_PHASE_");
        all.push(("mission".to_owned(), Level::Ok, format!("{}: {phase}", mission.name())));
    }
    for contingency in it.contingencies.iter().flat_map(|it| &it.active) {
        let level = if contingency.alarm() == Alarm::Warning { Level::Error } else { Level::Warn };
        let text = format!("{}: {}", contingency.action, contingency.reason);
        all.push((format!("contingency {}", contingency.flag), level, text));
    }
    for process in &it.processes {
        let level = match process.health.as_str() {
            "alive" => Level::Ok,
            "dead" => Level::Error,
            _ => Level::Stale,
        };
        all.push((format!("process {}", process.service), level, process.health.clone()));
    }
    all
}

/// `diagnostic_msgs/msg/DiagnosticArray`.
pub(crate) fn diagnostics(stamp: Stamp, vehicle: &str, all: Vec<Diagnosis>) -> Vec<u8> {
    let status = |writer: Writer, (name, level, text): Diagnosis| {
        let writer = writer.u8(level as u8).string(&format!("{vehicle}: {name}")).string(&text).string(vehicle);
        writer.each([], |writer, (): ()| writer)
    };
    Writer::default().header(stamp, "").each(all, status).end()
}

/// `rcl_interfaces/msg/Log`.
pub(crate) fn log(stamp: Stamp, warns: bool, topic: &str, text: &str) -> Vec<u8> {
    // WARN or INFO; then file, function and line, which a decision does not have.
    let writer = Writer::default().stamp(stamp).u8(if warns { 30 } else { 20 });
    writer.string(topic).string(text).string("").string("").u32(0).end()
}

/// A name of an enumeration without its prefix.
pub(crate) fn lower(name: &str, prefix: &str) -> String {
    name.strip_prefix(prefix).unwrap_or(name).to_lowercase()
}

fn east_north_up(it: &v1::Ned) -> [f64; 3] {
    [it.east_m, it.north_m, -it.down_m]
}

/// From forward-left-up to east-north-up, as x, y, z, w: the vehicle's own quaternion between the two changes of axes.
fn orientation(it: &v1::VehicleAttitude) -> [f64; 4] {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let (w, x, y, z) = (it.q_w, it.q_x, it.q_y, it.q_z);
    [half * (x + y), half * (x - y), half * (w - z), half * (w + z)]
}

/// A velocity of the local frame as forward, left, up.
fn in_body([north, east, down]: [f64; 3], it: &v1::VehicleAttitude) -> [f64; 3] {
    let (w, x, y, z) = (it.q_w, it.q_x, it.q_y, it.q_z);
    let forward = (1.0 - 2.0 * (y * y + z * z)) * north + 2.0 * (x * y + w * z) * east + 2.0 * (x * z - w * y) * down;
    let right = 2.0 * (x * y - w * z) * north + (1.0 - 2.0 * (x * x + z * z)) * east + 2.0 * (y * z + w * x) * down;
    let below = 2.0 * (x * z + w * y) * north + 2.0 * (y * z - w * x) * east + (1.0 - 2.0 * (x * x + y * y)) * down;
    [forward, -right, -below]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_1_SQRT_2, PI};

    use super::*;

    /// Turned by `heading` clockwise from north, level.
    fn level(heading: f64) -> v1::VehicleAttitude {
        v1::VehicleAttitude { q_w: (heading / 2.0).cos(), q_z: (heading / 2.0).sin(), ..Default::default() }
    }

    #[track_caller]
    fn assert_near(found: &[f64], expected: &[f64]) {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}, expected {expected:?}");
    }

    #[test]
    fn headings_turn_from_north_and_clockwise_to_east_and_counterclockwise() {
        assert_near(&orientation(&level(PI / 2.0)), &[0.0, 0.0, 0.0, 1.0]);
        assert_near(&orientation(&level(0.0)), &[0.0, 0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2]);
        assert_near(&orientation(&level(PI)), &[0.0, 0.0, -FRAC_1_SQRT_2, FRAC_1_SQRT_2]);
        // Nose up by 30 degrees to the east: about the left axis by -30 degrees.
        let half = PI / 12.0;
        let (turn, pitch) = (level(PI / 2.0), half.sin());
        let up = v1::VehicleAttitude {
            q_w: turn.q_w * half.cos(),
            q_x: -turn.q_z * pitch,
            q_y: turn.q_w * pitch,
            q_z: turn.q_z * half.cos(),
            ..Default::default()
        };
        assert_near(&orientation(&up), &[0.0, -pitch, 0.0, half.cos()]);
        // Flying level to the east it moves forward and, seen from its body, down.
        assert_near(&in_body([0.0, 1.0, 0.0], &up), &[(PI / 6.0).cos(), 0.0, -(PI / 6.0).sin()]);
    }

    #[test]
    fn a_velocity_is_told_as_the_body_feels_it() {
        assert_near(&in_body([3.0, 0.0, -1.0], &level(0.0)), &[3.0, 0.0, 1.0]);
        assert_near(&in_body([3.0, 0.0, -1.0], &level(PI / 2.0)), &[0.0, 3.0, 1.0]);
    }

    #[test]
    fn what_is_not_known_is_not_published() {
        let (frames, nothing) = (Frames::of("uav1"), v1::vehicle::Aircraft::default());
        let stamp = Stamp::default();
        assert_eq!(frames.fix(stamp, &nothing), None);
        assert_eq!(frames.odometry(stamp, &nothing), None);
        assert_eq!(frames.battery(stamp, &nothing), None);
        let contact = v1::Contact { wall_age_s: None, lost: true };
        let silent = v1::Vehicle { contact: Some(contact), ..Default::default() };
        assert_eq!(diagnose(&silent), [("contact".to_owned(), Level::Stale, "never heard".to_owned())]);
    }
}
