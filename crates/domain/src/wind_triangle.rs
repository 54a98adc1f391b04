//! The wind triangle: the velocity over ground is the velocity through the air plus the wind.
//!
//! A vehicle that keeps to a straight track turns its nose into the crosswind until the two cancel (it crabs); what is left of its
//! airspeed carries it along the track, with the wind's part along it added (FAA-H-8083-25C, Pilot's Handbook of Aeronautical
//! Knowledge, chapter 16, "Wind Triangle or Vector Analysis"). Times of legs and the energy they take are computed from the same
//! triangle.

use crate::energy::Wind;

/// A vehicle that is faster than the wind by less than this stands in it, in m/s. (ENG: within what a gust takes, and so little that no
/// leg against it would ever end.)
const LEAST_LEFT_M_S: f64 = 0.5;

impl Wind {
    /// How fast it blows, in m/s.
    pub fn speed_m_s(self) -> f64 {
        match self {
            Wind::Towards { north_m_s, east_m_s } => north_m_s.hypot(east_m_s),
            Wind::Against(speed_m_s) => speed_m_s,
        }
    }

    /// Whether a vehicle with this airspeed, in m/s, can hold its place in it.
    pub fn is_held_against_by(self, airspeed_m_s: f64) -> bool {
        LEAST_LEFT_M_S <= airspeed_m_s - self.speed_m_s()
    }

    /// The speed through the air of a vehicle with this velocity over ground, in m/s.
    pub fn airspeed_m_s(self, north_m_s: f64, east_m_s: f64) -> f64 {
        match self {
            Wind::Towards { north_m_s: north, east_m_s: east } => (north_m_s - north).hypot(east_m_s - east),
            Wind::Against(speed_m_s) => north_m_s.hypot(east_m_s) + speed_m_s,
        }
    }

    /// How fast a vehicle with this airspeed comes forward over ground along `track`, a unit vector `(north, east)`, in m/s.
    ///
    /// `None` if the wind is about as fast as the vehicle, or faster: it could not hold its place then, and so neither stop nor wait at
    /// the end of any leg, also of one that it would be blown along. In any weaker wind every track can be flown.
    pub fn ground_speed_m_s(self, airspeed_m_s: f64, track: (f64, f64)) -> Option<f64> {
        if !self.is_held_against_by(airspeed_m_s) {
            return None;
        }
        Some(match self {
            Wind::Towards { north_m_s, east_m_s } => {
                let (north, east) = track;
                let along_m_s = north_m_s * north + east_m_s * east;
                let across_m_s = east_m_s * north - north_m_s * east;
                // Rounding may leave the crosswind a little faster than the wind.
                along_m_s + (airspeed_m_s * airspeed_m_s - across_m_s * across_m_s).max(0.0).sqrt()
            }
            Wind::Against(speed_m_s) => airspeed_m_s - speed_m_s,
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_headwind_slows_a_tailwind_helps_and_a_crosswind_takes_its_part() {
        #[track_caller]
        fn check(wind: Wind, track: (f64, f64), expected_m_s: Option<f64>) {
            let found_m_s = wind.ground_speed_m_s(10.0, track);
            let is_close = match (found_m_s, expected_m_s) {
                (Some(found_m_s), Some(expected_m_s)) => (found_m_s - expected_m_s).abs() < 1e-9,
                (found_m_s, expected_m_s) => found_m_s == expected_m_s,
            };
            assert!(is_close, "{wind:?} along {track:?}: {found_m_s:?}, expected {expected_m_s:?}");
        }
        let to_the_east = Wind::Towards { north_m_s: 0.0, east_m_s: 6.0 };
        check(to_the_east, (0.0, 1.0), Some(16.0));
        check(to_the_east, (0.0, -1.0), Some(4.0));
        // 6, 8 and 10 are the sides of a right triangle.
        check(to_the_east, (1.0, 0.0), Some(8.0));
        check(Wind::Against(6.0), (0.6, 0.8), Some(4.0));
        check(Wind::CALM, (0.6, 0.8), Some(10.0));
        check(Wind::Against(10.0), (1.0, 0.0), None);
        // It would be blown along the first of them, and could not stop.
        check(Wind::Towards { north_m_s: 12.0, east_m_s: 0.0 }, (1.0, 0.0), None);
        check(Wind::Towards { north_m_s: 12.0, east_m_s: 0.0 }, (-1.0, 0.0), None);
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn the_triangle_closes_wherever_the_vehicle_can_hold_its_place(
            (airspeed_m_s, wind_m_s) in (0.5..40.0, 0.0..60.0),
            (from_deg, track_deg) in (0.0..360.0, 0.0..360.0f64),
        ) {
            let track = (track_deg.to_radians().cos(), track_deg.to_radians().sin());
            for wind in [Wind::from_direction(wind_m_s, from_deg), Wind::Against(wind_m_s)] {
                match wind.ground_speed_m_s(airspeed_m_s, track) {
                    Some(ground_m_s) => {
                        prop_assert!(wind.speed_m_s() < airspeed_m_s && 0.0 < ground_m_s && ground_m_s.is_finite());
                        let closed_m_s = wind.airspeed_m_s(ground_m_s * track.0, ground_m_s * track.1);
                        prop_assert!((closed_m_s - airspeed_m_s).abs() < 1e-4, "{closed_m_s} m/s, {airspeed_m_s} m/s");
                    }
                    None => prop_assert!(airspeed_m_s < wind.speed_m_s() + LEAST_LEFT_M_S + 1e-9),
                }
            }
        }

        #[test]
        fn no_wind_is_worse_than_one_against_every_leg(
            (airspeed_m_s, wind_m_s) in (0.5..40.0, 0.0..60.0),
            (from_deg, track_deg) in (0.0..360.0, 0.0..360.0f64),
        ) {
            let track = (track_deg.to_radians().cos(), track_deg.to_radians().sin());
            let towards = Wind::from_direction(wind_m_s, from_deg).ground_speed_m_s(airspeed_m_s, track);
            if let (Some(towards), Some(against)) = (towards, Wind::Against(wind_m_s).ground_speed_m_s(airspeed_m_s, track)) {
                prop_assert!(against <= towards + 1e-4, "{against} m/s, {towards} m/s");
            }
        }
    }
}
