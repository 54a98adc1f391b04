//! The planner's parameters.

use std::num::NonZeroU32;

use domain::quantity::{Fraction, Positive};
use domain::state::Tolerance;
use serde::Deserialize;

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
    /// Actions in one plan, auxiliary steps not counted. (ENG: three reach any objective; more means
    /// that the actions lead in a circle.)
    pub depth_limit: NonZeroU32,
    /// A step that failed this number of times in a row without any progress of the vehicle counts as
    /// infeasible. (ENG)
    pub failures_at_most: NonZeroU32,
    /// An area whose time window opens within this time already counts, in seconds. (ENG: longer
    /// than the flight through the area.)
    pub window_look_ahead_s: Positive,
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
        Tolerance { horizontal_m: self.horizontal_tolerance_m.get(), vertical_m: self.vertical_tolerance_m.get() }
    }

    /// Flight time over a distance, in seconds.
    pub(crate) fn flight_time_s(&self, distance_m: f64) -> f64 {
        distance_m / self.cruise_speed_m_s.get()
    }
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
            depth_limit = 8
            failures_at_most = 5
            window_look_ahead_s = 300.0
            expected_wait_s = 2.0
            expected_wait_after_denial_s = 15.0
            retry_after_denial_s = 30.0
            hold_at_most_s = 120.0
            status_rate_hz = 1.0
        ";
        toml::from_str::<File>(text).expect("the fixture parses").planner
    }
}
