//! The shortest way out of an area that the vehicle is in without permission.

use std::f64::consts::TAU;

use domain::geometry::Ned;
use geo::{Closest, ClosestPoint};

use crate::airspace::{Airspace, Asked};
use crate::config::Config;

/// Directions that are tried in addition to the shortest one to each side: in a corner between two
/// areas no direction to a side may work.
const DIRECTIONS: u32 = 32;

/// The nearest point, level with `from`, that is a stand-off outside of every barred area (half of
/// it where there is no more room) and to which the straight way enters none but those it leaves.
pub fn way_out(from: Ned, airspace: &Airspace, asked: &Asked, config: &Config) -> Option<Ned> {
    [config.stand_off_m.get(), config.stand_off_m.get() / 2.0].into_iter().find_map(|clearance_m| {
        let outside = |it: &Ned| {
            airspace.trespassed(*it, asked).is_empty() && airspace.first_entries(from, *it, asked).is_empty()
        };
        let ways = directions(from, airspace, asked).into_iter();
        ways.filter_map(|it| exit_along(from, it, clearance_m, airspace, asked))
            .filter(outside)
            .min_by(|a, b| from.distance_m(*a).total_cmp(&from.distance_m(*b)))
    })
}

/// Unit vectors `(north, east)`: square to each side, then all round.
fn directions(from: Ned, airspace: &Airspace, asked: &Asked) -> Vec<(f64, f64)> {
    let here = geo::Point::new(from.east_m, from.north_m);
    let trespassed = airspace.trespassed(from, asked);
    let sides = trespassed.iter().flat_map(|it| it.area.polygon().exterior().lines().collect::<Vec<_>>());
    let square = sides.filter_map(|side| match side.closest_point(&here) {
        Closest::SinglePoint(it) | Closest::Intersection(it) => {
            let (north_m, east_m) = (it.y() - from.north_m, it.x() - from.east_m);
            let length_m = north_m.hypot(east_m);
            (length_m > 0.0).then(|| (north_m / length_m, east_m / length_m))
        }
        Closest::Indeterminate => None,
    });
    let all_round = (0..DIRECTIONS).map(|it| (TAU * f64::from(it) / f64::from(DIRECTIONS)).sin_cos());
    square.chain(all_round).collect()
}

/// `clearance_m` beyond where the ray first leaves all barred areas.
fn exit_along(from: Ned, direction: (f64, f64), clearance_m: f64, airspace: &Airspace, asked: &Asked) -> Option<Ned> {
    /// A point this far beyond a border counts as outside, in metres.
    const BEYOND_M: f64 = 1e-3;
    let along = |distance_m: f64| {
        Ned::new(from.north_m + direction.0 * distance_m, from.east_m + direction.1 * distance_m, from.down_m)
    };
    let corners = airspace.barred(asked).flat_map(|(_, it)| it.area.corners.iter());
    let reach_m = corners.map(|it| it.horizontal_distance_m(from)).fold(0.0, f64::max) + clearance_m;
    let mut borders_m: Vec<f64> = airspace
        .barred(asked)
        .flat_map(|(_, it)| it.area.crossings(from, along(reach_m)))
        .map(|fraction| fraction * reach_m)
        .collect();
    borders_m.sort_by(f64::total_cmp);
    let exit_m = borders_m.into_iter().find(|it| airspace.trespassed(along(it + BEYOND_M), asked).is_empty())?;
    Some(along(exit_m + clearance_m))
}
