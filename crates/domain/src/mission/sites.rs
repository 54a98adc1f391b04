//! Where a mission begins, what it flies to and where it ends, against the areas that always apply.
//!
//! An area with a time window is left to the planner, which knows the time.

use crate::area::{Area, AreaKind};
use crate::geometry::Ned;

/// Nearer than this to a border no place to fly to or to stand on may lie, in metres: wind would carry the vehicle over it.
/// (The mission manager's `margin_m` and the planner's margin in `config/kittiwake.toml`.)
const MARGIN_M: f64 = 10.0;
/// From a place on the ground the vehicle climbs this high at least, in metres. (The planner's `takeoff_height_m`.)
const CLIMB_M: f64 = 10.0;

/// A place that a mission uses.
#[derive(Debug, Clone, Copy)]
pub(super) struct Site {
    /// Where.
    pub(super) position: Ned,
    /// In the air or on the ground.
    pub(super) flying: bool,
    /// The mission begins or ends there.
    pub(super) is_end: bool,
}

/// What is wrong with a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum SiteProblem {
    /// It lies inside a keep-out area, and the mission begins or ends there.
    KeptOut,
    /// It lies outside of an area, this near to its border.
    TooNear {
        /// In metres.
        distance_m: f64,
    },
}

impl SiteProblem {
    /// As the end of a sentence that begins with the place.
    pub(super) fn in_words(self, area: &str) -> String {
        match self {
            SiteProblem::KeptOut => format!("lies in keep-out area `{area}`, which always applies"),
            SiteProblem::TooNear { distance_m } => {
                format!("lies {distance_m:.1} m from the border of area `{area}`, expected at least {MARGIN_M:.0} m")
            }
        }
    }

    /// What to do about it.
    pub(super) fn help(self) -> &'static str {
        match self {
            SiteProblem::KeptOut => "a mission begins and ends outside of keep-out areas",
            SiteProblem::TooNear { .. } => "move the place or the border: wind may carry the vehicle over it",
        }
    }
}

/// What is wrong with `site` because of `area`.
pub(super) fn problem(site: Site, area: &Area) -> Option<SiteProblem> {
    let height_m = site.position.height_m();
    let highest_m = if site.flying { height_m } else { height_m + CLIMB_M };
    let always_applies = area.from_utc_ms.is_none() && area.until_utc_ms.is_none();
    if !always_applies || !area.is_simple() || !area.touches_heights(height_m, highest_m) {
        return None;
    }
    let ground = Area { floor_m: None, ceiling_m: None, ..area.clone() };
    if ground.contains(site.position) {
        let is_closed = area.kind == AreaKind::KeepOut && site.is_end;
        return is_closed.then_some(SiteProblem::KeptOut);
    }
    let distance_m = area.distance_to_border_m(site.position);
    (distance_m < MARGIN_M).then_some(SiteProblem::TooNear { distance_m })
}
