//! Places to land at: those of the mission, and those beside a blocked one.

use std::f64::consts::TAU;

use domain::geometry::Ned;
use domain::site::{MOST_SITES, Site};

use super::World;

/// A place nearer than this to a failed landing counts as the same place.
pub(super) const SAME_SITE_M: f64 = 20.0;
/// Where the only landing site is blocked, a landing is tried this far beside it, in [`DIRECTIONS`]. (ENG: beyond what
/// counts as the same place.)
const ASIDE_M: [f64; 3] = [30.0, 60.0, 90.0];
const DIRECTIONS: u32 = 8;

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
        let on_ground = aside(here).map(|it| it.at_height(self.planner.mission.ground.height_m(it)));
        on_ground.filter(is_fit).collect()
    }

    pub(super) fn mission_sites(&self) -> &[Site] {
        let sites = &self.planner.mission.status.sites;
        &sites[..sites.len().min(MOST_SITES)]
    }

    pub(crate) fn landing_site(&self) -> Option<Ned> {
        self.people.operator.landing_site
    }
}
