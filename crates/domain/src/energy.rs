//! What a flight takes out of the battery: a model of the vehicle, the same for every forecast and every plan.
//!
//! Power is hovering, plus pushing through the air, which grows with the cube of the airspeed (parasite power: Leishman,
//! Principles of Helicopter Aerodynamics, section 5.5), plus climbing or descending, which costs the same for every metre. The
//! wind is a mean wind without gusts. A leg's time is given: how fast it is flown is decided by [`crate::speeds`], by the same wind
//! triangle ([`crate::wind_triangle`]).

use std::fmt;

use serde::Deserialize;

use crate::geometry::Ned;
use crate::quantity::{Fraction, Positive};
use crate::speeds::Speeds;

/// Joules in a watt hour.
const JOULES: f64 = 3600.0;

/// Section `[energy]` of the configuration.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Figures {
    capacity_wh: Positive,
    reserve: Fraction,
    hover_w: Positive,
    cruise_w: Positive,
    cruise_m_s: Positive,
    climb_w: Positive,
    climb_m_s: Positive,
    descent_w: Positive,
    descent_m_s: Positive,
    takeoff_s: Positive,
    landing_s: Positive,
    stop_s: Positive,
    headwind_m_s: Positive,
}

/// The vehicle's figures, checked: pushing through the air never gives energy back.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "Figures")]
pub struct EnergyModel(Figures);

impl TryFrom<Figures> for EnergyModel {
    type Error = String;
    fn try_from(it: Figures) -> Result<EnergyModel, String> {
        if it.cruise_w < it.hover_w {
            let (cruise_w, hover_w) = (it.cruise_w.get(), it.hover_w.get());
            return Err(format!(
                "`cruise_w` is {cruise_w}, expected at least `hover_w`, {hover_w}: a wind would cost nothing"
            ));
        }
        if it.descent_w.get() * 2.0 < it.hover_w.get() {
            let (descent_w, hover_w) = (it.descent_w.get(), it.hover_w.get());
            return Err(format!(
                "`descent_w` is {descent_w}, expected at least half of `hover_w`, {hover_w}: no multirotor descends on less"
            ));
        }
        if 0.9 < it.reserve.get() {
            return Err(format!("`reserve` is {}, expected at most 0.9: nothing could be flown", it.reserve.get()));
        }
        Ok(EnergyModel(it))
    }
}

/// A straight piece of a flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    /// Where it begins.
    pub from: Ned,
    /// Where it ends.
    pub to: Ned,
    /// How long it takes, in seconds.
    pub time_s: f64,
}

/// The mean wind that a flight is judged in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wind {
    /// It blows towards north and east with these speeds, in m/s.
    Towards {
        /// Negative towards south.
        north_m_s: f64,
        /// Negative towards west.
        east_m_s: f64,
    },
    /// It blows with this speed, in m/s, against every leg: its direction is not known.
    Against(f64),
}

impl Wind {
    /// No wind.
    pub const CALM: Wind = Wind::Against(0.0);

    /// A wind of `speed_m_s` from this direction, in degrees from north over east, as pilots and weather reports name it.
    pub fn from_direction(speed_m_s: f64, from_deg: f64) -> Wind {
        let from_rad = from_deg.to_radians();
        Wind::Towards { north_m_s: -speed_m_s * from_rad.cos(), east_m_s: -speed_m_s * from_rad.sin() }
    }
}

impl EnergyModel {
    /// What `leg` takes, in Wh.
    pub fn leg_wh(&self, leg: Leg, wind: Wind) -> f64 {
        let Leg { from, to, time_s } = leg;
        if time_s <= 0.0 {
            return 0.0;
        }
        let (north_m, east_m) = (to.north_m - from.north_m, to.east_m - from.east_m);
        let airspeed_m_s = wind.airspeed_m_s(north_m / time_s, east_m / time_s);
        let up_m = to.height_m() - from.height_m();
        (self.level_w(airspeed_m_s) * time_s + self.vertical_j(up_m)) / JOULES
    }

    /// What hovering for `time_s` takes, in Wh.
    pub fn hover_wh(&self, time_s: f64, wind: Wind) -> f64 {
        self.level_w(wind.airspeed_m_s(0.0, 0.0)) * time_s.max(0.0) / JOULES
    }

    /// What a takeoff takes on top of its climb, in Wh: motors that speed up, and a slow start.
    pub fn takeoff_wh(&self, wind: Wind) -> f64 {
        self.hover_wh(self.0.takeoff_s.get(), wind)
    }

    /// What a landing takes on top of its descent, in Wh: a slow touchdown, and motors that still turn.
    pub fn landing_wh(&self, wind: Wind) -> f64 {
        self.hover_wh(self.0.landing_s.get(), wind)
    }

    /// What a leg that ends at rest takes on top of its distance at a steady speed, in Wh.
    pub fn stop_wh(&self, wind: Wind) -> f64 {
        self.hover_wh(self.0.stop_s.get(), wind)
    }

    /// What a flight from `from` along `way` takes, whose last leg is the descent to where it lands, in Wh.
    pub fn landing_flight_wh(&self, from: Ned, way: &[Ned], speeds: &Speeds, wind: Wind) -> f64 {
        let starts = std::iter::once(&from).chain(way);
        let legs = starts.zip(way).map(|(&from, &to)| Leg { from, to, time_s: speeds.time_s(from, to) });
        let stops_wh = self.stop_wh(wind) * way.len().saturating_sub(1) as f64;
        legs.map(|it| self.leg_wh(it, wind)).sum::<f64>() + stops_wh + self.landing_wh(wind)
    }

    /// The power in flight with this velocity over ground, and upwards, in W.
    pub fn flight_w(&self, (north_m_s, east_m_s): (f64, f64), up_m_s: f64, wind: Wind) -> f64 {
        self.level_w(wind.airspeed_m_s(north_m_s, east_m_s)) + self.vertical_j(up_m_s)
    }

    /// The model of a vehicle that takes this many times what these figures say, for the same flight.
    pub fn taking(self, times: f64) -> EnergyModel {
        let more = |it: Positive| Positive::try_from(it.get() * times).unwrap_or(it);
        let Figures { hover_w, cruise_w, climb_w, descent_w, .. } = self.0;
        let [hover_w, cruise_w, climb_w, descent_w] = [hover_w, cruise_w, climb_w, descent_w].map(more);
        EnergyModel(Figures { hover_w, cruise_w, climb_w, descent_w, ..self.0 })
    }

    /// The wind to reckon with where one of this velocity was measured, as long as it blows stronger than the usual one; else the usual
    /// one, against every leg. (A mean of some seconds says little of a gentle wind an hour later.)
    pub fn wind_where_measured(&self, (north_m_s, east_m_s): (f64, f64)) -> Wind {
        match self.usual_wind().speed_m_s() < north_m_s.hypot(east_m_s) {
            true => Wind::Towards { north_m_s, east_m_s },
            false => self.usual_wind(),
        }
    }

    /// The wind to assume where none is known.
    pub fn usual_wind(&self) -> Wind {
        Wind::Against(self.0.headwind_m_s.get())
    }

    /// What may be used of a battery with this charge.
    pub fn budget(&self, charge: Fraction) -> Budget {
        self.budget_above(charge, self.0.reserve)
    }

    /// What may be used of a battery with this charge until only `reserve` of its capacity is left.
    pub fn budget_above(&self, charge: Fraction, reserve: Fraction) -> Budget {
        let capacity_wh = self.0.capacity_wh.get();
        let charge_wh = capacity_wh * charge.get();
        let usable_wh = (charge_wh - capacity_wh * reserve.get()).max(0.0);
        Budget { charge_wh, usable_wh, capacity_wh, reserve }
    }

    /// The charge of a battery after this many Wh, 0 to 1.
    pub fn charge_after(&self, charge: Fraction, used_wh: f64) -> f64 {
        (charge.get() - used_wh / self.0.capacity_wh.get()).clamp(0.0, 1.0)
    }

    /// Level flight at this airspeed.
    fn level_w(&self, airspeed_m_s: f64) -> f64 {
        let (hover_w, cruise_w) = (self.0.hover_w.get(), self.0.cruise_w.get());
        hover_w + (cruise_w - hover_w) * (airspeed_m_s / self.0.cruise_m_s.get()).powi(3)
    }

    /// What a change of height takes more than level flight of the same time; less than nothing for most descents.
    fn vertical_j(&self, up_m: f64) -> f64 {
        let hover_w = self.0.hover_w.get();
        if 0.0 <= up_m {
            (self.0.climb_w.get() - hover_w) / self.0.climb_m_s.get() * up_m
        } else {
            (self.0.descent_w.get() - hover_w) / self.0.descent_m_s.get() * -up_m
        }
    }
}

/// The energy in the battery, and how much a plan may use.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Budget {
    /// In the battery, in Wh.
    pub charge_wh: f64,
    /// Without the reserve, in Wh.
    pub usable_wh: f64,
    /// Of the full battery, in Wh.
    pub capacity_wh: f64,
    /// The share of the capacity that no plan uses.
    pub reserve: Fraction,
}

impl Budget {
    /// The same if all of the charge may be used.
    pub fn without_reserve(self) -> Budget {
        Budget { usable_wh: self.charge_wh, reserve: Fraction::ZERO, ..self }
    }

    /// Why something that takes this many Wh must not be flown, if so.
    pub fn shortfall(self, needs_wh: f64) -> Option<Shortfall> {
        (self.usable_wh < needs_wh).then_some(Shortfall { needs_wh, budget: self })
    }
}

/// More energy is needed than may be used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shortfall {
    needs_wh: f64,
    budget: Budget,
}

/// `needs 41 Wh of 30 usable (38 of 50 Wh left, 16 % reserve)`.
impl fmt::Display for Shortfall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Budget { charge_wh, usable_wh, capacity_wh, reserve } = self.budget;
        write!(
            f,
            "needs {:.0} Wh of {:.0} usable ({charge_wh:.0} of {capacity_wh:.0} Wh left, {:.0} % reserve)",
            self.needs_wh.ceil(),
            usable_wh.floor(),
            reserve.get() * 100.0
        )
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing;

    #[derive(Debug, Deserialize)]
    struct File {
        energy: EnergyModel,
    }

    fn parse(text: &str) -> Result<EnergyModel, String> {
        toml::from_str::<File>(text).map(|it| it.energy).map_err(|it| it.to_string())
    }

    fn model() -> EnergyModel {
        parse(testing::ENERGY).unwrap()
    }

    fn leg(north_m: f64, east_m: f64, up_m: f64, speed_m_s: f64) -> Leg {
        let to = Ned::new(north_m, east_m, -up_m);
        Leg { from: Ned::default(), to, time_s: Ned::default().distance_m(to) / speed_m_s }
    }

    #[test]
    fn hovering_takes_its_power_for_its_time() {
        let an_hour_wh = model().hover_wh(3600.0, Wind::CALM);
        assert!((model().hover_wh(36.0, Wind::CALM) * 100.0 - an_hour_wh).abs() < 1e-9, "{an_hour_wh}");
        assert_eq!(model().hover_wh(-1.0, Wind::CALM), 0.0);
    }

    #[test]
    fn the_figures_of_the_configuration_are_what_they_are_called() {
        #[track_caller]
        fn check(leg: Leg, wind: Wind, expected_w: f64) {
            let power_w = model().leg_wh(leg, wind) * 3600.0 / leg.time_s;
            assert!((power_w - expected_w).abs() < 1e-6, "{power_w} W, expected {expected_w} W");
        }
        check(leg(600.0, 800.0, 0.0, 10.0), Wind::CALM, 812.0);
        check(leg(0.0, 0.0, 30.0, 3.0), Wind::CALM, 758.0);
        check(leg(0.0, 0.0, -30.0, 1.5), Wind::CALM, 714.0);
        check(Leg { time_s: 10.0, ..leg(0.0, 0.0, 0.0, 1.0) }, Wind::CALM, 725.0);
        // Hovering in a wind of the cruise speed is flying at it.
        check(Leg { time_s: 10.0, ..leg(0.0, 0.0, 0.0, 1.0) }, Wind::Against(10.0), 812.0);
        // With the wind, standing still in the air.
        check(leg(100.0, 0.0, 0.0, 10.0), Wind::from_direction(10.0, 180.0), 725.0);
        check(leg(100.0, 0.0, 0.0, 10.0), Wind::from_direction(10.0, 0.0), 725.0 + 87.0 * 8.0);
    }

    #[test]
    fn what_is_used_leaves_the_reserve() {
        #[track_caller]
        fn check(charge: f64, needs_wh: f64, expected: Option<&str>) {
            let budget = model().budget(Fraction::try_from(charge).unwrap());
            assert_eq!(budget.shortfall(needs_wh).map(|it| it.to_string()).as_deref(), expected);
        }
        check(1.0, 225.0, None);
        check(1.0, 225.1, Some("needs 226 Wh of 225 usable (300 of 300 Wh left, 25 % reserve)"));
        check(0.5, 80.0, Some("needs 80 Wh of 75 usable (150 of 300 Wh left, 25 % reserve)"));
        check(0.1, 1.0, Some("needs 1 Wh of 0 usable (30 of 300 Wh left, 25 % reserve)"));
        check(0.1, 0.0, None);
    }

    #[test]
    fn a_vehicle_that_takes_more_takes_more_of_everything() {
        let (usual, iced) = (model(), model().taking(1.5));
        for it in [leg(600.0, 800.0, 0.0, 10.0), leg(0.0, 0.0, 30.0, 3.0), leg(0.0, 0.0, -30.0, 1.5)] {
            let [usual_wh, iced_wh] = [usual, iced].map(|model| model.leg_wh(it, Wind::CALM));
            assert!((iced_wh - 1.5 * usual_wh).abs() < 1e-9, "{iced_wh} Wh of {usual_wh} Wh");
        }
        assert_eq!(iced.budget(Fraction::try_from(0.5).unwrap()), usual.budget(Fraction::try_from(0.5).unwrap()));
        assert_eq!(usual.flight_w((10.0, 0.0), 3.0, Wind::CALM), 812.0 + 33.0);
    }

    #[test]
    fn a_measured_wind_counts_once_it_is_stronger_than_the_usual_one() {
        assert_eq!(model().wind_where_measured((3.0, 0.0)), Wind::Against(4.0));
        let measured = Wind::Towards { north_m_s: 3.0, east_m_s: -4.0 };
        assert_eq!(model().wind_where_measured((3.0, -4.0)), measured);
    }

    #[test]
    fn figures_that_make_no_sense_are_refused() {
        #[track_caller]
        fn check(find: &str, replace: &str, expected: &str) {
            assert!(testing::ENERGY.contains(find));
            let refused = parse(&testing::ENERGY.replacen(find, replace, 1)).unwrap_err();
            assert!(refused.contains(expected), "{refused}");
        }
        check("cruise_w = 812.0", "cruise_w = 600.0", "`cruise_w` is 600, expected at least `hover_w`, 725");
        check("descent_w = 714.0", "descent_w = 300.0", "`descent_w` is 300, expected at least half of `hover_w`, 725");
        check("reserve = 0.25", "reserve = 1.0", "`reserve` is 1, expected at most 0.9");
        check("capacity_wh = 300.0", "capacity_wh = nan", "found NaN, expected a number between");
    }

    proptest! {
        #[test]
        fn more_distance_or_more_wind_against_it_never_costs_less(
            (north_m, east_m, up_m) in (-5e3..5e3, -5e3..5e3, -100.0..100.0),
            (longer, speed_m_s, wind_m_s, more_m_s) in (1.0..3.0, 1.0..15.0, 0.0..20.0, 0.0..10.0),
        ) {
            let near = model().leg_wh(leg(north_m, east_m, up_m, speed_m_s), Wind::Against(wind_m_s));
            let far = leg(north_m * longer, east_m * longer, up_m * longer, speed_m_s);
            prop_assert!(0.0 <= near);
            prop_assert!(near <= model().leg_wh(far, Wind::Against(wind_m_s)) + 1e-9);
            let stronger = Wind::Against(wind_m_s + more_m_s);
            prop_assert!(near <= model().leg_wh(leg(north_m, east_m, up_m, speed_m_s), stronger) + 1e-9);
        }

        #[test]
        fn a_round_flight_at_one_speed_never_gains_by_a_wind(
            corners in prop::collection::vec((-5e3..5e3, -5e3..5e3), 1..6),
            (speed_m_s, wind_m_s, from_deg) in (1.0..15.0, 0.0..20.0, 0.0..360.0),
        ) {
            let home = [Ned::default()];
            let places: Vec<Ned> = home.into_iter().chain(corners.iter().map(|&(n, e)| Ned::new(n, e, 0.0))).chain(home).collect();
            let cost_wh = |wind| -> f64 {
                let time_s = |pair: &[Ned]| pair[0].distance_m(pair[1]) / speed_m_s;
                places.windows(2).map(|it| model().leg_wh(Leg { from: it[0], to: it[1], time_s: time_s(it) }, wind)).sum()
            };
            let blown_wh = cost_wh(Wind::from_direction(wind_m_s, from_deg));
            prop_assert!(cost_wh(Wind::CALM) <= blown_wh * (1.0 + 1e-9) + 1e-9);
            // Against every leg is the worst direction.
            prop_assert!(blown_wh <= cost_wh(Wind::Against(wind_m_s)) * (1.0 + 1e-9) + 1e-9);
        }

        #[test]
        fn a_leg_costs_what_its_parts_cost(
            (north_m, east_m, up_m) in (-5e3..5e3, -5e3..5e3, -100.0..100.0),
            (share, speed_m_s, wind_m_s, from_deg) in (0.0..1.0, 1.0..15.0, 0.0..20.0, 0.0..360.0),
        ) {
            let wind = Wind::from_direction(wind_m_s, from_deg);
            let whole = leg(north_m, east_m, up_m, speed_m_s);
            let middle = whole.from.towards(whole.to, share);
            let parts = [
                Leg { to: middle, time_s: whole.time_s * share, ..whole },
                Leg { from: middle, time_s: whole.time_s * (1.0 - share), ..whole },
            ];
            let parts_wh: f64 = parts.iter().map(|it| model().leg_wh(*it, wind)).sum();
            prop_assert!((parts_wh - model().leg_wh(whole, wind)).abs() < 1e-6);
        }
    }
}
