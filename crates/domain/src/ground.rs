//! How high the ground is. The crate `ground` answers from files.

use crate::geodesy::LatLon;

/// A model of the ground: altitudes above mean sea level, of land and of water. A place that it does not know has no altitude, never 0.
pub trait GroundModel: std::fmt::Debug {
    /// The altitude of the ground at a place, in metres.
    fn altitude_m(&self, at: LatLon) -> Option<f64>;

    /// The lowest and the highest ground within the latitudes and longitudes of `corners`, in metres; `None` if a part of that is not known.
    fn bounds_m(&self, corners: &[LatLon]) -> Option<[f64; 2]>;
}
