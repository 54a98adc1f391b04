//! How high the ground is where that is known, and how high the vehicle is over it: the one rule for plans, responses, alternates and
//! checks.
//!
//! Known are places: the take-off point, what a mission lands at, and where the vehicle was seen to stand. Of the ground between them
//! nothing is known but that it is taken to be no higher than the take-off point.

use std::time::Duration;

use crate::airspace::{Airspace, STRAIGHT_UP_M};
use crate::area::Area;
use crate::geometry::Ned;
use crate::site::Site;
use crate::way::FlightLimits;

/// A place says how high the ground is as far as this around it, in metres. (ENG: a deck, a roof or a clearing, and the drift in wind.)
pub const AROUND_M: f64 = 50.0;
/// Two heights that differ by no more than this are the same, in metres: what an estimate and a gust leave of a height that is held.
const SAME_HEIGHT_M: f64 = 1.0;
/// Two places nearer to each other than this are one, in metres: what an estimate of a vehicle at rest wanders.
const SAME_PLACE_M: f64 = 10.0;
/// The latest measured places, up to this number, are remembered: a flight lands at few, and an estimate that drifts makes more of one.
const MOST_MEASURED: usize = 16;

/// Nothing is known but the take-off point.
pub static LEVEL: KnownGround = KnownGround { named: Vec::new(), measured: Vec::new() };

/// The heights of places on the ground.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct KnownGround {
    /// As a mission says it; but for the take-off point, which is where heights are counted from.
    named: Vec<Ned>,
    /// Where the vehicle was seen to stand.
    measured: Vec<Ned>,
}

impl KnownGround {
    /// As a mission says it: its sites, and its objectives on the ground.
    pub fn of(sites: &[Site], on_ground: impl IntoIterator<Item = Ned>) -> KnownGround {
        let mut ground = KnownGround::default();
        ground.name(sites, on_ground);
        ground
    }

    /// The mission is another one, or has other places.
    pub fn name(&mut self, sites: &[Site], on_ground: impl IntoIterator<Item = Ned>) {
        self.named = sites.iter().map(|it| it.position).chain(on_ground).collect();
    }

    /// The vehicle stands there.
    pub fn measure(&mut self, place: Ned) {
        let is_known = |it: Ned| {
            it.horizontal_distance_m(place) <= SAME_PLACE_M && (it.height_m() - place.height_m()).abs() <= SAME_HEIGHT_M
        };
        if !self.places().any(is_known) {
            self.measured.truncate(MOST_MEASURED - 1);
            self.measured.insert(0, place);
        }
    }

    fn places(&self) -> impl Iterator<Item = Ned> {
        std::iter::once(Ned::default()).chain(self.named.iter().chain(&self.measured).copied())
    }

    /// How high the ground is at `at`, above the take-off point: as high as the nearest place around.
    pub fn height_m(&self, at: Ned) -> f64 {
        let around = self.places().map(|it| (it.horizontal_distance_m(at), it.height_m()));
        let nearest = around.filter(|it| it.0 <= AROUND_M).min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.map_or(0.0, |it| it.1)
    }

    /// The ground over which the straight way from `from` to `to` leads too low. `named` is a place in flight that somebody has named the
    /// height of: around it, and over ground of which nothing is known, the vehicle may be as low. Straight up and straight down is never
    /// too low: that is how ground is left and reached.
    pub(crate) fn hills<'a>(
        &'a self,
        (from, to): (Ned, Ned),
        named: Option<Ned>,
        limits: &'a FlightLimits,
    ) -> impl Iterator<Item = Hill> + use<'a> {
        let lowest_m = from.height_m().min(to.height_m()) + SAME_HEIGHT_M;
        let leads_over_ground = STRAIGHT_UP_M < from.horizontal_distance_m(to);
        let hill = move |place: Ned, at: Option<Ned>| {
            let (ground_m, clear_m) = (place.height_m(), place.height_m() + limits.least_height_m);
            let is_near = |named: &Ned| at.is_none_or(|it| it.horizontal_distance_m(*named) <= AROUND_M);
            let named_m = named.filter(is_near).map(Ned::height_m).filter(|it| ground_m < *it);
            Hill { at, clear_m: named_m.map_or(clear_m, |it| it.min(clear_m)) }
        };
        let known = self.places().map(move |it| hill(it, Some(it)));
        let is_all_known =
            move || self.places().any(|it| [from, to].iter().all(|end| it.horizontal_distance_m(*end) <= AROUND_M));
        let unknown = std::iter::once(hill(Ned::default(), None));
        let is_on_way = move |it: &Hill| match it.at {
            Some(at) => aside_m(at, from, to) <= AROUND_M,
            None => !is_all_known(),
        };
        known.chain(unknown).filter(move |it| leads_over_ground && lowest_m < it.clear_m && is_on_way(it))
    }

    /// How high the vehicle must be to fly on from `at`, in metres above the take-off point.
    pub fn clear_m(&self, at: Ned, limits: &FlightLimits) -> f64 {
        let around = self.places().filter(|it| it.horizontal_distance_m(at) <= AROUND_M).map(Ned::height_m);
        around.reduce(f64::max).unwrap_or(0.0) + limits.least_height_m
    }

    /// Why the straight way from one place to another, which is named, is too low, if it is.
    pub fn why_too_low(&self, leg: (Ned, Ned), limits: &FlightLimits) -> Option<String> {
        let highest = self.hills(leg, Some(leg.1), limits).max_by(|a, b| a.clear_m.total_cmp(&b.clear_m))?;
        let (lowest_m, clear_m) = (leg.0.height_m().min(leg.1.height_m()), highest.clear_m);
        let over = highest.at.map_or_else(String::new, |at| format!(" over the ground at {at}"));
        Some(format!("its way would be {lowest_m:.0} m high{over}, expected at least {clear_m:.0} m"))
    }

    /// The height at which a flight from `from` comes to `place`, to land there, in metres above the take-off point: never lower than
    /// it is, and over the place by the height of returns, or by less where that is near.
    pub fn approach_m(&self, from: Ned, place: Ned, limits: &FlightLimits) -> f64 {
        let FlightLimits { least_height_m, return_height_m, highest_m, .. } = *limits;
        let over_m = from.horizontal_distance_m(place).min(return_height_m).max(least_height_m);
        let above_place_m = (place.height_m() + over_m).min(highest_m).max(place.height_m() + least_height_m);
        above_place_m.max(self.clear_m(from, limits)).max(from.height_m())
    }
}

/// How far above `place`, on the ground, a takeoff ends and a landing begins, in metres: `usual_m`, or less where an area that may not be
/// entered now has its floor there; but clear of the ground.
pub fn climb_m(place: Ned, usual_m: f64, airspace: &Airspace<'_>, limits: &FlightLimits) -> f64 {
    let ground_m = place.height_m();
    let is_barred = |it: &&Area| airspace.bars(it, Duration::ZERO, Duration::ZERO).is_some() && it.covers(place);
    let floors = airspace.areas.iter().filter(is_barred).filter_map(|it| it.floor_m);
    let in_the_way = floors.filter(|it| ground_m < *it && *it <= ground_m + usual_m + airspace.vertical_margin_m);
    let under = in_the_way.map(|it| it - airspace.vertical_margin_m - limits.height_clearance_m - ground_m);
    let under_m = under.fold(usual_m, f64::min);
    if limits.least_height_m <= under_m { under_m } else { usual_m }
}

/// Ground that is too high for a way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hill {
    /// Around this place; `None`: wherever nothing is known.
    pub(crate) at: Option<Ned>,
    /// A way over it is high enough from this height on, in metres above the take-off point.
    pub(crate) clear_m: f64,
}

/// How far `place` lies from the straight way from `from` to `to`, over ground.
fn aside_m(place: Ned, from: Ned, to: Ned) -> f64 {
    let (north_m, east_m) = (to.north_m - from.north_m, to.east_m - from.east_m);
    let along = (place.north_m - from.north_m) * north_m + (place.east_m - from.east_m) * east_m;
    let length_m = north_m.hypot(east_m);
    let fraction = if 0.0 < length_m { (along / (length_m * length_m)).clamp(0.0, 1.0) } else { 0.0 };
    place.horizontal_distance_m(from.towards(to, fraction))
}

#[cfg(test)]
mod tests;
