//! Where a local frame has its origin.

use kittiwake_proto::v1;

use super::{InvalidMessage, finite, out_of_range};
use crate::geodesy::{LatLon, Origin};

impl From<Origin> for v1::Origin {
    fn from(origin: Origin) -> v1::Origin {
        v1::Origin {
            latitude_deg: origin.place.latitude_deg(),
            longitude_deg: origin.place.longitude_deg(),
            altitude_amsl_m: origin.altitude_m,
        }
    }
}

impl TryFrom<v1::Origin> for Origin {
    type Error = InvalidMessage;
    fn try_from(message: v1::Origin) -> Result<Origin, InvalidMessage> {
        let v1::Origin { latitude_deg, longitude_deg, altitude_amsl_m } = message;
        let expected = "a latitude from -90 to 90 and a longitude from -180 to 180 degrees";
        let place = LatLon::new(latitude_deg, longitude_deg)
            .map_err(|_| out_of_range("origin", (latitude_deg, longitude_deg), expected))?;
        Ok(Origin { place, altitude_m: altitude_amsl_m.map(|it| finite("altitude_amsl_m", it)).transpose()? })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::generators;
    use super::*;

    proptest! {
        #[test]
        fn an_origin_survives_the_wire(origin in generators::origin()) {
            prop_assert_eq!(Origin::try_from(v1::Origin::from(origin)), Ok(origin));
        }
    }

    #[test]
    fn an_origin_that_no_place_has_is_refused() {
        #[track_caller]
        fn check(latitude_deg: f64, longitude_deg: f64, altitude_amsl_m: Option<f64>, expected: &str) {
            let found = Origin::try_from(v1::Origin { latitude_deg, longitude_deg, altitude_amsl_m });
            assert!(found.as_ref().is_err_and(|it| it.to_string().starts_with(expected)), "{found:?}");
        }
        check(90.5, 6.6, None, "`origin` is (90.5, 6.6), expected a latitude from -90 to 90");
        check(54.0, -180.5, None, "`origin` is (54.0, -180.5), expected");
        check(f64::NAN, 6.6, None, "`origin` is (NaN, 6.6), expected");
        check(54.0, 6.6, Some(f64::INFINITY), "`altitude_amsl_m` is inf, expected a finite number");
    }

    #[test]
    fn a_status_with_such_an_origin_counts_as_one_without() {
        let origin = Some(v1::Origin { latitude_deg: 91.0, ..Default::default() });
        let status = crate::fmu::Status::from(v1::VehicleStatus { armed: true, origin, ..Default::default() });
        assert_eq!((status.armed, status.origin), (true, None));
    }
}
