//! The planner's parameters.

use domain::quantity::{Positive, Seconds};
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
    /// Two states this far apart over ground count as one, in metres. (ENG: the position skill's own
    /// tolerance plus the drift of a landing in wind.)
    pub horizontal_tolerance_m: Positive,
    /// The same in height, while in the air. (ENG)
    pub vertical_tolerance_m: Positive,
    /// The same in height, on the ground: ground is not level, and barometers drift. (ENG: less than the height of any
    /// deck or roof.)
    pub ground_tolerance_m: Positive,
    /// Actions in one plan, auxiliary steps and tasks not counted. (ENG: three reach any objective; more means
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
    /// A permission is asked for at least this long before the vehicle is at the border, during an earlier step if need be, in
    /// seconds, from 0 to 120; 0: no earlier than in the step that leads to the border. (ENG: a tower decides within some
    /// seconds; SPEC 5 has its answer awaited for 10 s.)
    pub ask_ahead_s: Seconds<0, 120_000>,
    /// A permission denied with a reason is asked for once more after this time, in seconds.
    /// (SPEC 5: 30 s.)
    pub retry_after_denial_s: Positive,
    /// Time to hold because of one area in all, in seconds; then round it, or the objective fails.
    /// (SPEC 5: 120 s.)
    pub hold_at_most_s: Positive,
    /// A mission's origin may lie this far from that of the vehicle's local frame. (ENG: a satellite position without corrections
    /// is some metres off.)
    pub origin_tolerance_m: OriginTolerance,
}

/// Metres over ground: from 0.1, since no position is known better, to 10, the least distance of a mission's places from the border
/// of an area (see `domain::mission`).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "f64")]
pub struct OriginTolerance(f64);

impl OriginTolerance {
    /// The number.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl TryFrom<f64> for OriginTolerance {
    type Error = String;
    fn try_from(metres: f64) -> Result<OriginTolerance, String> {
        if (0.1..=10.0).contains(&metres) {
            Ok(OriginTolerance(metres))
        } else {
            Err(format!("found {metres}, expected metres from 0.1 to 10"))
        }
    }
}

#[cfg(test)]
impl Config {
    pub(crate) fn for_tests() -> Config {
        Config::read_for_tests(Config::TEXT).expect("the fixture parses")
    }

    fn read_for_tests(text: &str) -> Result<Config, toml::de::Error> {
        #[derive(Deserialize)]
        struct File {
            planner: Config,
        }
        toml::from_str::<File>(text).map(|it| it.planner)
    }

    const TEXT: &str = "
            [planner]
            takeoff_height_m = 10.0
            least_climb_m = 2.0
            horizontal_tolerance_m = 3.0
            vertical_tolerance_m = 2.0
            ground_tolerance_m = 5.0
            depth_limit = 8
            failures_at_most = 5
            takeoffs_at_most = 5
            landings_at_most = 3
            wind_m_s = 8.0
            grant_lead_s = 30.0
            expected_wait_s = 2.0
            expected_wait_after_denial_s = 15.0
            ask_ahead_s = 8.0
            retry_after_denial_s = 30.0
            hold_at_most_s = 120.0
            origin_tolerance_m = 5.0
        ";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tolerance_that_could_hide_a_border_is_refused() {
        for good in [0.1, 5.0, 10.0] {
            assert_eq!(OriginTolerance::try_from(good).map(OriginTolerance::get), Ok(good));
        }
        for bad in [0.0, 0.09, 10.1, -5.0, f64::INFINITY] {
            let expected = format!("found {bad}, expected metres from 0.1 to 10");
            assert_eq!(OriginTolerance::try_from(bad), Err(expected));
        }
        assert!(OriginTolerance::try_from(f64::NAN).is_err());
    }
}
