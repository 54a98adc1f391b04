//! The state the planner reasons about: where the vehicle is, whether it flies, in which mode, and
//! what it may enter.

use std::collections::BTreeSet;

use domain::geometry::Ned;
use domain::wire::Senseless;
use kittiwake_proto::v1;

use crate::config::Config;

/// A state to start from or to reach.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Where.
    pub position: Ned,
    /// In the air or on the ground.
    pub flying: bool,
    /// The flight mode; `None` where a state to reach does not ask for one.
    pub mode: Option<v1::FlightMode>,
    /// Areas whose permission is held, or needed, there.
    pub permissions: BTreeSet<String>,
}

/// How near a back-propagated state comes to the start; less is nearer. Place goes before being in
/// the air, for only flying changes the place; height comes last.
pub type Score = (u64, bool, u64);

impl State {
    /// A state to reach, whatever the mode.
    pub fn new(position: Ned, flying: bool) -> State {
        State { position, flying, mode: None, permissions: BTreeSet::new() }
    }

    /// Whether this state is `other` within the stated tolerance. On the ground the height is what
    /// the ground makes it, so it is not compared.
    pub fn matches(&self, other: &State, config: &Config) -> bool {
        let apart_m = (self.position.height_m() - other.position.height_m()).abs();
        self.flying == other.flying
            && self.is_over(other, config)
            && (!self.flying || apart_m <= config.vertical_tolerance_m.get())
            && other.mode.is_none_or(|it| self.mode == Some(it))
    }

    /// Whether both are over the same spot within the tolerance.
    pub fn is_over(&self, other: &State, config: &Config) -> bool {
        self.position.horizontal_distance_m(other.position) <= config.horizontal_tolerance_m.get()
    }

    /// How near this state comes to `start`.
    pub fn score(&self, start: &State, config: &Config) -> Score {
        let millimetres = |metres: f64| (metres.abs() * 1e3).round() as u64;
        let apart_m = self.position.horizontal_distance_m(start.position);
        let over_ground = if self.is_over(start, config) { 0 } else { millimetres(apart_m) };
        let height = millimetres(self.position.height_m() - start.position.height_m());
        (over_ground, self.flying != start.flying, height)
    }
}

impl TryFrom<v1::PlanningState> for State {
    type Error = Senseless;
    fn try_from(it: v1::PlanningState) -> Result<State, Senseless> {
        Ok(State {
            mode: Some(it.mode()).filter(|mode| *mode != v1::FlightMode::Unspecified),
            position: it.position.ok_or(Senseless::Missing("position"))?.try_into()?,
            flying: it.flying,
            permissions: it.permissions.into_iter().collect(),
        })
    }
}

impl From<&State> for v1::PlanningState {
    fn from(it: &State) -> v1::PlanningState {
        v1::PlanningState {
            position: Some(it.position.into()),
            flying: it.flying,
            mode: it.mode.unwrap_or_default() as i32,
            permissions: it.permissions.iter().cloned().collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_match_within_the_tolerance() {
        #[track_caller]
        fn check(a: (f64, f64, bool), b: (f64, f64, bool), expected: bool) {
            let state = |(east, height, flying): (f64, f64, bool)| State::new(Ned::new(0.0, east, -height), flying);
            assert_eq!(state(a).matches(&state(b), &Config::for_tests()), expected, "{a:?} {b:?}");
        }
        check((0.0, 10.0, true), (2.9, 11.9, true), true);
        check((0.0, 10.0, true), (3.1, 10.0, true), false);
        check((0.0, 10.0, true), (0.0, 12.1, true), false);
        check((0.0, 0.0, false), (0.0, 0.0, true), false);
        // Where the ground is, is not the objective's to say.
        check((0.0, 7.0, false), (0.0, 0.0, false), true);
    }

    #[test]
    fn a_state_without_a_sound_position_is_senseless() {
        #[track_caller]
        fn check(position: Option<v1::Ned>) {
            assert!(State::try_from(v1::PlanningState { position, ..Default::default() }).is_err());
        }
        check(None);
        check(Some(v1::Ned { north_m: f64::NAN, ..Default::default() }));
    }
}
