//! How long a straight leg takes: the one answer for plans, forecasts, the lengths of grants, and ways without a plan.

use std::time::Duration;

use crate::energy::Wind;
use crate::geometry::Ned;

/// How fast a vehicle flies, in metres per second, and in which wind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Speeds {
    /// Along its way, over ground: its commanded speed, which it does not exceed even with the wind.
    pub cruise_m_s: f64,
    /// Upwards.
    pub climb_m_s: f64,
    /// Downwards.
    pub descent_m_s: f64,
    /// The fastest that it flies through the air. Against a wind that leaves less than the cruise speed a leg is slower.
    pub airspeed_m_s: f64,
    /// The mean wind.
    pub wind: Wind,
}

/// A load that is released is taken to fall at this speed, in metres per second. (ENG: the mean of a free fall from 20 m; the
/// permissions for what lies below must hold for as long as that takes.)
const FALL_M_S: f64 = 10.0;

impl Speeds {
    /// Those of a load that falls from where it is released. The one answer for plans and for the mission manager's checks: what is below
    /// is entered at the same time for both.
    pub const OF_A_LOAD: Speeds = Speeds::calm(FALL_M_S, FALL_M_S, FALL_M_S);

    /// These speeds without wind, in which the vehicle is taken to be able to hold them.
    pub const fn calm(cruise_m_s: f64, climb_m_s: f64, descent_m_s: f64) -> Speeds {
        Speeds { cruise_m_s, climb_m_s, descent_m_s, airspeed_m_s: f64::INFINITY, wind: Wind::CALM }
    }

    /// Whether the vehicle can hold its place in the wind. If not, every leg takes forever.
    pub fn hold_in_wind(&self) -> bool {
        self.wind.is_held_against_by(self.airspeed_m_s)
    }

    /// The flight time of the straight leg from `from` to `to`, in seconds: that of its length at cruise speed, that of its way
    /// over ground at what the wind leaves of the airspeed, or that of its climb or descent, whichever is longest. Infinite if
    /// the vehicle cannot fly in this wind.
    pub fn time_s(&self, from: Ned, to: Ned) -> f64 {
        let climb_m = to.height_m() - from.height_m();
        let vertical_s = if 0.0 < climb_m { climb_m / self.climb_m_s } else { -climb_m / self.descent_m_s };
        vertical_s.max(from.distance_m(to) / self.cruise_m_s).max(self.time_over_ground_s(from, to))
    }

    /// What the way over ground takes at what the wind leaves of the airspeed, where that may be longer than at cruise speed; else 0.
    fn time_over_ground_s(&self, from: Ned, to: Ned) -> f64 {
        // A search computes it a hundred thousand times, and mostly the wind leaves the cruise speed in every direction.
        if self.cruise_m_s <= self.airspeed_m_s - self.wind.speed_m_s() {
            return 0.0;
        }
        let over_ground_m = from.horizontal_distance_m(to);
        // Straight up and down it holds its place, in whichever direction.
        let track = match 0.0 < over_ground_m {
            true => ((to.north_m - from.north_m) / over_ground_m, (to.east_m - from.east_m) / over_ground_m),
            false => (1.0, 0.0),
        };
        match self.wind.ground_speed_m_s(self.airspeed_m_s, track) {
            Some(_) if over_ground_m == 0.0 => 0.0,
            Some(speed_m_s) => over_ground_m / speed_m_s,
            None => f64::INFINITY,
        }
    }

    /// How far into the leg from `from` to `to` the vehicle is at this fraction of the leg, as a duration; the longest
    /// one if it does not fit.
    pub fn time_to(&self, fraction: f64, from: Ned, to: Ned) -> Duration {
        match fraction <= 0.0 {
            true => Duration::ZERO,
            false => Duration::try_from_secs_f64(self.time_s(from, to) * fraction).unwrap_or(Duration::MAX),
        }
    }

    /// The flight time as a duration; the longest one if it does not fit.
    pub fn time(&self, from: Ned, to: Ned) -> Duration {
        Duration::try_from_secs_f64(self.time_s(from, to)).unwrap_or(Duration::MAX)
    }

    /// The time that it takes to fly these points, in seconds.
    pub fn time_along_s(&self, from: Ned, way: &[Ned]) -> f64 {
        let starts = std::iter::once(&from).chain(way);
        starts.zip(way).map(|(from, to)| self.time_s(*from, *to)).sum()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_leg_takes_as_long_as_its_way_or_its_climb() {
        #[track_caller]
        fn check(to: Ned, expected_s: f64) {
            let speeds = Speeds::calm(10.0, 3.0, 1.5);
            assert_eq!(speeds.time_s(Ned::new(0.0, 0.0, -10.0), to), expected_s, "to {to}");
        }
        check(Ned::new(0.0, 500.0, -10.0), 50.0);
        check(Ned::new(0.0, 0.0, -40.0), 10.0);
        check(Ned::new(0.0, 0.0, -4.0), 4.0);
        check(Ned::new(0.0, 40.0, -40.0), 10.0);
        check(Ned::new(0.0, 400.0, -310.0), 100.0);
    }

    #[test]
    fn a_load_falls_whatever_the_wind() {
        let time_s = Speeds::OF_A_LOAD.time_s(Ned::new(0.0, 200.0, -60.0), Ned::new(0.0, 200.0, 0.0));
        assert!((time_s - 6.0).abs() < 1e-9, "{time_s} s");
    }

    /// The wind blows towards the east.
    fn in_wind(east_m_s: f64) -> Speeds {
        let wind = Wind::Towards { north_m_s: 0.0, east_m_s };
        Speeds { airspeed_m_s: 15.0, wind, ..Speeds::calm(10.0, 3.0, 1.5) }
    }

    #[test]
    fn a_wind_slows_legs_against_it_and_makes_none_faster_than_its_setpoint() {
        #[track_caller]
        fn check(wind_m_s: f64, to: Ned, expected_s: f64) {
            let time_s = in_wind(wind_m_s).time_s(Ned::default(), to);
            let is_close = time_s == expected_s || (time_s - expected_s).abs() < 1e-9;
            assert!(is_close, "{wind_m_s} m/s, to {to}: {time_s} s, expected {expected_s} s");
        }
        let (east, west, north) = (Ned::new(0.0, 600.0, 0.0), Ned::new(0.0, -600.0, 0.0), Ned::new(600.0, 0.0, 0.0));
        // 15 m/s through the air suffice for 10 m/s over ground.
        check(4.0, west, 60.0);
        check(5.0, west, 60.0);
        check(9.0, west, 100.0);
        check(9.0, east, 60.0);
        // 12 m/s are left across a wind of 9 m/s: more than the setpoint. Across 12 m/s it is 9 m/s.
        check(9.0, north, 60.0);
        check(12.0, north, 600.0 / 9.0);
        // A climb does not depend on the wind.
        check(14.0, Ned::new(0.0, 0.0, -30.0), 10.0);
        for to in [east, west, north, Ned::new(0.0, 0.0, -30.0), Ned::default()] {
            check(15.0, to, f64::INFINITY);
        }
        assert!(in_wind(14.5).hold_in_wind() && !in_wind(15.0).hold_in_wind());
        assert_eq!(in_wind(15.0).time(Ned::default(), east), Duration::MAX);
        assert_eq!(in_wind(15.0).time_to(0.0, Ned::default(), east), Duration::ZERO);
        assert_eq!(in_wind(9.0).time_to(0.5, Ned::default(), east), Duration::from_secs(30));
    }

    fn place() -> impl Strategy<Value = Ned> {
        (-5e3..5e3, -5e3..5e3, -120.0..0.0).prop_map(|(north, east, down)| Ned::new(north, east, down))
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn a_level_leg_takes_as_long_back_in_calm_air(from in place(), to in place()) {
            let (to, speeds) = (to.at_height(from.height_m()), Speeds::calm(10.0, 3.0, 1.5));
            prop_assert_eq!(speeds.time_s(from, to), speeds.time_s(to, from));
        }

        #[test]
        fn no_wind_makes_a_leg_quicker_and_no_detour_is(
            (from, by, to) in (place(), place(), place()),
            (wind_m_s, from_deg) in (0.0..14.0, 0.0..360.0),
        ) {
            let wind = Wind::from_direction(wind_m_s, from_deg);
            let speeds = Speeds { wind, ..in_wind(0.0) };
            let straight_s = speeds.time_s(from, to);
            prop_assert!(straight_s.is_finite() && Speeds::calm(10.0, 3.0, 1.5).time_s(from, to) <= straight_s);
            // A search relies on it: no turn makes a way quicker than the straight one.
            prop_assert!(straight_s <= speeds.time_along_s(from, &[by, to]) * (1.0 + 1e-9) + 1e-6);
        }
    }
}
