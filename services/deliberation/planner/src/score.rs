//! How near a back-propagated state is to the start.

use domain::state::{State, Tolerance};

/// A lower score is nearer. The place counts first, then whether the vehicle is in the air, because only flying changes
/// the place. The height counts last.
pub(crate) type Score = (u64, bool, u64);

/// How near `state` comes to `start`.
pub(crate) fn score(state: &State, start: &State, tolerance: Tolerance) -> Score {
    let millimetres = |metres: f64| (metres.abs() * 1e3).round() as u64;
    let apart_m = state.position.horizontal_distance_m(start.position);
    let over_ground = if state.is_over(start, tolerance) { 0 } else { millimetres(apart_m) };
    let height = millimetres(state.position.height_m() - start.position.height_m());
    (over_ground, state.flying != start.flying, height)
}
