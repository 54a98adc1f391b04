//! PX4's samples as messages of the `fmu/` topics. A sample with a value that is not a number is not passed on.

use autopilot::picture::{roll_pitch_yaw, utc_ms};
use domain::fmu::{Attitude, Battery, GlobalPosition, LandDetected, LocalPosition};
use domain::geodesy::LatLon;
use domain::geometry::{Ned, NedVelocity};
use kittiwake_proto::v1;

use crate::cdr::{CdrError, Record};

/// Turn rates from attitudes: PX4 does not send them on this path.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rates {
    last: Option<(u64, u64, [f64; 4])>,
}

/// Attitudes farther apart say little of the turn rate in between.
const LONGEST_GAP_US: u64 = 200_000;

impl Rates {
    /// The attitude with its turn rates; `None` for the first one, after a gap or a reset, and where a value is not a
    /// number.
    ///
    /// # Errors
    /// If this version lacks a field.
    pub(crate) fn attitude(&mut self, sample: &Record<'_>) -> Result<Option<Attitude>, CdrError> {
        let (at, resets) = (sample.unsigned("timestamp_sample")?, sample.unsigned("quat_reset_counter")?);
        let mut q = [0.0; 4];
        for (index, it) in q.iter_mut().enumerate() {
            *it = sample.number_at("q", index)?;
        }
        if !all_finite(&q) {
            self.last = None;
            return Ok(None);
        }
        let before = self.last.replace((at, resets, q));
        let Some((before_at, _, before)) = before.filter(|(_, it, _)| *it == resets) else { return Ok(None) };
        let gap_us = at.saturating_sub(before_at);
        if gap_us == 0 || LONGEST_GAP_US < gap_us {
            return Ok(None);
        }
        let [roll_rate_rad_s, pitch_rate_rad_s, yaw_rate_rad_s] = turned(before, q).map(|it| it * 1e6 / gap_us as f64);
        let [q_w, q_x, q_y, q_z] = q;
        Ok(Some(Attitude { q_w, q_x, q_y, q_z, roll_rate_rad_s, pitch_rate_rad_s, yaw_rate_rad_s }))
    }
}

/// The rotation from one attitude to the next about the body's axes, in radians; for small angles.
fn turned([w, x, y, z]: [f64; 4], [w2, x2, y2, z2]: [f64; 4]) -> [f64; 3] {
    let dw = w * w2 + x * x2 + y * y2 + z * z2;
    let d = [w * x2 - x * w2 - y * z2 + z * y2, w * y2 - y * w2 - z * x2 + x * z2, w * z2 - z * w2 - x * y2 + y * x2];
    // A quaternion and its negative are the same attitude.
    let sign = if dw < 0.0 { -2.0 } else { 2.0 };
    d.map(|it| it * sign)
}

/// The local position; `None` where a value is not a number.
///
/// # Errors
/// If this version lacks a field.
pub(crate) fn local_position(sample: &Record<'_>) -> Result<Option<LocalPosition>, CdrError> {
    let n = |field| sample.number(field);
    let position = LocalPosition {
        position: Ned::new(n("x")?, n("y")?, n("z")?),
        velocity: NedVelocity { north_m_s: n("vx")?, east_m_s: n("vy")?, down_m_s: n("vz")? },
        heading_rad: n("heading")?,
        horizontal_valid: sample.flag("xy_valid")? && sample.flag("v_xy_valid")?,
        vertical_valid: sample.flag("z_valid")? && sample.flag("v_z_valid")?,
        eph_m: n("eph")?,
        epv_m: n("epv")?,
        timestamp_us: sample.unsigned("timestamp_sample")?,
    };
    let LocalPosition { position: at, velocity: v, heading_rad, eph_m, epv_m, .. } = position;
    let numbers = [at.north_m, at.east_m, at.down_m, v.north_m_s, v.east_m_s, v.down_m_s, heading_rad, eph_m, epv_m];
    Ok(all_finite(&numbers).then_some(position))
}

/// The global position, if PX4 vouches for it.
///
/// # Errors
/// If this version lacks a field.
pub(crate) fn global_position(sample: &Record<'_>) -> Result<Option<GlobalPosition>, CdrError> {
    let n = |field| sample.number(field);
    let position = GlobalPosition {
        latitude_deg: n("lat")?,
        longitude_deg: n("lon")?,
        altitude_amsl_m: n("alt")?,
        eph_m: n("eph")?,
        epv_m: n("epv")?,
    };
    let GlobalPosition { latitude_deg, longitude_deg, altitude_amsl_m, eph_m, epv_m } = position;
    let is_valid = sample.flag("lat_lon_valid")? && sample.flag("alt_valid")?;
    Ok((is_valid && all_finite(&[latitude_deg, longitude_deg, altitude_amsl_m, eph_m, epv_m])).then_some(position))
}

/// The land detector's statement.
///
/// # Errors
/// If this version lacks a field.
pub(crate) fn land_detected(sample: &Record<'_>) -> Result<LandDetected, CdrError> {
    let (landed, ground_contact) = (sample.flag("landed")?, sample.flag("ground_contact")?);
    Ok(LandDetected { landed, ground_contact, timestamp_us: sample.unsigned("timestamp")? })
}

/// The battery; `None` where PX4 measures no charge or voltage.
///
/// # Errors
/// If this version lacks a field.
pub(crate) fn battery(sample: &Record<'_>) -> Result<Option<Battery>, CdrError> {
    let (voltage_v, remaining) = (sample.number("voltage_v")?, sample.number("remaining")?);
    // -1 stands for a current that is not measured.
    let current_a = Some(sample.number("current_a")?).filter(|it| it.is_finite() && *it != -1.0);
    let temperature_c = Some(sample.number("temperature")?).filter(|it| it.is_finite());
    let is_measured = sample.flag("connected")? && voltage_v.is_finite() && (0.0..=1.0).contains(&remaining);
    Ok(is_measured.then_some(Battery { voltage_v, current_a, remaining, temperature_c }))
}

/// A picture that was taken; `None` for a capture that has failed. -1 stands for a camera that gives no answer.
///
/// # Errors
/// If this version lacks a field.
pub(crate) fn picture(sample: &Record<'_>, heard_ms: i64) -> Result<Option<v1::Picture>, CdrError> {
    const FAILED: f64 = 0.0;
    if sample.number("result")? == FAILED {
        return Ok(None);
    }
    let (latitude_deg, longitude_deg, altitude_amsl_m) =
        (sample.number("lat")?, sample.number("lon")?, sample.number("alt")?);
    let is_known = (latitude_deg, longitude_deg) != (0.0, 0.0)
        && LatLon::new(latitude_deg, longitude_deg).is_ok()
        && altitude_amsl_m.is_finite();
    let mut q = [0.0; 4];
    for (index, it) in q.iter_mut().enumerate() {
        *it = sample.number_at("q", index)?;
    }
    Ok(Some(v1::Picture {
        number: sample.unsigned("seq")? as u32,
        utc_ms: utc_ms(sample.unsigned("timestamp_utc")?, heard_ms),
        place: is_known.then_some(v1::PicturePlace { latitude_deg, longitude_deg, altitude_amsl_m }),
        attitude: roll_pitch_yaw(q).map(|[roll_rad, pitch_rad, yaw_rad]| v1::PictureAttitude {
            roll_rad,
            pitch_rad,
            yaw_rad,
        }),
    }))
}

fn all_finite(numbers: &[f64]) -> bool {
    numbers.iter().all(|it| it.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turn_rates_are_about_the_bodys_axes() {
        let level = [1.0, 0.0, 0.0, 0.0];
        let half: f64 = 0.001;
        for (axis, expected) in [(1, [0.002, 0.0, 0.0]), (2, [0.0, 0.002, 0.0]), (3, [0.0, 0.0, 0.002])] {
            let mut next = [half.cos(), 0.0, 0.0, 0.0];
            next[axis] = half.sin();
            for sign in [1.0, -1.0] {
                let found = turned(level, next.map(|it| it * sign));
                assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-8), "{found:?}");
            }
        }
        // Heading east, and rolling: it is the body's axis that counts.
        let east = [std::f64::consts::FRAC_1_SQRT_2, 0.0, 0.0, std::f64::consts::FRAC_1_SQRT_2];
        let rolled = [east[0] * half.cos(), east[0] * half.sin(), east[3] * half.sin(), east[3] * half.cos()];
        let found = turned(east, rolled);
        assert!((found[0] - 0.002).abs() < 1e-8 && found[1].abs() < 1e-8 && found[2].abs() < 1e-8, "{found:?}");
    }
}
