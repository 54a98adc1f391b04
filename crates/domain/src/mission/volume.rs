//! The volume that a mission is flown in: an outline and a ceiling, beyond which nothing is flown.
//!
//! It is turned into keep-out areas: one beyond each side, and one above the ceiling. Everything that respects areas therefore respects it by the
//! same rule: the planner, the mission manager's prediction of the stopping point, the responses, and the oracle.

use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use super::{Checker, HIGHEST_M};
use crate::area::{Area, AreaKind};
use crate::geometry::Ned;

/// How far beyond a side nothing is flown, in metres. (ENG: a minute at the greatest speed; the rows bring a vehicle back within seconds.)
const REACH_M: f64 = 1000.0;
/// The most corners of an outline.
const MOST_CORNERS: usize = 20;

/// `[volume]` of a mission file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct VolumeEntry {
    /// `[north, east]` each.
    corners_m: Option<Spanned<Vec<[f64; 2]>>>,
    /// `[latitude, longitude]` each, instead.
    corners_deg: Option<Spanned<Vec<[f64; 2]>>>,
    /// Above the take-off point.
    ceiling_m: Option<Spanned<f64>>,
}

impl Checker<'_> {
    /// The areas that keep the vehicle inside, each with where it stands in the file.
    pub(super) fn volume(&mut self, entry: &Spanned<VolumeEntry>) -> Vec<(Range<usize>, Area)> {
        let it = entry.as_ref();
        let span = it.corners_m.as_ref().or(it.corners_deg.as_ref()).map_or(entry.span(), Spanned::span);
        let Some(corners) = self.corners(&it.corners_m, &it.corners_deg, "the volume", span.clone()) else {
            return Vec::new();
        };
        let inside = keep_out("volume, ceiling".to_owned(), corners, None);
        let count = inside.corners.len();
        let is_sound = inside.corners.iter().all(|it| it.is_sound());
        let Some(turn) = turn(&inside.corners).filter(|_| is_sound && count <= MOST_CORNERS && inside.is_simple())
        else {
            let message = format!("the volume has {count} corners that do not make a convex outline");
            self.say(Some(span), message, "list 3 to 20 corners in order round it; what juts in is a keep-out area");
            return Vec::new();
        };
        let mut areas: Vec<_> =
            beyond_sides(&inside.corners, turn).into_iter().map(|area| (span.clone(), area)).collect();
        if let Some(ceiling) = &it.ceiling_m {
            let floor_m = Some(self.within("ceiling_m", ceiling, 1.0, HIGHEST_M));
            areas.push((ceiling.span(), Area { floor_m, ..inside }));
        }
        areas
    }
}

fn keep_out(name: String, corners: Vec<Ned>, floor_m: Option<f64>) -> Area {
    Area {
        name,
        kind: AreaKind::KeepOut,
        corners,
        floor_m,
        ceiling_m: None,
        from_utc_ms: None,
        until_utc_ms: None,
        hours: None,
    }
}

/// Which way an outline turns.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Turn {
    Clockwise,
    Anticlockwise,
}

/// Which way it turns at every corner, seen from above; `None` if it does both, or goes straight on somewhere.
fn turn(corners: &[Ned]) -> Option<Turn> {
    let at = |index: usize| corners[index % corners.len()];
    let mut turns = (0..corners.len()).map(|index| {
        let (a, b, c) = (at(index), at(index + 1), at(index + 2));
        let area = (b.north_m - a.north_m) * (c.east_m - b.east_m) - (b.east_m - a.east_m) * (c.north_m - b.north_m);
        match area {
            _ if 0.0 < area => Some(Turn::Clockwise),
            _ if area < 0.0 => Some(Turn::Anticlockwise),
            _ => None,
        }
    });
    let first = turns.next()??;
    turns.all(|it| it == Some(first)).then_some(first)
}

/// A rectangle beyond each side, long enough to overlap its neighbours.
fn beyond_sides(corners: &[Ned], turn: Turn) -> Vec<Area> {
    let outward_m = match turn {
        Turn::Clockwise => -REACH_M,
        Turn::Anticlockwise => REACH_M,
    };
    let side = |index: usize| {
        let (a, b) = (corners[index], corners[(index + 1) % corners.len()]);
        let length_m = a.horizontal_distance_m(b);
        let (north, east) = ((b.north_m - a.north_m) / length_m, (b.east_m - a.east_m) / length_m);
        let beside = |from: Ned, along_m: f64, right_m: f64| {
            Ned::new(
                from.north_m + north * along_m - east * right_m,
                from.east_m + east * along_m + north * right_m,
                0.0,
            )
        };
        let (begin, end) = (-REACH_M, REACH_M);
        let rectangle =
            vec![beside(a, begin, 0.0), beside(b, end, 0.0), beside(b, end, outward_m), beside(a, begin, outward_m)];
        keep_out(format!("volume, side {}", index + 1), rectangle, None)
    };
    (0..corners.len()).map(side).collect()
}

#[cfg(test)]
mod tests {
    use crate::file::{Mistakes, Source};
    use crate::geometry::Ned;
    use crate::mission::Mission;
    use crate::testing::check_mistake;

    const GOOD: &str = r#"
name = "inside"
[volume]
corners_m = [[-100.0, -100.0], [-100.0, 600.0], [300.0, 700.0], [300.0, -100.0]]
ceiling_m = 60.0
[[objective]]
name = "there"
north_m = 0.0
east_m = 500.0
height_m = 20.0
flying = true
"#;

    fn read(text: &str) -> Result<Mission, Mistakes> {
        Mission::read(&Source { path: "m.toml".into(), text: text.into() })
    }

    #[test]
    fn every_point_is_inside_the_volume_or_in_an_area_that_is_kept_out_of() {
        let other_way_round = GOOD.replace(
            "[-100.0, 600.0], [300.0, 700.0], [300.0, -100.0]",
            "[300.0, -100.0], [300.0, 700.0], [-100.0, 600.0]",
        );
        for text in [GOOD, &other_way_round] {
            let mission = read(text).unwrap_or_else(|it| panic!("{it}"));
            assert_eq!(mission.areas.len(), 5);
            let is_kept_out = |north_m: f64, east_m: f64, height_m: f64| {
                mission.areas.iter().any(|it| it.contains(Ned::new(north_m, east_m, -height_m)))
            };
            for (north, east) in (-20..=30).flat_map(|north| (-20..=60).map(move |east| (north, east))) {
                let (north_m, east_m) = (f64::from(north) * 20.0 + 7.0, f64::from(east) * 20.0 + 3.0);
                // The side in the east is slanted: 100 m over 400 m.
                let east_side_m = 600.0 + (north_m + 100.0) / 4.0;
                let inside = -100.0 < north_m && north_m < 300.0 && -100.0 < east_m && east_m < east_side_m;
                assert_eq!(is_kept_out(north_m, east_m, 20.0), !inside, "({north_m}, {east_m})");
                assert!(is_kept_out(north_m, east_m, 65.0), "({north_m}, {east_m}) above the ceiling");
            }
        }
    }

    #[test]
    fn a_mistake_is_told_with_its_place() {
        #[track_caller]
        fn check(find: &str, replace: &str, expected: &str) {
            check_mistake(GOOD, find, replace, read, expected);
        }
        check(
            "[300.0, 700.0]",
            "[0.0, 0.0]",
            "m.toml:4:13: the volume has 4 corners that do not make a convex outline",
        );
        check("ceiling_m = 60.0", "ceiling_m = -3.0", "m.toml:5:13: `ceiling_m` is -3, expected metres between");
        check("ceiling_m = 60.0", "floor_m = 3.0", "m.toml:5:1: unknown field `floor_m`");
        check(
            "height_m = 20.0",
            "height_m = 90.0",
            "m.toml:8:11: objective `there` lies in keep-out area `volume, ceiling`",
        );
        check(
            "east_m = 500.0",
            "east_m = 900.0",
            "m.toml:8:11: objective `there` lies in keep-out area `volume, side 2`",
        );
        check("[[-100.0, -100.0]", "[[-100.0, 105.0]", "m.toml:4:13: the take-off point lies");
    }
}
