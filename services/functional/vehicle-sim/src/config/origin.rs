//! Where the simulated vehicle stands.

use domain::geodesy::{self, LatLon};

use super::{Origin, Within};

impl Origin {
    /// The origin of a vehicle that flies a mission with the origin `mission`: that one, if the vehicle is to stand there, else the
    /// configured one. A mission that does not know its altitude has the configured one.
    ///
    /// # Errors
    /// If no vehicle can be simulated there, and why.
    pub fn of_mission(&self, mission: Option<geodesy::Origin>) -> Result<Origin, String> {
        let Some(mission) = mission.filter(|_| self.at_mission_origin) else { return Ok(self.clone()) };
        Ok(Origin {
            latitude_deg: within("latitude", mission.place.latitude_deg())?,
            longitude_deg: within("longitude", mission.place.longitude_deg())?,
            altitude_amsl_m: match mission.altitude_m {
                Some(altitude_m) => within("altitude", altitude_m)?,
                None => self.altitude_amsl_m,
            },
            at_mission_origin: self.at_mission_origin,
        })
    }

    /// As everybody else knows it.
    pub fn in_wgs84(&self) -> geodesy::Origin {
        let place = LatLon::new(self.latitude_deg.get(), self.longitude_deg.get());
        let place = place.expect("a configured origin is within narrower ranges");
        geodesy::Origin { place, altitude_m: Some(self.altitude_amsl_m.get()) }
    }
}

fn within<const LO: i32, const HI: i32>(what: &str, value: f64) -> Result<Within<LO, HI>, String> {
    Within::<LO, HI>::try_from(value).map_err(|why| format!("the {what} of its origin: {why}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::shipped;

    fn mission(latitude_deg: f64, altitude_m: Option<f64>) -> Option<geodesy::Origin> {
        Some(geodesy::Origin { place: LatLon::new(latitude_deg, 179.5).unwrap(), altitude_m })
    }

    #[test]
    fn the_vehicle_stands_where_its_mission_takes_off_unless_it_is_told_to_stand_elsewhere() {
        #[track_caller]
        fn check(at_mission_origin: bool, of: Option<geodesy::Origin>, expected: (f64, f64, f64)) {
            let configured = Origin { at_mission_origin, ..shipped::config().origin };
            let stands = configured.of_mission(of).unwrap().in_wgs84();
            let found = (stands.place.latitude_deg(), stands.place.longitude_deg(), stands.altitude_m.unwrap());
            assert_eq!(found, expected);
        }
        check(true, None, (54.0, 6.6, 20.0));
        check(true, mission(-16.5, Some(3.0)), (-16.5, 179.5, 3.0));
        check(true, mission(89.0, None), (89.0, 179.5, 20.0));
        check(false, mission(-16.5, Some(3.0)), (54.0, 6.6, 20.0));
    }

    #[test]
    fn a_place_where_no_vehicle_can_be_simulated_is_refused() {
        #[track_caller]
        fn check(of: Option<geodesy::Origin>, expected: &str) {
            assert_eq!(shipped::config().origin.of_mission(of).map(|it| it.in_wgs84()), Err(expected.to_owned()));
        }
        check(
            mission(0.0, Some(9500.0)),
            "the altitude of its origin: found 9500, expected a number from -500 to 9000",
        );
        check(mission(-89.5, None), "the latitude of its origin: found -89.5, expected a number from -89 to 89");
    }
}
