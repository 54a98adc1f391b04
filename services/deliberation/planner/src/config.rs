//! The planner's parameters.

use domain::quantity::{Fraction, Positive};
use domain::speeds::Speeds;
use domain::state::Tolerance;
use domain::way::FlightLimits;
use serde::Deserialize;
use std::num::NonZeroU32;

/// Section `[planner]` of the configuration. Durations are mission time.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Height above the ground it starts from, or lands on, at which a plan flies, in metres.
    /// (ENG: clear of people and parked vehicles, low enough for a short climb.)
    pub takeoff_height_m: Positive,
    /// A takeoff climbs at least this much, in metres. (ENG: less cannot be distinguished from standing.)
    pub least_climb_m: Positive,
    /// Speed limit of a position step, in m/s. (ENG: below PX4's MPC_XY_VEL_MAX of 12 m/s.)
    pub cruise_speed_m_s: Positive,
    /// Where to wait before the border of an area, in metres. (ENG: the braking distance from the
    /// cruise speed at PX4's MPC_ACC_HOR of 3 m/s^2 is 17 m.)
    pub stand_off_m: Positive,
    /// Distance kept to an area that is flown round, as a fraction of the stand-off: smaller by its
    /// type, so that a way past an area never needs to wait at it. (ENG: half.)
    pub margin: Fraction,
    /// Two states this far apart over ground count as one, in metres. (ENG: the position skill's own
    /// tolerance plus the drift of a landing in wind.)
    pub horizontal_tolerance_m: Positive,
    /// The same in height, while in the air. (ENG)
    pub vertical_tolerance_m: Positive,
    /// The same in height, on the ground: ground is not level, and barometers drift. (ENG: less than the height of any
    /// deck or roof.)
    pub ground_tolerance_m: Positive,
    /// Actions in one plan, auxiliary steps not counted. (ENG: three reach any objective; more means
    /// that the actions lead in a circle.)
    pub depth_limit: NonZeroU32,
    /// A step that failed this number of times in a row without any progress of the vehicle counts as
    /// infeasible. (ENG)
    pub failures_at_most: NonZeroU32,
    /// After this number of failed takeoffs in a row the mission is given up. (ENG: a cause that passes, such as a
    /// satellite fix that is not there yet, has passed by then.)
    pub takeoffs_at_most: NonZeroU32,
    /// After this number of failed landings an objective is given up. (ENG: each takes minutes and battery.)
    pub landings_at_most: NonZeroU32,
    /// How fast the vehicle climbs, in m/s. (PX4: MPC_Z_VEL_MAX_UP.)
    pub climb_m_s: Positive,
    /// How fast it descends, in m/s. (PX4: MPC_Z_VEL_MAX_DN.)
    pub descent_m_s: Positive,
    /// Lower than this above the take-off point the vehicle climbs before it leaves an area that it must not be in, and
    /// flies under no area, in metres. (ENG: as the mission manager's.)
    pub least_height_m: Positive,
    /// Over an area it flies, or leaves it, no higher than this, in metres above the take-off point. (ENG: as the
    /// mission manager's.)
    pub highest_m: Positive,
    /// Heights this close to the floor or the ceiling of an area count as inside, in metres. (ENG: as the mission
    /// manager's.)
    pub vertical_margin_m: Positive,
    /// The strongest wind to plan for, gusts included, in m/s: a place that it may carry the vehicle from over a border is
    /// reported. (ENG: a fresh breeze, Beaufort 5.)
    pub wind_m_s: Positive,
    /// A grant must outlast a stay by this, and an area that opens within this time applies already, in seconds. (ENG: the
    /// mission manager's `permission_margin_s`, so that no plan relies on a permission that the manager no longer relies
    /// on.)
    pub grant_lead_s: Positive,
    /// Wait to be expected for a permission never asked for, in seconds: what a detour may cost at
    /// most. (ENG: a tower that grants does so at once.)
    pub expected_wait_s: Positive,
    /// The same for one denied once, on top of what is left of the back-off, in seconds. (ENG: it may
    /// well be denied again.)
    pub expected_wait_after_denial_s: Positive,
    /// A permission denied with a reason is asked for once more after this time, in seconds.
    /// (SPEC 5: 30 s.)
    pub retry_after_denial_s: Positive,
    /// Time to hold because of one area in all, in seconds; then round it, or the objective fails.
    /// (SPEC 5: 120 s.)
    pub hold_at_most_s: Positive,
    /// The status is repeated this often in wall time, in Hz. (SPEC 5: 1 Hz.)
    pub status_rate_hz: Positive,
}

impl Config {
    /// Distance kept to an area that is flown round, in metres.
    pub(crate) fn margin_m(&self) -> f64 {
        self.stand_off_m.get() * self.margin.get()
    }

    /// How far apart two states may be and still count as one.
    pub(crate) fn tolerance(&self) -> Tolerance {
        Tolerance {
            horizontal_m: self.horizontal_tolerance_m.get(),
            vertical_m: self.vertical_tolerance_m.get(),
            ground_m: self.ground_tolerance_m.get(),
        }
    }

    /// How fast plans are flown.
    pub(crate) fn speeds(&self) -> Speeds {
        Speeds {
            cruise_m_s: self.cruise_speed_m_s.get(),
            climb_m_s: self.climb_m_s.get(),
            descent_m_s: self.descent_m_s.get(),
        }
    }

    /// How the vehicle flies out of an area.
    pub(crate) fn flight_limits(&self) -> FlightLimits {
        FlightLimits {
            speeds: self.speeds(),
            least_height_m: self.least_height_m.get(),
            highest_m: self.highest_m.get(),
            clearance_m: self.stand_off_m.get(),
            margin_m: self.margin_m(),
        }
    }
}

/// The energy model of the shipped configuration.
#[cfg(test)]
pub(crate) fn energy_for_tests() -> domain::energy::EnergyModel {
    #[derive(Deserialize)]
    struct File {
        energy: domain::energy::EnergyModel,
    }
    toml::from_str::<File>(domain::testing::ENERGY).expect("the shipped values parse").energy
}

#[cfg(test)]
impl Config {
    pub(crate) fn for_tests() -> Config {
        #[derive(Deserialize)]
        struct File {
            planner: Config,
        }
        let text = "
            [planner]
            takeoff_height_m = 10.0
            least_climb_m = 2.0
            cruise_speed_m_s = 10.0
            stand_off_m = 20.0
            margin = 0.5
            horizontal_tolerance_m = 3.0
            vertical_tolerance_m = 2.0
            ground_tolerance_m = 5.0
            depth_limit = 8
            failures_at_most = 5
            takeoffs_at_most = 5
            landings_at_most = 3
            climb_m_s = 3.0
            descent_m_s = 1.5
            least_height_m = 5.0
            highest_m = 120.0
            vertical_margin_m = 2.0
            wind_m_s = 8.0
            grant_lead_s = 30.0
            expected_wait_s = 2.0
            expected_wait_after_denial_s = 15.0
            retry_after_denial_s = 30.0
            hold_at_most_s = 120.0
            status_rate_hz = 1.0
        ";
        toml::from_str::<File>(text).expect("the fixture parses").planner
    }
}
