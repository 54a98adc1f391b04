//! Places to land at: those of the mission, and those beside a blocked one.

use std::f64::consts::TAU;

use domain::geometry::Ned;
use domain::site::{MOST_SITES, Site};

use super::World;

/// A place nearer than this to a failed landing counts as the same place.
pub(super) const SAME_SITE_M: f64 = 20.0;
/// Where the only landing site is blocked, a landing is tried this far beside it, in so many directions. (ENG: beyond what counts as
/// the same place.)
const ASIDE_M: [f64; 3] = [30.0, 60.0, 90.0];
const DIRECTIONS: u32 = 8;
/// The height of a landing site nearer than this counts for the least height of a flight.
const NEAR_SITE_M: f64 = 50.0;

/// Places all round `here`, near ones first.
fn aside(here: Ned) -> impl Iterator<Item = Ned> {
    let place = move |distance_m: f64, direction: u32| {
        let (east, north) = (TAU * f64::from(direction) / f64::from(DIRECTIONS)).sin_cos();
        Ned::new(here.north_m + distance_m * north, here.east_m + distance_m * east, 0.0)
    };
    ASIDE_M.into_iter().flat_map(move |distance_m| (0..DIRECTIONS).map(move |it| place(distance_m, it)))
}

impl World {
    /// A landing at the vehicle's place did not come down.
    pub(crate) fn landing_failed_here(&mut self) {
        if let Some(vehicle) = &self.seen.vehicle {
            self.landings.blocked_sites.push(vehicle.position);
        }
    }

    /// How many landings have failed at `place`.
    pub(super) fn failed_landings_at(&self, place: Ned) -> u32 {
        let is_there = |it: &&Ned| it.horizontal_distance_m(place) < SAME_SITE_M;
        self.landings.blocked_sites.iter().filter(is_there).count() as u32
    }

    /// Where a landing has failed `here`: places beside it, near ones first, at which none has, and where one is allowed. To hover
    /// over a blocked place ends with the battery.
    pub(super) fn places_beside(&self, here: Ned) -> Vec<Ned> {
        if self.failed_landings_at(here) == 0 {
            return Vec::new();
        }
        let is_fit = |it: &Ned| self.failed_landings_at(*it) == 0 && self.unfit_to_land(*it).is_none();
        aside(here).filter(is_fit).collect()
    }

    /// The height at which a response flies home or to another place to land at: that of returns, or higher where the vehicle is higher.
    pub(crate) fn transit_height_m(&self, here: Ned) -> f64 {
        self.clear_height_m(here).max(self.setup.limits.return_height_m)
    }

    /// The height to fly at from `here`: the present one, or more where that is low over the origin or a landing site.
    pub(crate) fn clear_height_m(&self, here: Ned) -> f64 {
        let near = self.sites().filter(|it| it.horizontal_distance_m(here) < NEAR_SITE_M);
        let ground_m = near.map(|it| it.height_m()).fold(0.0, f64::max);
        here.height_m().max(ground_m + self.setup.limits.flight.least_height_m)
    }

    pub(super) fn sites(&self) -> impl Iterator<Item = Ned> {
        let on_ground = self.planner.status().objectives.iter().filter(|it| !it.objective.flying);
        let of_mission = self.mission_sites().iter().map(|it| it.position);
        let of_mission = of_mission.chain(on_ground.map(|it| it.objective.position));
        [Ned::default()].into_iter().chain(self.people.operator.landing_site).chain(of_mission)
    }

    /// The sites of the mission.
    pub(super) fn mission_sites(&self) -> &[Site] {
        let sites = &self.planner.status().sites;
        &sites[..sites.len().min(MOST_SITES)]
    }

    /// The operator's landing site.
    pub(crate) fn landing_site(&self) -> Option<Ned> {
        self.people.operator.landing_site
    }
}
