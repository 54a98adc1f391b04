//! Where a mission begins, what it flies to and where it may end, against the areas that always apply.
//!
//! An area with a time window or hours is left to those who know the time: the planner, and the mission manager for an ordered place.

use crate::area::{Area, AreaKind};
use crate::geometry::Ned;
use crate::known_ground::AROUND_M;

/// Nearer than this to a border no place to fly to or to stand on may lie, in metres: wind would carry the vehicle over it.
/// (The mission manager's `margin_m` and the planner's margin in `config/kittiwake.toml`.)
const MARGIN_M: f64 = 10.0;
/// For how long wind carries a vehicle before it is brought back, in seconds. (JARUS SORA, sizing of the contingency
/// volume: a reaction without a pilot takes one second.)
const REACTION_S: f64 = 1.0;
/// From a place on the ground the vehicle climbs this high at least, in metres. (The planner's `takeoff_height_m`.)
const CLIMB_M: f64 = 10.0;

/// The highest that the vehicle flies, above the take-off point, in metres: what no response may fly over, no plan needs to
/// fly at. (The mission manager's and the planner's `highest_m`.)
const HIGHEST_FLIGHT_M: f64 = 120.0;

/// The lowest ground that a mission lands on, above the take-off point, in metres: as far below it as the highest ground is above it.
pub(super) const LOWEST_GROUND_M: f64 = CLIMB_M - HIGHEST_FLIGHT_M;

/// Two places on the ground whose heights differ by more are not one, in metres. (The planner's `ground_tolerance_m`.)
const LEVEL_M: f64 = 5.0;

/// Why there is no ground for `place`, or no air, if one of `others` nearby says how high the ground is; the end of a sentence that begins with
/// the place.
pub(super) fn against_ground(place: Place, others: &[(String, Ned)]) -> Option<String> {
    let height_m = place.position.height_m();
    let away_m = |it: &Ned| it.horizontal_distance_m(place.position);
    // The nearest place says how high the ground is.
    let nearest = others.iter().min_by(|a, b| away_m(&a.1).total_cmp(&away_m(&b.1))).filter(|_| place.flying);
    let near = others.iter().filter(|(_, it)| !place.flying && away_m(it) <= MARGIN_M);
    let over = nearest.into_iter().filter(|(_, it)| away_m(it) <= AROUND_M);
    near.chain(over).find_map(|(name, other)| {
        let (away_m, ground_m) = (away_m(other), other.height_m() + 0.0);
        let is_wrong = if place.flying { height_m <= ground_m } else { LEVEL_M < (height_m - ground_m).abs() };
        let verb = if place.flying { "flies" } else { "lies" };
        is_wrong.then(|| {
            format!(
                "{verb} at height {height_m} m, and the ground {away_m:.0} m from there, at {name}, at {ground_m} m"
            )
        })
    })
}

/// The greatest height of such an objective, if it is higher: one on the ground is left by a climb.
pub(super) fn too_high(height_m: f64, flying: bool) -> Option<f64> {
    let most_m = if flying { HIGHEST_FLIGHT_M } else { HIGHEST_FLIGHT_M - CLIMB_M };
    Some(most_m).filter(|most_m| *most_m < height_m)
}

/// A place that a mission uses.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// Where.
    pub(super) position: Ned,
    /// In the air or on the ground.
    pub(super) flying: bool,
    /// The mission begins or ends there.
    pub(super) is_end: bool,
}

impl Place {
    /// On the ground, to end a flight at.
    pub(super) fn to_end_at(position: Ned) -> Place {
        Place { position, flying: false, is_end: true }
    }
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

/// What is wrong with a place because of one area, in words.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Unfit {
    problem: SiteProblem,
    area: String,
    /// The area is one that may not be landed in.
    only_bars_landings: bool,
    /// The area has no time window and no hours.
    always: bool,
    /// The area begins this high above a place on the ground, so that only the climb from there, or the descent to it, is in it.
    begins_m: Option<f64>,
}

impl Unfit {
    /// As the end of a sentence that begins with the place.
    pub(super) fn in_words(&self) -> String {
        let Unfit { problem, area, only_bars_landings, always, begins_m } = self;
        let climb = begins_m.map_or_else(String::new, |begins_m| {
            format!("; the area begins {begins_m:.1} m above the place, and a takeoff or a landing there flies up to {CLIMB_M:.0} m")
        });
        match problem {
            SiteProblem::KeptOut => {
                let when = if *always { "always applies" } else { "applies then" };
                let kind = if *only_bars_landings { "no-landing" } else { "keep-out" };
                format!("lies in {kind} area `{area}`, which {when}{climb}")
            }
            SiteProblem::TooNear { distance_m } => {
                format!(
                    "lies {distance_m:.1} m from the border of area `{area}`, expected at least {MARGIN_M:.0} m{climb}"
                )
            }
        }
    }

    /// What to do about it.
    pub(super) fn help(&self) -> &'static str {
        match self.problem {
            SiteProblem::KeptOut if self.only_bars_landings => {
                "nothing comes down in such an area: move the place, or leave it out"
            }
            SiteProblem::KeptOut => "a mission begins and ends outside of keep-out areas",
            SiteProblem::TooNear { .. } => "move the place or the border: wind may carry the vehicle over it",
        }
    }
}

/// How near `site` lies to `area`, in metres, if that is nearer than the margin and what a wind of `wind_m_s` adds to it.
pub(super) fn too_near_in_wind(site: Place, area: &Area, wind_m_s: f64) -> Option<TooNearInWind> {
    let expected_m = MARGIN_M + wind_m_s * REACTION_S;
    // A cheap check that settles most of what many places and areas make together.
    if area.is_beyond(expected_m, site.position, site.position) || !is_at_heights_of(site, area) {
        return None;
    }
    let ground = Area { floor_m: None, ceiling_m: None, ..area.clone() };
    if ground.contains(site.position) {
        return None;
    }
    let distance_m = area.distance_to_border_m(site.position);
    (distance_m < expected_m).then_some(TooNearInWind { distance_m, expected_m })
}

/// A place that is fit in calm air, and nearer to a border than it should be in wind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TooNearInWind {
    /// In metres.
    pub(super) distance_m: f64,
    /// The margin and what the wind adds to it, in metres.
    pub(super) expected_m: f64,
}

/// Whether the vehicle is at heights of `area` when it is at `site`, or lifts off there.
fn is_at_heights_of(site: Place, area: &Area) -> bool {
    let height_m = site.position.height_m();
    let highest_m = if site.flying { height_m } else { height_m + CLIMB_M };
    area.touches_heights(height_m, highest_m)
}

/// What is wrong with `site` because of `area`, if that applies when the site is used.
pub(super) fn unfit(site: Place, area: &Area) -> Option<Unfit> {
    if area.is_beyond(MARGIN_M, site.position, site.position) || !is_at_heights_of(site, area) {
        return None;
    }
    let begins_m = area.floor_m.map(|floor_m| floor_m - site.position.height_m()).filter(|it| 0.0 < *it);
    let (name, always) = (area.name.clone(), area.always_applies());
    let because_of =
        |problem| Some(Unfit { problem, area: name, only_bars_landings: area.only_bars_landings(), always, begins_m });
    let ground = Area { floor_m: None, ceiling_m: None, ..area.clone() };
    if ground.contains(site.position) {
        let is_closed = area.kind == AreaKind::KeepOut && site.is_end;
        return if is_closed { because_of(SiteProblem::KeptOut) } else { None };
    }
    let distance_m = area.distance_to_border_m(site.position);
    if distance_m < MARGIN_M { because_of(SiteProblem::TooNear { distance_m }) } else { None }
}
