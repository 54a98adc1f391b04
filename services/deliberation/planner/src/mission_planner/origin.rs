//! Whether the mission's origin is that of the vehicle's local frame. Places are metres from the origin: a mission that is flown from
//! another one is flown shifted, past its own areas. It is refused, and never converted: nobody has checked it there.

use std::fmt;
use std::time::Duration;

use domain::geodesy::{LatLon, Origin};

use super::{Answer, MissionPlanner};

/// A plan is asked for again after this while the vehicle's origin is not known, in mission time. (ENG: the vehicle says it twice a
/// second.)
const UNKNOWN_PAUSE: Duration = Duration::from_secs(1);

/// Why a mission must not be flown in the vehicle's local frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Misfit {
    /// The vehicle has not said where its origin is.
    Unknown,
    /// The two are too far apart.
    Elsewhere {
        /// How far, over ground.
        away_m: f64,
        mission: LatLon,
        vehicle: LatLon,
        tolerance_m: f64,
    },
}

impl fmt::Display for Misfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Misfit::Unknown => f.write_str("the mission has an origin, and the vehicle has not said where its own is"),
            Misfit::Elsewhere { away_m, mission, vehicle, tolerance_m } => write!(
                f,
                "the mission's origin is {} from the vehicle's: {mission} and {vehicle}, expected at most {tolerance_m} m",
                in_words(*away_m)
            ),
        }
    }
}

/// Why a mission with the origin `mission` must not be flown by a vehicle whose local frame has the origin `vehicle`, if so. A mission
/// without an origin is flown from wherever the vehicle stands. Altitudes do not count: heights are above the take-off point.
pub(crate) fn misfit(mission: Option<Origin>, vehicle: Option<Origin>, tolerance_m: f64) -> Option<Misfit> {
    let mission = mission?.place;
    let Some(vehicle) = vehicle.map(|it| it.place) else { return Some(Misfit::Unknown) };
    let away_m = mission.distance_m(vehicle);
    (tolerance_m < away_m).then_some(Misfit::Elsewhere { away_m, mission, vehicle, tolerance_m })
}

fn in_words(distance_m: f64) -> String {
    match distance_m {
        near if near < 100.0 => format!("{near:.1} m"),
        far if far < 1000.0 => format!("{far:.0} m"),
        farther => format!("{:.1} km", farther / 1000.0),
    }
}

impl MissionPlanner {
    /// Why a mission with this origin must not be flown by this vehicle, if so.
    pub(crate) fn misfit(&self, mission: Option<Origin>) -> Option<Misfit> {
        misfit(mission, self.vehicle_origin, self.rules.config.origin_tolerance_m.get())
    }

    /// What a request for a plan is answered with because of the origin, or of a task that no declared skill does; `None` if there is no
    /// obstacle.
    pub(super) fn answer_to_misfit(&mut self) -> Option<Answer> {
        if let Some(reason) = self.waits_for_origin() {
            return Some(Answer::Hold { wait: UNKNOWN_PAUSE, reason, planned: false });
        }
        if self.forecast.is_some() {
            return None;
        }
        let elsewhere = self.misfit(self.mission.origin).map(|it| it.to_string());
        // In flight the others are flown.
        let undone = || self.rules.skills.misfit_in(&self.mission.objectives).filter(|_| self.begun.is_none());
        let why = elsewhere.or_else(undone)?;
        self.objectives.give_up_rest(&why);
        Some(Answer::Finished)
    }

    /// Why nothing is flown yet, if it is for the vehicle's origin.
    pub(super) fn waits_for_origin(&self) -> Option<String> {
        let waits =
            !self.is_over() && self.forecast.is_none() && self.misfit(self.mission.origin) == Some(Misfit::Unknown);
        waits.then(|| format!("waiting for the vehicle's place: {}", Misfit::Unknown))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn origin(latitude_deg: f64, longitude_deg: f64) -> Option<Origin> {
        Some(Origin { place: LatLon::new(latitude_deg, longitude_deg).unwrap(), altitude_m: None })
    }

    /// A degree of latitude is 111.3 km at 54 degrees, one of longitude 111.3 km at the equator.
    #[test]
    fn a_mission_is_flown_from_its_origin_only() {
        #[track_caller]
        fn check(mission: Option<Origin>, vehicle: Option<Origin>, expected: &str) {
            let found = misfit(mission, vehicle, 5.0).map(|it| it.to_string()).unwrap_or_default();
            assert_eq!(found, expected);
        }
        let here = origin(54.0, 6.6);
        check(None, None, "");
        check(None, here, "");
        check(here, here, "");
        check(here, None, "the mission has an origin, and the vehicle has not said where its own is");
        // 4.5 m and 5.6 m.
        check(here, origin(54.00004, 6.6), "");
        check(
            here,
            origin(54.00005, 6.6),
            "the mission's origin is 5.6 m from the vehicle's: 54.000000, 6.600000 and 54.000050, 6.600000, expected at most 5 m",
        );
        check(
            here,
            origin(54.004, 6.6),
            "the mission's origin is 445 m from the vehicle's: 54.000000, 6.600000 and 54.004000, 6.600000, expected at most 5 m",
        );
        check(
            origin(54.01, 6.6),
            here,
            "the mission's origin is 1.1 km from the vehicle's: 54.010000, 6.600000 and 54.000000, 6.600000, expected at most 5 m",
        );
    }

    #[test]
    fn at_the_antimeridian_and_near_a_pole_the_distance_counts_and_not_the_degrees() {
        #[track_caller]
        fn check(mission: (f64, f64), vehicle: (f64, f64), fits: bool) {
            let found = misfit(origin(mission.0, mission.1), origin(vehicle.0, vehicle.1), 5.0);
            assert_eq!(found.is_none(), fits, "{found:?}");
        }
        // 4.5 m and 6.7 m across the antimeridian.
        check((0.0, 179.99998), (0.0, -179.99998), true);
        check((0.0, 179.99997), (0.0, -179.99997), false);
        check((-16.5, 180.0), (-16.5, -180.0), true);
        // At 89 degrees a thousandth of a degree of longitude is 1.9 m, at the equator it is 111 m.
        check((89.0, 10.0), (89.0, 10.002), true);
        check((89.0, 10.0), (89.0, 10.003), false);
        check((0.0, 10.0), (0.0, 10.002), false);
    }

    proptest! {
        #[test]
        fn who_is_nearer_than_the_tolerance_fits_and_who_is_farther_does_not(
            latitude_deg in -89.0..89.0_f64, longitude_deg in -180.0..180.0_f64,
            direction in 0.0..std::f64::consts::TAU, tolerance_m in 0.1..10.0_f64, share in 0.0..3.0_f64,
        ) {
            use domain::geodesy::LocalFrame;
            use domain::geometry::Ned;
            prop_assume!(0.001 < (share - 1.0).abs());
            let mission = origin(latitude_deg, longitude_deg);
            let (sin, cos) = direction.sin_cos();
            let away_m = share * tolerance_m;
            let place = LocalFrame::at(mission.unwrap().place).lat_lon(Ned::new(away_m * cos, away_m * sin, 0.0));
            let vehicle = Some(Origin { place, altitude_m: Some(9.0) });
            prop_assert_eq!(misfit(mission, vehicle, tolerance_m).is_none(), share < 1.0);
            prop_assert_eq!(misfit(vehicle, mission, tolerance_m).is_none(), share < 1.0);
        }
    }
}
