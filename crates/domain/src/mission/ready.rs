//! `ready`: a place that is landed at once the party there is ready.
//!
//! It is turned into a permission area round the place: asking, waiting, leaving and going elsewhere are those of any area. That the
//! tower grants it only to a site that is ready is the tower's business.

use std::f64::consts::TAU;
use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use super::{Checker, MissionFile, Objective};
use crate::area::{Area, AreaKind};
use crate::file::did_you_mean;
use crate::geometry::Ned;
use crate::site::{Site, area_of};

/// `{ site = "wt12", radius_m = 80.0 }`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ReadyEntry {
    /// Its name in the control tower's configuration.
    site: Spanned<String>,
    /// Of the air that is not entered before.
    radius_m: Option<Spanned<f64>>,
}

/// Without a radius, in metres. (ENG: a deck with a margin. A turbine needs the length of its blades and more.)
const USUAL_RADIUS_M: f64 = 50.0;
/// A smaller one leaves less than twice the margin between the place and the border, in metres.
const LEAST_RADIUS_M: f64 = 20.0;
/// A greater one is a typing mistake.
const MOST_RADIUS_M: f64 = 1_000.0;
/// Of the polygon that stands for the circle and has it inside.
const CORNERS: u32 = 12;

/// A place of the file that is to be ready.
struct Place<'a> {
    in_words: String,
    entry: &'a Spanned<ReadyEntry>,
    position: Ned,
}

impl Checker<'_> {
    /// The area round each site that is to be ready, each once, with where it stands in the file.
    pub(super) fn readiness(
        &mut self,
        file: &MissionFile,
        objectives: &[Objective],
        alternates: &[Site],
    ) -> Vec<(Range<usize>, Area)> {
        let place =
            |what: &str, name: &str, position, entry| Place { in_words: format!("{what} `{name}`"), entry, position };
        let mut places = Vec::new();
        for (entry, it) in file.objective.iter().zip(objectives) {
            let Some(ready) = &entry.ready else { continue };
            if it.flying {
                let message = format!("objective `{}` is reached in flight, and `ready` is for a landing", it.name);
                self.say(Some(ready.span()), message, "set `flying = false`, or take `ready` out");
            }
            places.push(place("objective", &it.name, it.position, ready));
        }
        for (entry, it) in file.site.iter().zip(alternates) {
            places.extend(entry.ready.as_ref().map(|ready| place("site", &it.name, it.position, ready)));
        }
        let mut known: Vec<(Place<'_>, Area)> = Vec::new();
        for place in places {
            let area = self.round(&place);
            let Some((first, other)) = known.iter().find(|(_, it)| it.name == area.name) else {
                known.push((place, area));
                continue;
            };
            if other.corners != area.corners {
                let Place { in_words, entry, .. } = place;
                let message = format!(
                    "{in_words} wants site `{}` ready round another place than {}",
                    entry.as_ref().site.as_ref(),
                    first.in_words
                );
                self.say(
                    Some(entry.span()),
                    message,
                    "a site has one place and one radius: name another site, or give both the same",
                );
            }
        }
        known.into_iter().map(|(place, area)| (place.entry.span(), area)).collect()
    }

    fn round(&mut self, place: &Place<'_>) -> Area {
        let ReadyEntry { site, radius_m } = place.entry.as_ref();
        let name = area_of(site.as_ref());
        match site.as_ref().trim().is_empty() {
            true => self.name("a site", site.as_ref(), Some(site)),
            false => self.name("the area of a site", &name, Some(site)),
        }
        if let Some(ready) = self.ready.filter(|it| !it.contains(&site.as_ref().as_str())) {
            let message = format!("the control tower knows no site `{}`", site.as_ref());
            let help = match ready.is_empty() {
                true => "add a [[control_tower.site]] to the configuration".to_owned(),
                false => did_you_mean(site.as_ref(), ready),
            };
            self.say(Some(site.span()), message, &help);
        }
        let radius_m = radius_m.as_ref();
        let radius_m = radius_m.map_or(USUAL_RADIUS_M, |it| self.within("radius_m", it, LEAST_RADIUS_M, MOST_RADIUS_M));
        let step = TAU / f64::from(CORNERS);
        let to_corner_m = radius_m / (step / 2.0).cos();
        let corner = |number: u32| {
            let (sine, cosine) = (step * f64::from(number)).sin_cos();
            let Ned { north_m, east_m, .. } = place.position;
            Ned::new(north_m + to_corner_m * cosine, east_m + to_corner_m * sine, 0.0)
        };
        Area::new(name, AreaKind::Permission, (0..CORNERS).map(corner).collect())
    }
}

#[cfg(test)]
mod tests {
    use crate::area::AreaKind;
    use crate::file::{Mistakes, Source};
    use crate::geometry::Ned;
    use crate::mission::Mission;
    use crate::testing::check_mistake;

    const GOOD: &str = r#"
name = "farm"
[[objective]]
name = "deliver"
north_m = 0.0
east_m = 400.0
height_m = 0.0
flying = false
ready = { site = "wt12", radius_m = 80.0 }
[[objective]]
name = "collect"
north_m = 0.0
east_m = 400.0
height_m = 0.0
flying = false
ready = { site = "wt12", radius_m = 80.0 }
[[site]]
name = "ship"
kind = "landing"
north_m = 300.0
east_m = 200.0
ready = { site = "vessel" }
"#;

    fn read(text: &str) -> Result<Mission, Mistakes> {
        let source = Source { path: "m.toml".into(), text: text.into() };
        Mission::read_with(&source, &Default::default(), Some(&["wt12", "vessel"]))
    }

    #[test]
    fn the_air_round_each_place_that_is_to_be_ready_takes_a_permission() {
        let mission = read(GOOD).unwrap_or_else(|it| panic!("{it}"));
        let of = |name: &str| mission.areas.iter().find(|it| it.name == name).unwrap_or_else(|| panic!("no {name}"));
        assert_eq!(mission.areas.len(), 2);
        for (name, north_m, east_m, radius_m) in [("site wt12", 0.0, 400.0, 80.0), ("site vessel", 300.0, 200.0, 50.0)]
        {
            assert_eq!(of(name).kind, AreaKind::Permission);
            assert!(of(name).always_applies());
            for degrees in 0..360 {
                let (sine, cosine) = f64::from(degrees).to_radians().sin_cos();
                let at = |m: f64| Ned::new(north_m + m * cosine, east_m + m * sine, -20.0);
                assert!(of(name).contains(at(radius_m - 0.1)), "{name} at {degrees} degrees");
                assert!(!of(name).contains(at(radius_m * 1.04)), "{name} at {degrees} degrees");
            }
        }
    }

    #[test]
    fn every_mistake_about_readiness_is_reported_with_its_place() {
        #[track_caller]
        fn check(find: &str, replace: &str, expected: &str) {
            check_mistake(GOOD, find, replace, read, expected);
        }
        check(
            "height_m = 0.0\nflying = false",
            "height_m = 20.0\nflying = true",
            "m.toml:9:9: objective `deliver` is reached in flight, and `ready` is for a landing",
        );
        check("\"vessel\"", "\"wt21\"", "m.toml:22:18: the control tower knows no site `wt21`");
        check("\"vessel\"", "\" \"", "m.toml:22:18: the name of a site is empty");
        check(
            "\"vessel\"",
            &format!("{:?}", "w".repeat(96)),
            "m.toml:22:18: the name of the area of a site has 101 characters, at most 100 are allowed",
        );
        check("80.0", "8.0", "m.toml:9:37: `radius_m` is 8, expected metres between 20 and 1000");
        check(
            "80.0",
            "90.0",
            "m.toml:16:9: objective `collect` wants site `wt12` ready round another place than objective `deliver`",
        );
        check(
            "\"vessel\"",
            "\"wt12\"",
            "m.toml:22:9: site `ship` wants site `wt12` ready round another place than objective `deliver`",
        );
        check("ready = { site = \"vessel\" }", "ready = \"vessel\"", "m.toml:22:9: invalid type: string");
        check("\"vessel\" }", "\"vessel\", wind = 3 }", "m.toml:22:28: unknown field `wind`");
        let area = "[[area]]\nname = \"site wt12\"\nkind = \"keep-out\"\ncorners_m = [[900, 0], [910, 0], [900, 9]]\n";
        check("[[site]]", &format!("{area}[[site]]"), "m.toml:18:8: area `site wt12` has the name of the air round");
    }
}
