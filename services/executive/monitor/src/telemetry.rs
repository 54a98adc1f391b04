//! What makes a sample of each source one that counts, and one that says nothing new.
//!
//! A sample that makes no sense counts as none: its source ages as if it had been silent, and
//! whatever rule watches the source's age sees it.

use domain::geometry::{Ned, NedVelocity};
use kittiwake_proto::v1;

/// A sample of one source.
pub trait Telemetry {
    /// Whether every number in it is one, and within any sensible range.
    fn is_sound(&self) -> bool;

    /// Whether it measures the very same as `earlier`, which a real sensor, never without noise,
    /// does not do for long.
    fn repeats(&self, earlier: &Self) -> bool;
}

impl Telemetry for v1::VehicleStatus {
    /// A mode that is not known here is still a status.
    fn is_sound(&self) -> bool {
        true
    }

    /// A state that lasts is no sign of anything.
    fn repeats(&self, _earlier: &Self) -> bool {
        false
    }
}

impl Telemetry for v1::VehicleLandDetected {
    fn is_sound(&self) -> bool {
        true
    }

    /// A state that lasts is no sign of anything.
    fn repeats(&self, _earlier: &Self) -> bool {
        false
    }
}

impl Telemetry for v1::VehicleAttitude {
    fn is_sound(&self) -> bool {
        let norm = [self.q_w, self.q_x, self.q_y, self.q_z].iter().map(|it| it * it).sum::<f64>();
        // Rounded to single precision on its way it is still much closer to one than this.
        (0.98..=1.02).contains(&norm) && finite(&[self.roll_rate_rad_s, self.pitch_rate_rad_s, self.yaw_rate_rad_s])
    }

    fn repeats(&self, earlier: &Self) -> bool {
        self == earlier
    }
}

impl Telemetry for v1::VehicleLocalPosition {
    fn is_sound(&self) -> bool {
        self.position.is_some_and(|it| Ned::try_from(it).is_ok())
            && self.velocity.is_some_and(|it| NedVelocity::try_from(it).is_ok())
            && finite(&[self.heading_rad])
            && [self.eph_m, self.epv_m].iter().all(|it| (0.0..=1e6).contains(it))
    }

    /// How far the estimator trusts itself may change while what it is fed stands still.
    fn repeats(&self, earlier: &Self) -> bool {
        self.position == earlier.position && self.velocity == earlier.velocity
    }
}

impl Telemetry for v1::VehicleGlobalPosition {
    fn is_sound(&self) -> bool {
        (-90.0..=90.0).contains(&self.latitude_deg)
            && (-180.0..=180.0).contains(&self.longitude_deg)
            && (-1e6..=1e6).contains(&self.altitude_amsl_m)
            && [self.eph_m, self.epv_m].iter().all(|it| (0.0..=1e6).contains(it))
    }

    fn repeats(&self, earlier: &Self) -> bool {
        let place = |it: &Self| (it.latitude_deg, it.longitude_deg, it.altitude_amsl_m);
        place(self) == place(earlier)
    }
}

impl Telemetry for v1::BatteryStatus {
    fn is_sound(&self) -> bool {
        (0.0..=1.0).contains(&self.remaining)
            && (0.0..=1e4).contains(&self.voltage_v)
            && finite(&[self.current_a])
            && (-273.15..=1e3).contains(&self.temperature_c)
    }

    fn repeats(&self, earlier: &Self) -> bool {
        self == earlier
    }
}

fn finite(numbers: &[f64]) -> bool {
    numbers.iter().all(|it| it.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_battery_sample_counts_only_if_it_makes_sense() {
        #[track_caller]
        fn check(remaining: f64, voltage_v: f64, temperature_c: f64, expected: bool) {
            let sample = v1::BatteryStatus { voltage_v, current_a: 1.0, remaining, temperature_c };
            assert_eq!(sample.is_sound(), expected, "{sample:?}");
        }
        check(0.5, 22.0, 20.0, true);
        check(0.0, 0.0, -20.0, true);
        check(f64::NAN, 22.0, 20.0, false);
        check(-1.0, 22.0, 20.0, false);
        check(1.5, 22.0, 20.0, false);
        check(0.5, f64::INFINITY, 20.0, false);
        check(0.5, 22.0, f64::NAN, false);
    }

    #[test]
    fn a_position_sample_counts_only_if_it_makes_sense() {
        #[track_caller]
        fn check(break_it: fn(&mut v1::VehicleLocalPosition), expected: bool) {
            let (position, velocity) = (Some(v1::Ned::default()), Some(v1::NedVelocity::default()));
            let mut sample =
                v1::VehicleLocalPosition { position, velocity, eph_m: 0.4, epv_m: 0.6, ..Default::default() };
            break_it(&mut sample);
            assert_eq!(sample.is_sound(), expected, "{sample:?}");
        }
        check(|_| {}, true);
        check(|it| it.position = None, false);
        check(|it| it.velocity = None, false);
        check(|it| it.position = Some(v1::Ned { north_m: f64::NAN, ..Default::default() }), false);
        check(|it| it.velocity = Some(v1::NedVelocity { down_m_s: 1e9, ..Default::default() }), false);
        check(|it| it.heading_rad = f64::NAN, false);
        check(|it| it.eph_m = -1.0, false);
        check(|it| it.epv_m = f64::INFINITY, false);
    }

    #[test]
    fn an_attitude_is_a_rotation() {
        #[track_caller]
        fn check(q_w: f64, yaw_rate_rad_s: f64, expected: bool) {
            let sample = v1::VehicleAttitude { q_w, yaw_rate_rad_s, ..Default::default() };
            assert_eq!(sample.is_sound(), expected, "{sample:?}");
        }
        check(1.0, 0.1, true);
        check(0.0, 0.1, false);
        check(f64::NAN, 0.1, false);
        check(1.0, f64::NAN, false);
    }

    #[test]
    fn a_global_position_lies_on_the_globe() {
        #[track_caller]
        fn check(latitude_deg: f64, longitude_deg: f64, altitude_amsl_m: f64, expected: bool) {
            let sample =
                v1::VehicleGlobalPosition { latitude_deg, longitude_deg, altitude_amsl_m, eph_m: 0.4, epv_m: 0.6 };
            assert_eq!(sample.is_sound(), expected, "{sample:?}");
        }
        check(54.0, 6.6, 20.0, true);
        check(91.0, 6.6, 20.0, false);
        check(54.0, f64::NAN, 20.0, false);
        check(54.0, 6.6, f64::INFINITY, false);
    }
}
