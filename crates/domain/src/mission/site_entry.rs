//! `[[site]]`: where a flight may end early.

use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use super::place::Written;
use super::ready::ReadyEntry;
use super::{Checker, HIGHEST_M, sites};
use crate::area::Area;
use crate::site::{Site, SiteKind};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SiteEntry {
    pub(super) name: Spanned<String>,
    kind: SiteKind,
    /// From the take-off point, or in WGS 84.
    north_m: Option<Spanned<f64>>,
    east_m: Option<Spanned<f64>>,
    latitude_deg: Option<Spanned<f64>>,
    longitude_deg: Option<Spanned<f64>>,
    /// Above the take-off point; without the key at its height.
    height_m: Option<Spanned<f64>>,
    pub(super) ready: Option<Spanned<ReadyEntry>>,
}

impl SiteEntry {
    fn written(&self) -> Written<'_> {
        Written {
            what: "site",
            name: &self.name,
            north_m: self.north_m.as_ref(),
            east_m: self.east_m.as_ref(),
            latitude_deg: self.latitude_deg.as_ref(),
            longitude_deg: self.longitude_deg.as_ref(),
        }
    }

    /// Where it says its height, or what stands for that.
    pub(super) fn height_span(&self) -> Range<usize> {
        self.height_m.as_ref().map_or_else(|| self.written().span(), Spanned::span)
    }
}

impl Checker<'_> {
    pub(super) fn alternates(&mut self, entries: &[SiteEntry]) -> Vec<Site> {
        self.distinct("site", entries.iter().map(|it| &it.name));
        entries.iter().map(|it| self.alternate(it)).collect()
    }

    fn alternate(&mut self, it: &SiteEntry) -> Site {
        let name = it.name.as_ref().clone();
        let height_m = it.height_m.as_ref().map_or(0.0, |it| self.within("height_m", it, -HIGHEST_M, HIGHEST_M));
        let span = it.height_m.as_ref().map(Spanned::span);
        if height_m < sites::LOWEST_GROUND_M {
            let message = format!("site `{name}` is inside the ground: it lies at height {height_m} m");
            self.say(span, message, "a site lies at most 110 m below the take-off point");
        } else if let Some(most_m) = sites::too_high(height_m, false) {
            let message = format!(
                "site `{name}` is at height {height_m} m, expected at most {most_m} m: responses fly no higher"
            );
            self.say(span, message, "choose a lower place: a response must come down to it");
        }
        Site { position: self.place(&it.written()).at_height(height_m), kind: it.kind, name }
    }

    /// Each site against each area that always applies, by the rule for the places at which a mission ends.
    pub(super) fn alternates_among(&mut self, entries: &[SiteEntry], alternates: &[Site], areas: &[Area]) {
        for (entry, site) in entries.iter().zip(alternates) {
            let place = sites::Place::to_end_at(site.position);
            let bars = |it: &&Area| it.always_applies() && !it.takes(site.kind.harm());
            for unfit in areas.iter().filter(bars).filter_map(|it| sites::unfit(place, it)) {
                let message = format!("site `{}` {}", site.name, unfit.in_words());
                self.say(Some(entry.written().span()), message, unfit.help());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::file::{Mistakes, Source};
    use crate::geometry::Ned;
    use crate::mission::Mission;
    use crate::site::{MOST_SITES, SiteKind};
    use crate::testing::check_mistake;

    const GOOD: &str = r#"
name = "quay"
[origin]
latitude_deg = 54.0
longitude_deg = 6.6
[[objective]]
name = "look"
north_m = 0.0
east_m = 500.0
height_m = 20.0
flying = true
[[site]]
name = "field"
kind = "landing"
north_m = 100.0
east_m = 250.0
height_m = 3.0
[[site]]
name = "pond"
kind = "ditch"
latitude_deg = 54.0
longitude_deg = 6.603
[[area]]
name = "A"
kind = "keep-out"
corners_m = [[60.0, 300.0], [160.0, 300.0], [160.0, 400.0], [60.0, 400.0]]
"#;

    /// Round the ditch.
    const POND: &str = "corners_m = [[-60.0, 150.0], [60.0, 150.0], [60.0, 240.0], [-60.0, 240.0]]";

    fn read(text: &str) -> Result<Mission, Mistakes> {
        Mission::read(&Source { path: "m.toml".into(), text: text.into() })
    }

    #[test]
    fn a_mission_names_where_to_land_and_where_to_ditch() {
        let sites = read(GOOD).unwrap().sites;
        let names: Vec<_> = sites.iter().map(|it| (it.name.as_str(), it.kind)).collect();
        assert_eq!(names, [("field", SiteKind::Landing), ("pond", SiteKind::Ditch)]);
        assert_eq!(sites[0].position, Ned::new(100.0, 250.0, -3.0));
        assert!(sites[1].position.distance_m(Ned::new(0.0, 196.7, 0.0)) < 1.0, "{:?}", sites[1]);
    }

    #[test]
    fn every_mistake_about_a_site_is_reported_with_its_place() {
        #[track_caller]
        fn check(find: &str, replace: &str, expected: &str) {
            check_mistake(GOOD, find, replace, read, expected);
        }
        check("kind = \"ditch\"\n", "", "m.toml:18:1: missing field `kind`");
        check("\"ditch\"", "\"water\"", "m.toml:20:8: unknown variant `water`, expected `landing` or `ditch`");
        check("height_m = 3.0\n", "flying = false\n", "m.toml:17:1: unknown field `flying`, expected one of");
        check("height_m = 3.0", "height_m = -110.1", "m.toml:17:12: site `field` is inside the ground");
        check(
            "height_m = 3.0",
            "height_m = 115.0",
            "m.toml:17:12: site `field` is at height 115 m, expected at most 110 m",
        );
        check("height_m = 3.0", "height_m = nan", "m.toml:17:12: `height_m` is NaN, expected metres between");
        check("\"pond\"", "\"field\"", "m.toml:19:8: two sites with the name `field`");
        check("\"pond\"", "\" \"", "m.toml:19:8: the name of a site is empty");
        check("east_m = 250.0\n", "", "m.toml:15:11: site `field` has no `east_m`");
        check("north_m = 100.0\neast_m = 250.0\n", "", "m.toml:13:8: site `field` has no place");
        check("north_m = 100.0", "north_m = 100001.0", "m.toml:15:11: `north_m` is 100001, expected metres between");
        check("6.603", "66.6", "m.toml:21:16: site `pond` is 3814 km from the origin");
        check("6.603", "186.6", "m.toml:21:16: latitude 54, longitude 186.6: expected degrees");
        check(
            "east_m = 250.0",
            "east_m = 350.0",
            "m.toml:15:11: site `field` lies in keep-out area `A`, which always applies",
        );
        check(
            "east_m = 250.0",
            "east_m = 291.0",
            "m.toml:15:11: site `field` lies 9.0 m from the border of area `A`, expected at least 10 m",
        );
        check(
            "kind = \"keep-out\"\ncorners_m = [[60.0, 300.0]",
            "kind = \"no-landing\"\ncorners_m = [[60.0, 200.0]",
            "m.toml:15:11: site `field` lies in no-landing area `A`, which always applies",
        );
        for ground in ["", "ground = \"people\"\n"] {
            check(
                "kind = \"keep-out\"\ncorners_m = [[60.0, 300.0], [160.0, 300.0], [160.0, 400.0], [60.0, 400.0]]",
                &format!("kind = \"no-landing\"\n{ground}{POND}"),
                "m.toml:21:16: site `pond` lies in no-landing area `A`, which always applies",
            );
        }
        // At the border itself.
        check("east_m = 250.0", "east_m = 300.0", "m.toml:15:11: site `field` lies 0.0 m from the border of area `A`");
    }

    #[test]
    fn a_ditch_may_lie_in_water() {
        let area = "kind = \"keep-out\"\ncorners_m = [[60.0, 300.0], [160.0, 300.0], [160.0, 400.0], [60.0, 400.0]]";
        let text = GOOD.replacen(area, &format!("kind = \"no-landing\"\nground = \"water\"\n{POND}"), 1);
        assert!(read(&text).is_ok(), "{}", read(&text).unwrap_err());
    }

    #[test]
    fn a_site_may_lie_in_an_area_that_a_permission_opens_and_in_one_that_is_closed_for_a_time() {
        #[track_caller]
        fn check(find: &str, replace: &str) {
            let text = GOOD.replacen("east_m = 250.0", "east_m = 350.0", 1).replacen(find, replace, 1);
            assert!(read(&text).is_ok(), "{}", read(&text).unwrap_err());
        }
        check("keep-out", "permission");
        check("[160.0, 400.0], [60.0, 400.0]]", "[160.0, 400.0], [60.0, 400.0]]\nuntil_utc = \"2026-05-01T08:00:00Z\"");
        check("corners_m = [[60.0", "floor_m = 30.0\ncorners_m = [[60.0");
    }

    #[test]
    fn so_many_sites_are_taken_and_no_more() {
        let with = |count: usize| {
            let site =
                |index| format!("[[site]]\nname = \"{index}\"\nkind = \"landing\"\nnorth_m = {index}\neast_m = 0\n");
            let head = &GOOD[..GOOD.find("[[site]]").unwrap()];
            read(&format!("{head}{}", (0..count).map(site).collect::<String>()))
        };
        assert_eq!(with(MOST_SITES).unwrap().sites.len(), MOST_SITES);
        let refused = with(MOST_SITES + 1).unwrap_err().to_string();
        assert!(refused.contains(&format!("{} sites, expected at most {MOST_SITES}", MOST_SITES + 1)), "{refused}");
    }

    #[test]
    fn the_identity_of_a_mission_counts_its_sites() {
        let mission = read(GOOD).unwrap();
        for (found, replaced) in [("\"field\"", "\"meadow\""), ("\"ditch\"", "\"landing\""), ("250.0", "250.1")] {
            let other = read(&GOOD.replacen(found, replaced, 1)).unwrap();
            assert_ne!(other.identity(), mission.identity(), "{found}");
        }
    }
}
