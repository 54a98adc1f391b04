//! From the local frame to WGS 84.

use domain::geometry::Ned;

use crate::config::Origin;

/// Semi-major axis, m, and first eccentricity squared (NIMA TR8350.2, tables 3.1 and 3.3).
const SEMI_MAJOR_AXIS_M: f64 = 6_378_137.0;
const ECCENTRICITY_SQUARED: f64 = 6.694_379_990_14e-3;

/// The plane that touches the globe at the origin of the local frame.
#[derive(Debug, Clone)]
pub(crate) struct TangentPlane {
    origin: Origin,
    north_deg_m: f64,
    east_deg_m: f64,
}

impl TangentPlane {
    /// The plane at `origin`, with the radii of curvature of the meridian and of the prime
    /// vertical there (Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation
    /// Systems, 2nd edition, equations 2.105 and 2.106). Within 10 km the plane is off by less
    /// than two metres over ground and 8 m in height. A simulation can ignore that: height is
    /// counted from the plane.
    pub(crate) fn new(origin: Origin) -> TangentPlane {
        let (sin, cos) = origin.latitude_deg.get().to_radians().sin_cos();
        let height_m = origin.altitude_amsl_m.get();
        let flatness = 1.0 - ECCENTRICITY_SQUARED * sin * sin;
        let meridian_m = SEMI_MAJOR_AXIS_M * (1.0 - ECCENTRICITY_SQUARED) / flatness.powf(1.5);
        let prime_vertical_m = SEMI_MAJOR_AXIS_M / flatness.sqrt();
        TangentPlane {
            north_deg_m: (1.0 / (meridian_m + height_m)).to_degrees(),
            east_deg_m: (1.0 / ((prime_vertical_m + height_m) * cos)).to_degrees(),
            origin,
        }
    }

    /// Latitude and longitude in degrees, and the height above mean sea level in metres.
    pub(crate) fn global(&self, local: Ned) -> (f64, f64, f64) {
        let longitude_deg = self.origin.longitude_deg.get() + local.east_m * self.east_deg_m;
        (
            self.origin.latitude_deg.get() + local.north_m * self.north_deg_m,
            (longitude_deg + 180.0).rem_euclid(360.0) - 180.0,
            self.origin.altitude_amsl_m.get() + local.height_m(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::shipped;

    #[test]
    fn a_minute_of_latitude_is_a_nautical_mile() {
        let plane = TangentPlane::new(shipped::config().origin);
        let (latitude, longitude, altitude) = plane.global(Ned::new(1855.08, 0.0, -10.0));
        // A degree of the meridian at 54 degrees north is 111,305 m, one of the parallel 65,576 m: the
        // usual series, 111132.954 - 559.822 cos 2x + 1.175 cos 4x and 111412.84 cos x - 93.5 cos 3x.
        assert!(((latitude - 54.0) * 60.0 - 1.0).abs() < 2e-4, "{latitude}");
        assert!((longitude - 6.6).abs() < 1e-12 && (altitude - 30.0).abs() < 1e-9);
        let (_, east, _) = plane.global(Ned::new(0.0, 1000.0, 0.0));
        assert!(((east - 6.6) * 65_576.0 - 1000.0).abs() < 0.1, "{east}");
    }
}
