//! How the aircraft flies, in plans and in responses, and what that takes out of the battery.

use serde::Deserialize;

use crate::energy::{EnergyModel, Wind};
use crate::quantity::{Fraction, Number, Positive};
use crate::speeds::Speeds;
use crate::way::FlightLimits;

/// Ways lead past under and over areas this far beyond the vertical margin, in metres. (ENG: as far as a height may be off in the air.)
const HEIGHT_CLEARANCE_M: f64 = 2.0;

/// The sections `[flight]` and `[energy]` of the configuration.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Aircraft {
    /// How it flies.
    pub flight: Flight,
    /// What its flight takes out of the battery.
    pub energy: EnergyModel,
}

/// Section `[flight]` of the configuration.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Flight {
    /// Speed over ground, in m/s. (ENG: below PX4's MPC_XY_VEL_MAX of 12 m/s.)
    pub cruise_m_s: Positive,
    /// The fastest that it flies through the air, in m/s: against a wind that leaves less than the cruise speed, legs take longer, and in a
    /// wind that is as fast nothing is flown. (PX4: MPC_XY_VEL_MAX of 12 m/s is over ground; ENG: what a multirotor of this power holds
    /// with a reserve for gusts. What is slower than 1 m/s stands in every breeze, and none is faster than 100.)
    pub airspeed_m_s: Number<1, 100>,
    /// How fast it climbs, in m/s. (PX4: MPC_Z_VEL_MAX_UP.)
    pub climb_m_s: Positive,
    /// How fast it descends, in m/s. (PX4: MPC_Z_VEL_MAX_DN.)
    pub descent_m_s: Positive,
    /// Lower than this above the ground it climbs before it flies anywhere, and it flies under no area, in metres. (ENG: clear of people.)
    pub least_height_m: Positive,
    /// The height above a place, in metres, at which a response comes to it from afar, unless it is higher already.
    pub return_height_m: Positive,
    /// Over an area it flies, or leaves it, no higher than this, in metres above the take-off point. (ENG: EASA's open category ends at 120 m.)
    pub highest_m: Positive,
    /// Where it waits before the border of an area, and from where on an area counts as left, in metres. (ENG: the braking distance from the
    /// cruise speed at PX4's MPC_ACC_HOR of 3 m/s2 is 17 m.)
    pub stand_off_m: Positive,
    /// Distance kept to an area that is flown round, as a fraction of the stand-off: smaller by its type, so that a way past an area never
    /// needs to wait at it. (ENG: half.)
    pub margin: Fraction,
    /// Heights this close to the floor or the ceiling of an area count as inside, in metres. (ENG: drift of a barometer.)
    pub vertical_margin_m: Positive,
}

impl Flight {
    /// How fast it flies in this wind.
    pub fn speeds(&self, wind: Wind) -> Speeds {
        Speeds {
            cruise_m_s: self.cruise_m_s.get(),
            climb_m_s: self.climb_m_s.get(),
            descent_m_s: self.descent_m_s.get(),
            airspeed_m_s: self.airspeed_m_s.get(),
            wind,
        }
    }

    /// Heights and distances of its ways, with these speeds.
    pub fn limits(&self, speeds: Speeds) -> FlightLimits {
        FlightLimits {
            speeds,
            least_height_m: self.least_height_m.get(),
            return_height_m: self.return_height_m.get(),
            highest_m: self.highest_m.get(),
            clearance_m: self.stand_off_m.get(),
            margin_m: self.stand_off_m.get() * self.margin.get(),
            height_clearance_m: HEIGHT_CLEARANCE_M,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn an_airspeed_that_no_multirotor_has_is_refused() {
        #[track_caller]
        fn check(airspeed_m_s: &str, expected: &str) {
            let text = [testing::FLIGHT, testing::ENERGY].concat().replace("airspeed_m_s = 15.0", airspeed_m_s);
            let refused = toml::from_str::<Aircraft>(&text).unwrap_err().to_string();
            assert!(refused.contains(expected), "{refused}");
        }
        check("airspeed_m_s = 0.5", "found 0.5, expected a number from 1 to 100");
        check("airspeed_m_s = 150.0", "found 150, expected a number from 1 to 100");
        check("airspeed_m_s = nan", "found NaN, expected a number from 1 to 100");
        check("", "missing field `airspeed_m_s`");
    }
}
