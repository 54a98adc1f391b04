//! The volume that a mission is flown in: an outline and a ceiling, beyond which nothing is flown.
//!
//! It is turned into keep-out areas: one round the outline as far as areas reach, with a hole where the mission is flown, and one above
//! the ceiling. A vehicle outside is in there, so its nearest border leads in.
//! Everything that respects areas therefore respects it by the same rule: the planner, the mission manager's prediction of the
//! stopping point, the responses, and the oracle.

use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use super::{Checker, HIGHEST_M};
use crate::area::{AREAS_END_M, Area, AreaKind};
use crate::geometry::Ned;

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

impl VolumeEntry {
    pub(super) fn corner_count(&self) -> usize {
        self.corners_m.as_ref().or(self.corners_deg.as_ref()).map_or(0, |it| it.as_ref().len())
    }
}

impl Checker<'_> {
    /// The areas that keep the vehicle inside, each with where it stands in the file.
    pub(super) fn volume(&mut self, entry: &Spanned<VolumeEntry>) -> Vec<(Range<usize>, Area)> {
        let it = entry.as_ref();
        let span = it.corners_m.as_ref().or(it.corners_deg.as_ref()).map_or(entry.span(), Spanned::span);
        let Some(corners) = self.corners(&it.corners_m, &it.corners_deg, "the volume", span.clone()) else {
            return Vec::new();
        };
        let inside = Area::new("volume, ceiling", AreaKind::KeepOut, corners);
        if !self.rings(&inside, "the volume", std::slice::from_ref(&span)) {
            return Vec::new();
        }
        let is_in_reach = |it: &Ned| it.north_m.abs().max(it.east_m.abs()) < AREAS_END_M;
        if !inside.corners.iter().all(is_in_reach) {
            let help = "every corner lies less than 140 km north, south, east and west of the take-off point";
            self.say(Some(span), "the volume has a corner out of range".to_owned(), help);
            return Vec::new();
        }
        let holes = vec![inside.corners.clone()];
        let mut areas = vec![(span, Area { holes, ..Area::new("volume", AreaKind::KeepOut, all_around()) })];
        if let Some(ceiling) = &it.ceiling_m {
            let floor_m = Some(self.within("ceiling_m", ceiling, 1.0, HIGHEST_M));
            areas.push((ceiling.span(), Area { floor_m, ..inside }));
        }
        areas
    }
}

/// The corners of the square in which areas lie.
fn all_around() -> Vec<Ned> {
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(north, east)| Ned::new(north * AREAS_END_M, east * AREAS_END_M, 0.0))
        .to_vec()
}

#[cfg(test)]
mod tests {
    use crate::airspace::Grants;
    use crate::airspace::tests::airspace;
    use crate::file::{Mistakes, Source};
    use crate::geometry::Ned;
    use crate::mission::Mission;
    use crate::testing::check_mistake;
    use crate::way::tests::LIMITS;
    use crate::way::way_out;

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

    /// An outline that juts in from the east.
    const CORNERS: &str = "[-100.0, -100.0], [-100.0, 600.0], [100.0, 200.0], [300.0, 700.0], [300.0, -100.0]";

    #[test]
    fn every_point_is_inside_the_volume_or_in_an_area_that_is_kept_out_of() {
        let other_way_round = "[-100.0, -100.0], [300.0, -100.0], [300.0, 700.0], [100.0, 200.0], [-100.0, 600.0]";
        for corners in [CORNERS, other_way_round] {
            let text = GOOD.replace("[-100.0, -100.0], [-100.0, 600.0], [300.0, 700.0], [300.0, -100.0]", corners);
            let text = text.replace("east_m = 500.0", "east_m = 150.0");
            let mission = read(&text).unwrap_or_else(|it| panic!("{it}"));
            let names: Vec<_> = mission.areas.iter().map(|it| it.name.as_str()).collect();
            assert_eq!(names, ["volume", "volume, ceiling"]);
            let is_kept_out = |north_m: f64, east_m: f64, height_m: f64| {
                mission.areas.iter().any(|it| it.contains(Ned::new(north_m, east_m, -height_m)))
            };
            for (north, east) in (-50..=60).flat_map(|north| (-50..=80).map(move |east| (north, east))) {
                let (north_m, east_m) = (f64::from(north) * 20.0 + 7.0, f64::from(east) * 20.0 + 3.0);
                // The sides in the east: 400 m back over 200 m, then 500 m out again.
                let east_side_m =
                    if north_m < 100.0 { 600.0 - (north_m + 100.0) * 2.0 } else { 200.0 + (north_m - 100.0) * 2.5 };
                let inside = -100.0 < north_m && north_m < 300.0 && -100.0 < east_m && east_m < east_side_m;
                assert_eq!(is_kept_out(north_m, east_m, 20.0), !inside, "({north_m}, {east_m})");
                assert!(!inside || is_kept_out(north_m, east_m, 65.0), "({north_m}, {east_m}) above the ceiling");
            }
        }
    }

    #[test]
    fn a_vehicle_outside_is_led_back_in_however_far_out() {
        let mission = read(GOOD).unwrap_or_else(|it| panic!("{it}"));
        let grants = Grants::new();
        let airspace = airspace(&mission.areas, &grants);
        for (out, back) in
            [((0.0, -130.0), (0.0, -80.0)), ((0.0, -800.0), (0.0, -80.0)), ((-1_600.0, 0.0), (-80.0, 0.0))]
        {
            let way = way_out(Ned::new(out.0, out.1, -20.0), &airspace, &LIMITS);
            let end = way.as_ref().and_then(|it| it.last()).map(|it| (it.north_m.round(), it.east_m.round()));
            assert_eq!(end, Some(back), "from {out:?}");
        }
    }

    #[test]
    fn a_mistake_is_told_with_its_place() {
        #[track_caller]
        fn check(find: &str, replace: &str, expected: &str) {
            check_mistake(GOOD, find, replace, read, expected);
        }
        check("[300.0, 700.0]", "[0.0, -200.0]", "m.toml:4:13: the volume crosses itself");
        check("[300.0, 700.0]", "[3e5, 700.0]", "m.toml:4:13: the volume has a corner out of range");
        check("[300.0, 700.0]", "[150e3, 700.0]", "m.toml:4:13: the volume has a corner out of range");
        let many = format!("{}[300.0, 700.0]", "[300.0, 700.0],".repeat(4_000));
        check("[300.0, 700.0]", &many, "m.toml:3:1: the volume has 4004 corners, at most 4000 are allowed");
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
            "m.toml:8:11: objective `there` lies in keep-out area `volume`, which",
        );
        check("[[-100.0, -100.0]", "[[-100.0, 105.0]", "m.toml:4:13: the take-off point lies");
        let name = "[[area]]\nname = \"volume\"\nkind = \"keep-out\"\ncorners_m = [[900, 0], [910, 0], [900, 9]]\n";
        check("[[objective]]", &format!("{name}[[objective]]"), "m.toml:7:8: area `volume` has the name of a part");
    }
}
