//! From the local frame to WGS 84.

use domain::geodesy::{self, LocalFrame};
use domain::geometry::Ned;

use crate::config::Origin;

/// The globe around the origin of the local frame.
#[derive(Debug, Clone)]
pub(crate) struct Globe {
    frame: LocalFrame,
    origin: geodesy::Origin,
    altitude_amsl_m: f64,
}

impl Globe {
    /// The globe around `origin`.
    pub(crate) fn new(origin: &Origin) -> Globe {
        let altitude_amsl_m = origin.altitude_amsl_m.get();
        let origin = origin.in_wgs84();
        Globe { frame: LocalFrame::at(origin.place), origin, altitude_amsl_m }
    }

    /// An origin of the local frame that lies here in that of the simulation.
    pub(crate) fn origin_at(&self, here: Ned) -> geodesy::Origin {
        if here == Ned::default() {
            return self.origin;
        }
        let altitude_m = Some(self.altitude_amsl_m + here.height_m());
        geodesy::Origin { place: self.frame.lat_lon(here), altitude_m }
    }

    /// Latitude and longitude in degrees, and the height above mean sea level in metres.
    pub(crate) fn global(&self, local: Ned) -> (f64, f64, f64) {
        let place = self.frame.lat_lon(local);
        (place.latitude_deg(), place.longitude_deg(), self.altitude_amsl_m + local.height_m())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::shipped;

    #[test]
    fn a_minute_of_latitude_is_a_nautical_mile() {
        let globe = Globe::new(&shipped::config().origin);
        let (latitude, longitude, altitude) = globe.global(Ned::new(1855.08, 0.0, -10.0));
        // A degree of the meridian at 54 degrees north is 111,305 m, one of the parallel 65,576 m: the
        // usual series, 111132.954 - 559.822 cos 2x + 1.175 cos 4x and 111412.84 cos x - 93.5 cos 3x.
        assert!(((latitude - 54.0) * 60.0 - 1.0).abs() < 2e-4, "{latitude}");
        assert!((longitude - 6.6).abs() < 1e-12 && (altitude - 30.0).abs() < 1e-9);
        let (_, east, _) = globe.global(Ned::new(0.0, 1000.0, 0.0));
        assert!(((east - 6.6) * 65_576.0 - 1000.0).abs() < 0.1, "{east}");
    }
}
