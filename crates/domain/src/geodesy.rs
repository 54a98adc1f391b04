//! The local frame on the Earth: WGS 84 to metres north and east of an origin, and back. No other place converts.
//!
//! Our projection is azimuthal equidistant about the origin (Snyder, Map Projections: A Working Manual, USGS Professional
//! Paper 1395, 1987, chapter 25), on the ellipsoid: distance and direction of a place from the origin are those of the
//! geodesic (Karney, Algorithms for geodesics, Journal of Geodesy 87, 2013), at any distance and across the antimeridian.
//! Distances across that direction come out too long, by the square of the distance from the origin over six squared
//! radii of the Earth: see the test for figures.
//!
//! Each autopilot has a projection of its own, by which its metres differ from ours: at 54 degrees north and 2 km from the origin by 2 to 5 m.
//! A backend converts at its border.

use std::fmt;

use geographiclib_rs::{DirectGeodesic as _, Geodesic, InverseGeodesic as _};

use crate::geometry::Ned;

/// A place in WGS 84, without height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LatLon {
    latitude_deg: f64,
    longitude_deg: f64,
}

/// A latitude or longitude that no place has.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("latitude {latitude_deg}, longitude {longitude_deg}: expected degrees from -90 to 90, and from -180 to 180")]
pub struct OutOfRange {
    latitude_deg: f64,
    longitude_deg: f64,
}

impl LatLon {
    /// The place at these degrees, north and east positive.
    ///
    /// # Errors
    /// If a latitude is beyond 90 degrees, or a longitude beyond 180.
    pub fn new(latitude_deg: f64, longitude_deg: f64) -> Result<LatLon, OutOfRange> {
        if latitude_deg.abs() <= 90.0 && longitude_deg.abs() <= 180.0 {
            Ok(LatLon { latitude_deg, longitude_deg })
        } else {
            Err(OutOfRange { latitude_deg, longitude_deg })
        }
    }

    /// Degrees north of the equator.
    pub fn latitude_deg(self) -> f64 {
        self.latitude_deg
    }

    /// Degrees east of Greenwich.
    pub fn longitude_deg(self) -> f64 {
        self.longitude_deg
    }

    /// How far it is to `other` along the ellipsoid, in metres.
    pub fn distance_m(self, other: LatLon) -> f64 {
        Geodesic::wgs84().inverse(self.latitude_deg, self.longitude_deg, other.latitude_deg, other.longitude_deg)
    }
}

/// Latitude and longitude to a tenth of a metre, as a map takes them.
impl fmt::Display for LatLon {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.6}, {:.6}", self.latitude_deg, self.longitude_deg)
    }
}

/// Where a local frame begins: of a mission and of a vehicle the take-off point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Origin {
    /// The take-off point.
    pub place: LatLon,
    /// Its altitude above mean sea level, in metres, if it is known.
    pub altitude_m: Option<f64>,
}

/// Nearer to a pole an origin has no usable east, in degrees of latitude.
pub const NORTHERNMOST_ORIGIN_DEG: f64 = 89.0;

/// The local frame at an origin.
#[derive(Debug, Clone, Copy)]
pub struct LocalFrame {
    origin: LatLon,
    projection: Projection,
}

#[derive(Debug, Clone, Copy)]
enum Projection {
    /// Azimuthal equidistant about the origin, on this ellipsoid.
    Equidistant(Geodesic),
    /// A degree of latitude is as long everywhere, and one of longitude that times the cosine of the mean latitude.
    Equirectangular,
}

/// Of PX4's sphere, in metres. (PX4 lib/geo: CONSTANTS_RADIUS_OF_EARTH.)
const PX4_RADIUS_M: f64 = 6_371_000.0;
/// ArduPilot's metres in a degree of latitude. (AP_Math: LATLON_TO_M, for 1e-7 degrees.)
const ARDUPILOT_DEGREE_M: f64 = 111_318.845_021_450_34;

impl LocalFrame {
    /// Our frame with this origin.
    pub fn at(origin: LatLon) -> LocalFrame {
        LocalFrame { origin, projection: Projection::Equidistant(Geodesic::wgs84()) }
    }

    /// Where a place is in the frame, at height 0.
    pub fn local(&self, place: LatLon) -> Ned {
        let LatLon { latitude_deg, longitude_deg } = self.origin;
        let Projection::Equidistant(ellipsoid) = self.projection else {
            let mean_deg = f64::midpoint(latitude_deg, place.latitude_deg);
            let east_deg = (place.longitude_deg - longitude_deg + 180.0).rem_euclid(360.0) - 180.0;
            let north_m = (place.latitude_deg - latitude_deg) * ARDUPILOT_DEGREE_M;
            return Ned::new(north_m, east_deg * ARDUPILOT_DEGREE_M * mean_deg.to_radians().cos(), 0.0);
        };
        let (distance_m, azimuth_deg, _, _): (f64, f64, f64, f64) =
            ellipsoid.inverse(latitude_deg, longitude_deg, place.latitude_deg, place.longitude_deg);
        let (sin, cos) = azimuth_deg.to_radians().sin_cos();
        Ned::new(distance_m * cos, distance_m * sin, 0.0)
    }

    /// The place over which `position` is.
    pub fn lat_lon(&self, position: Ned) -> LatLon {
        let LatLon { latitude_deg, longitude_deg } = self.origin;
        let Projection::Equidistant(ellipsoid) = self.projection else {
            let latitude = latitude_deg + position.north_m / ARDUPILOT_DEGREE_M;
            let mean_deg = f64::midpoint(latitude_deg, latitude);
            let longitude = longitude_deg + position.east_m / (ARDUPILOT_DEGREE_M * mean_deg.to_radians().cos());
            let longitude_deg = (longitude + 180.0).rem_euclid(360.0) - 180.0;
            return LatLon { latitude_deg: latitude, longitude_deg };
        };
        let azimuth_deg = position.east_m.atan2(position.north_m).to_degrees();
        let distance_m = position.horizontal_distance_m(Ned::default());
        let (latitude_deg, longitude_deg): (f64, f64) =
            ellipsoid.direct(latitude_deg, longitude_deg, azimuth_deg, distance_m);
        LatLon { latitude_deg, longitude_deg }
    }
}

/// The local frame of an autopilot, beside ours with the same origin: each is another map of the Earth. Heights are the same in both.
#[derive(Debug, Clone, Copy)]
pub struct AutopilotFrame {
    its: LocalFrame,
    ours: LocalFrame,
}

impl AutopilotFrame {
    /// PX4's with this origin. (PX4 lib/geo: MapProjection.)
    pub fn of_px4(origin: LatLon) -> AutopilotFrame {
        AutopilotFrame::new(origin, Projection::Equidistant(Geodesic::new(PX4_RADIUS_M, 0.0)))
    }

    /// ArduPilot's with this origin. (AP_Common: Location::get_distance_NE.)
    pub fn of_ardupilot(origin: LatLon) -> AutopilotFrame {
        AutopilotFrame::new(origin, Projection::Equirectangular)
    }

    fn new(origin: LatLon, projection: Projection) -> AutopilotFrame {
        AutopilotFrame { its: LocalFrame { origin, projection }, ours: LocalFrame::at(origin) }
    }

    /// Where a position of its frame is in ours.
    pub fn to_ours(&self, position: Ned) -> Ned {
        self.ours.local(self.its.lat_lon(position)).at_height(position.height_m())
    }

    /// Where a position of our frame is in its.
    pub fn to_its(&self, position: Ned) -> Ned {
        self.its.local(self.ours.lat_lon(position)).at_height(position.height_m())
    }

    /// The place over which a position of its frame is.
    pub fn lat_lon(&self, position: Ned) -> LatLon {
        self.its.lat_lon(position)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn place(latitude_deg: f64, longitude_deg: f64) -> LatLon {
        LatLon::new(latitude_deg, longitude_deg).unwrap()
    }

    #[test]
    fn a_place_that_does_not_exist_is_refused() {
        assert!(LatLon::new(90.1, 0.0).is_err() && LatLon::new(0.0, -180.1).is_err());
        assert!(LatLon::new(f64::NAN, 0.0).is_err() && LatLon::new(0.0, f64::INFINITY).is_err());
    }

    #[test]
    fn north_and_east_are_where_they_belong() {
        #[track_caller]
        fn check(origin: LatLon, there: LatLon, north_m: f64, east_m: f64) {
            let found = LocalFrame::at(origin).local(there);
            assert!((found.north_m - north_m).abs() < 0.01 && (found.east_m - east_m).abs() < 0.01, "{found:?}");
        }
        // A degree along the equator of WGS 84: 6,378,137 m times a degree.
        check(place(0.0, 0.0), place(0.0, 1.0), 0.0, 111_319.491);
        check(place(0.0, 179.5), place(0.0, -179.5), 0.0, 111_319.491);
        check(place(0.0, -179.5), place(0.0, 179.5), 0.0, -111_319.491);
        check(place(54.0, 6.6), place(54.0, 6.6), 0.0, 0.0);
    }

    #[test]
    fn the_frames_of_both_autopilots_differ_from_ours_as_far_as_is_known() {
        /// A place 2.1 km away, where it is in the frame of an autopilot at 47.4 degrees north.
        #[track_caller]
        fn check(of: fn(LatLon) -> AutopilotFrame, ours: (f64, f64), expected: (f64, f64)) {
            let frame = of(place(47.3977, 8.5456));
            let (ours, theirs) = (Ned::new(ours.0, ours.1, -40.0), Ned::new(expected.0, expected.1, -40.0));
            let (found, back) = (frame.to_its(ours), frame.to_ours(frame.to_its(ours)));
            assert!(found.distance_m(theirs) < 0.1, "{found:?}");
            assert!(back.distance_m(ours) < 1e-3, "{back:?}");
        }
        // The ellipsoid's radius of curvature there is 6,370.0 km along the meridian and 6,389.7 km across; theirs are 6,371.0 and 6,378.1 km.
        check(AutopilotFrame::of_px4, (2_100.0, 0.0), (2_100.3, 0.0));
        check(AutopilotFrame::of_px4, (0.0, 2_100.0), (0.0, 2_093.8));
        check(AutopilotFrame::of_ardupilot, (2_100.0, 0.0), (2_102.7, 0.0));
        // A straight way to the east leaves the parallel, by 0.4 m here.
        check(AutopilotFrame::of_ardupilot, (0.0, 2_100.0), (-0.4, 2_096.2));
    }

    proptest! {
        #[test]
        fn what_is_converted_and_back_is_where_it_was(
            latitude_deg in -80.0..80.0,
            longitude_deg in -180.0..180.0,
            north_m in -2e4..2e4,
            east_m in -2e4..2e4,
        ) {
            let origin = place(latitude_deg, longitude_deg);
            let position = Ned::new(north_m, east_m, -12.5);
            for frame in [AutopilotFrame::of_px4(origin), AutopilotFrame::of_ardupilot(origin)] {
                let there = frame.to_its(position);
                prop_assert!(there.distance_m(position) < 0.01 * north_m.hypot(east_m) + 1e-3, "{there:?}");
                prop_assert!(frame.to_ours(there).distance_m(position) < 1e-3);
            }
        }
    }

    #[test]
    fn distances_are_those_on_the_ellipsoid() {
        #[track_caller]
        fn check(a: LatLon, b: LatLon, expected_m: f64, within_m: f64) {
            for found_m in [a.distance_m(b), b.distance_m(a)] {
                assert!((found_m - expected_m).abs() < within_m, "{found_m}");
            }
        }
        check(place(54.0, 6.6), place(54.0, 6.6), 0.0, 1e-6);
        // As above; the shorter way leads across the antimeridian.
        check(place(0.0, 179.5), place(0.0, -179.5), 111_319.491, 0.01);
        check(place(0.0, 180.0), place(0.0, -180.0), 0.0, 1e-6);
        // A degree of the meridian at 54 degrees north: 111132.954 - 559.822 cos 2x + 1.175 cos 4x = 111,305.0 m.
        check(place(53.995, 6.6), place(54.005, 6.6), 1113.05, 0.05);
        // At a pole all longitudes are one place; half a degree from it to either side: 111,694 m a degree.
        check(place(90.0, 0.0), place(90.0, 120.0), 0.0, 1e-6);
        check(place(89.5, 0.0), place(89.5, 180.0), 111_694.0, 5.0);
    }

    #[test]
    fn a_place_is_shown_as_a_map_takes_it() {
        assert_eq!(place(54.0, -6.6).to_string(), "54.000000, -6.600000");
    }

    /// How much longer a short line across the direction to the origin is in the frame than on the Earth, as a fraction.
    fn stretch(distance_m: f64, azimuth_deg: f64) -> f64 {
        let frame = LocalFrame::at(place(54.0, 6.6));
        let at = |azimuth_deg: f64| {
            let (sin, cos) = azimuth_deg.to_radians().sin_cos();
            Ned::new(distance_m * cos, distance_m * sin, 0.0)
        };
        let (a, b) = (at(azimuth_deg - 0.5), at(azimuth_deg + 0.5));
        let (on_earth_a, on_earth_b) = (frame.lat_lon(a), frame.lat_lon(b));
        let true_m: f64 = Geodesic::wgs84().inverse(
            on_earth_a.latitude_deg,
            on_earth_a.longitude_deg,
            on_earth_b.latitude_deg,
            on_earth_b.longitude_deg,
        );
        a.distance_m(b) / true_m - 1.0
    }

    #[test]
    fn distances_across_the_direction_from_the_origin_are_a_little_too_long() {
        #[track_caller]
        fn check(distance_m: f64, at_most: f64) {
            let worst = (0..36).map(|tenth| stretch(distance_m, f64::from(tenth) * 10.0).abs()).fold(0.0, f64::max);
            assert!(worst < at_most, "{worst:e}");
            // The figure is the stated one, not just below some bound.
            assert!(at_most * 0.8 < worst, "{worst:e}");
        }
        check(5_000.0, 1.1e-7);
        check(50_000.0, 1.04e-5);
        check(100_000.0, 4.2e-5);
    }

    proptest! {
        #[test]
        fn there_and_back_is_the_same_place(
            latitude_deg in -89.0..89.0_f64, longitude_deg in -180.0..180.0_f64,
            north_m in -1e5..1e5_f64, east_m in -1e5..1e5_f64,
        ) {
            let frame = LocalFrame::at(place(latitude_deg, longitude_deg));
            let there = Ned::new(north_m, east_m, 0.0);
            let back = frame.local(frame.lat_lon(there));
            prop_assert!(there.distance_m(back) < 1e-6, "{there:?} {back:?}");
            let LatLon { latitude_deg, longitude_deg } = frame.lat_lon(there);
            prop_assert!(LatLon::new(latitude_deg, longitude_deg).is_ok());
        }
    }
}
