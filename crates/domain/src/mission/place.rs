//! Where things are, as a mission file says it: in metres from the take-off point, or in WGS 84 in a mission whose origin is
//! known. Inside there are metres only.

use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use super::{AreaEntry, Checker, FARTHEST_M, HIGHEST_M, ObjectiveEntry};
use crate::area::{Area, InvalidRings};
use crate::geodesy::{LatLon, LocalFrame, NORTHERNMOST_ORIGIN_DEG, Origin};
use crate::geometry::Ned;

/// Where the take-off point is.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct OriginEntry {
    latitude_deg: Spanned<f64>,
    longitude_deg: Spanned<f64>,
    /// Above mean sea level.
    altitude_m: Option<Spanned<f64>>,
}

const GIVE_CORNERS: &str = "give `corners_m` as [north, east], or `corners_deg` as [latitude, longitude]";
const RANGE_OF_CORNERS: &str =
    "corners are metres [north, east], or degrees [latitude, longitude], at most 200 km from the origin";
const NO_ORIGIN: &str = "add an [origin] with `latitude_deg` and `longitude_deg`: the take-off point";

/// What a file says about where something is.
pub(super) struct Written<'a> {
    /// `objective` or `site`.
    pub(super) what: &'static str,
    pub(super) name: &'a Spanned<String>,
    pub(super) north_m: Option<&'a Spanned<f64>>,
    pub(super) east_m: Option<&'a Spanned<f64>>,
    pub(super) latitude_deg: Option<&'a Spanned<f64>>,
    pub(super) longitude_deg: Option<&'a Spanned<f64>>,
}

impl Written<'_> {
    /// What says where it is, or its name if nothing does.
    pub(super) fn span(&self) -> Range<usize> {
        self.first().unwrap_or(self.name.span())
    }

    fn first(&self) -> Option<Range<usize>> {
        self.north_m.or(self.latitude_deg).map(Spanned::span)
    }

    fn in_words(&self) -> String {
        format!("{} `{}`", self.what, self.name.as_ref())
    }

    fn help(&self) -> String {
        let or_survey = if self.what == "objective" { ", or a `survey`" } else { "" };
        format!("give `north_m` and `east_m`, or `latitude_deg` and `longitude_deg`{or_survey}")
    }
}

impl ObjectiveEntry {
    /// What says where it is, or its name if nothing does.
    pub(super) fn place_span(&self) -> Range<usize> {
        self.written().first().or_else(|| self.survey_span()).unwrap_or(self.name.span())
    }

    fn written(&self) -> Written<'_> {
        Written {
            what: "objective",
            name: &self.name,
            north_m: self.north_m.as_ref(),
            east_m: self.east_m.as_ref(),
            latitude_deg: self.latitude_deg.as_ref(),
            longitude_deg: self.longitude_deg.as_ref(),
        }
    }
}

impl AreaEntry {
    /// Its corners, or its name if it has none.
    pub(super) fn corners_span(&self) -> Range<usize> {
        self.corners_m.as_ref().or(self.corners_deg.as_ref()).map_or(self.name.span(), Spanned::span)
    }

    /// Its outline, then each of its holes.
    pub(super) fn ring_spans(&self) -> Vec<Range<usize>> {
        std::iter::once(self.corners_span()).chain(self.holes().iter().map(Spanned::span)).collect()
    }

    /// Its holes as they are written.
    pub(super) fn holes(&self) -> &[Spanned<Vec<[f64; 2]>>] {
        self.holes_m.as_ref().or(self.holes_deg.as_ref()).map_or(&[], Vec::as_slice)
    }
}

impl Checker<'_> {
    /// The origin, and from now on its frame.
    pub(super) fn origin(&mut self, entry: &Spanned<OriginEntry>) -> Option<Origin> {
        let it = entry.as_ref();
        let altitude_m = it.altitude_m.as_ref().map(|it| self.within("altitude_m", it, -HIGHEST_M, HIGHEST_M));
        let place = self.lat_lon(*it.latitude_deg.as_ref(), *it.longitude_deg.as_ref(), it.latitude_deg.span())?;
        if NORTHERNMOST_ORIGIN_DEG < place.latitude_deg().abs() {
            let message = format!("the origin lies at latitude {}", place.latitude_deg());
            let help = "nearer than one degree to a pole there is no usable east";
            self.say(Some(it.latitude_deg.span()), message, help);
            return None;
        }
        self.frame = Some(LocalFrame::at(place));
        Some(Origin { place, altitude_m })
    }

    /// Where an objective is, at height 0.
    pub(super) fn objective_place(&mut self, it: &ObjectiveEntry) -> Ned {
        self.place(&it.written())
    }

    /// Where something is, at height 0.
    pub(super) fn place(&mut self, it: &Written<'_>) -> Ned {
        match (it.north_m, it.east_m, it.latitude_deg, it.longitude_deg) {
            (Some(north), Some(east), None, None) => Ned::new(
                self.within("north_m", north, -FARTHEST_M, FARTHEST_M),
                self.within("east_m", east, -FARTHEST_M, FARTHEST_M),
                0.0,
            ),
            (None, None, Some(latitude), Some(longitude)) => {
                let found = self.local(*latitude.as_ref(), *longitude.as_ref(), latitude.span());
                let distance_m = found.map_or(0.0, |it| it.horizontal_distance_m(Ned::default()));
                if FARTHEST_M < distance_m {
                    let message = format!("{} is {:.0} km from the origin", it.in_words(), distance_m / 1000.0);
                    self.say(Some(latitude.span()), message, "places are at most 100 km from the origin");
                }
                found.unwrap_or_default()
            }
            (None, Some(_), None, None) => self.lacks(it, "north_m"),
            (Some(_), None, None, None) => self.lacks(it, "east_m"),
            (None, None, None, Some(_)) => self.lacks(it, "latitude_deg"),
            (None, None, Some(_), None) => self.lacks(it, "longitude_deg"),
            (None, None, None, None) => self.lacks(it, "place"),
            _ => {
                let message = format!("{} has metres and degrees for its place", it.in_words());
                self.say(Some(it.span()), message, &it.help());
                Ned::default()
            }
        }
    }

    /// The corners of an area, in order; `None` after a mistake.
    pub(super) fn area_corners(&mut self, it: &AreaEntry) -> Option<Vec<Ned>> {
        self.corners(&it.corners_m, &it.corners_deg, &format!("area `{}`", it.name.as_ref()), it.corners_span())
    }

    /// The corners of each hole of an area, in order; `None` after a mistake.
    pub(super) fn area_holes(&mut self, it: &AreaEntry) -> Option<Vec<Vec<Ned>>> {
        if it.holes_m.is_some() && it.holes_deg.is_some() {
            let message = format!("area `{}` has its holes twice", it.name.as_ref());
            self.say(Some(it.name.span()), message, "give `holes_m` or `holes_deg`");
            return None;
        }
        let mut hole = |ring: &Spanned<Vec<[f64; 2]>>| {
            let corner = |&[a, b]: &[f64; 2]| match it.holes_m {
                Some(_) => Some(Ned::new(a, b, 0.0)),
                None => self.local(a, b, ring.span()),
            };
            ring.as_ref().iter().map(corner).collect::<Option<Vec<Ned>>>()
        };
        it.holes().iter().map(&mut hole).collect()
    }

    /// Whether the rings of `area`, which is `what`, make an area in range. `spans`: where each ring stands.
    pub(super) fn rings(&mut self, area: &Area, what: &str, spans: &[Range<usize>]) -> bool {
        let is_near = |it: &Ned| it.is_sound() && it.horizontal_distance_m(Ned::default()) <= 2.0 * FARTHEST_M;
        let far = area.rings().position(|ring| !ring.iter().all(is_near));
        let (ring, message, help) = match (far, area.check_rings()) {
            (Some(ring), _) => (ring, format!("{what} has a corner out of range"), RANGE_OF_CORNERS),
            (None, Err(invalid)) => (invalid.ring(), format!("{what} {invalid}"), help_with(invalid)),
            (None, Ok(())) => return true,
        };
        self.say(spans.get(ring).cloned(), message, help);
        false
    }

    /// The corners of `what`, in metres or in degrees; `None` after a mistake.
    pub(super) fn corners(
        &mut self,
        corners_m: &Option<Spanned<Vec<[f64; 2]>>>,
        corners_deg: &Option<Spanned<Vec<[f64; 2]>>>,
        what: &str,
        span: Range<usize>,
    ) -> Option<Vec<Ned>> {
        let mistake = match (corners_m, corners_deg) {
            (Some(metres), None) => {
                return Some(metres.as_ref().iter().map(|&[north, east]| Ned::new(north, east, 0.0)).collect());
            }
            (None, Some(degrees)) => {
                // Only the first wrong corner is reported.
                let local = |&[latitude, longitude]: &[f64; 2]| self.local(latitude, longitude, degrees.span());
                return degrees.as_ref().iter().map(local).collect();
            }
            (None, None) => "has no corners",
            (Some(_), Some(_)) => "has its corners twice",
        };
        self.say(Some(span), format!("{what} {mistake}"), GIVE_CORNERS);
        None
    }

    fn lacks(&mut self, it: &Written<'_>, what: &str) -> Ned {
        let message = format!("{} has no {}", it.in_words(), quoted(what));
        self.say(Some(it.span()), message, &it.help());
        Ned::default()
    }

    fn local(&mut self, latitude_deg: f64, longitude_deg: f64, span: Range<usize>) -> Option<Ned> {
        let place = self.lat_lon(latitude_deg, longitude_deg, span.clone())?;
        if self.frame.is_none() {
            self.say(Some(span), "a place in degrees in a mission whose origin is not known", NO_ORIGIN);
        }
        self.frame.map(|frame| frame.local(place))
    }

    fn lat_lon(&mut self, latitude_deg: f64, longitude_deg: f64, span: Range<usize>) -> Option<LatLon> {
        match LatLon::new(latitude_deg, longitude_deg) {
            Ok(place) => Some(place),
            Err(error) => {
                self.say(Some(span), error.to_string(), "latitude comes first, north and east are positive");
                None
            }
        }
    }
}

fn help_with(invalid: InvalidRings) -> &'static str {
    match invalid {
        InvalidRings::Outline => "list at least three corners in order round the area",
        InvalidRings::Hole(_) => "list at least three corners in order round the hole",
        InvalidRings::NotInside(_) => {
            "a hole does not touch the outline; what juts into the area is part of the outline"
        }
        InvalidRings::Overlap(..) => "make one hole of the two",
    }
}

fn quoted(what: &str) -> String {
    if what == "place" { what.into() } else { format!("`{what}`") }
}

#[cfg(test)]
mod tests {
    use crate::file::{Mistakes, Source};
    use crate::geometry::Ned;
    use crate::mission::Mission;
    use crate::testing::check_mistake;

    const GOOD: &str = r#"
name = "quay"
[origin]
latitude_deg = 54.0
longitude_deg = 6.6
altitude_m = 12.0
[[objective]]
name = "deliver"
latitude_deg = 54.0
longitude_deg = 6.607625
height_m = 0.0
flying = false
[[objective]]
name = "return"
north_m = 0.0
east_m = 0.0
height_m = 0.0
flying = false
[[area]]
name = "A"
kind = "permission"
corners_deg = [[53.999, 6.602], [54.001, 6.602], [54.001, 6.604], [53.999, 6.604]]
"#;

    fn read(text: &str) -> Result<Mission, Mistakes> {
        Mission::read(&Source { path: "m.toml".into(), text: text.into() })
    }

    #[test]
    fn degrees_become_metres_from_the_origin() {
        let mission = read(GOOD).unwrap();
        let there = mission.objectives[0].position;
        // A degree of longitude is 65.6 km there.
        assert!(there.horizontal_distance_m(Ned::new(0.0, 500.0, 0.0)) < 1.0, "{there:?}");
        assert_eq!(mission.objectives[1].position, Ned::default());
        assert!(mission.areas[0].contains(there.at_height(0.0).towards(Ned::default(), 0.6)), "{mission:?}");
        let origin = mission.origin.unwrap();
        assert_eq!((origin.place.latitude_deg(), origin.place.longitude_deg()), (54.0, 6.6));
        assert_eq!(origin.altitude_m, Some(12.0));
    }

    #[test]
    fn the_same_metres_from_another_origin_are_another_mission() {
        let metres = |origin: &str| {
            let objective = "[[objective]]\nname = \"look\"\nnorth_m = 0\neast_m = 500\nheight_m = 20\nflying = true\n";
            read(&format!("name = \"look\"\n{origin}{objective}")).unwrap()
        };
        let here = metres("[origin]\nlatitude_deg = 54.0\nlongitude_deg = 6.6\n");
        let there = metres("[origin]\nlatitude_deg = 54.01\nlongitude_deg = 6.6\n");
        assert_eq!((&here.objectives, &here.areas), (&there.objectives, &there.areas));
        assert!(here.identity() != there.identity() && here.identity() != metres("").identity());
    }

    #[test]
    fn every_mistake_about_a_place_is_reported_with_its_place() {
        #[track_caller]
        fn check(find: &str, replace: &str, expected: &str) {
            check_mistake(GOOD, find, replace, read, expected);
        }
        check(
            "latitude_deg = 54.0\nlong",
            "latitude_deg = 94.0\nlong",
            "m.toml:4:16: latitude 94, longitude 6.6: expected",
        );
        check(
            "latitude_deg = 54.0\nlong",
            "latitude_deg = 89.5\nlong",
            "m.toml:4:16: the origin lies at latitude 89.5",
        );
        check("altitude_m = 12.0", "altitude_m = nan", "m.toml:6:14: `altitude_m` is NaN");
        check("6.607625", "186.6", "m.toml:9:16: latitude 54, longitude 186.6: expected degrees");
        check("6.607625", "66.6", "m.toml:9:16: objective `deliver` is 3814 km from the origin");
        check("longitude_deg = 6.607625\n", "", "m.toml:9:16: objective `deliver` has no `longitude_deg`");
        check(
            "longitude_deg = 6.607625\n",
            "east_m = 500.0\n",
            "m.toml:9:16: objective `deliver` has metres and degrees",
        );
        check("north_m = 0.0\neast_m = 0.0\n", "", "m.toml:14:8: objective `return` has no place");
        check(
            "corners_deg = [[53.999, 6.602]",
            "corners_deg = [[6.602, 253.999]",
            "m.toml:22:15: latitude 6.602, longitude 253.999",
        );
        check(
            "corners_deg = [[53.999, 6.602]",
            "corners_deg = [[6.602, 53.999]",
            "m.toml:22:15: area `A` has a corner out of range",
        );
        check("corners_deg", "corners_m = [[0, 0]]\ncorners_deg", "m.toml:22:13: area `A` has its corners twice");
        check(
            "[origin]\nlatitude_deg = 54.0\nlongitude_deg = 6.6\naltitude_m = 12.0\n",
            "",
            "m.toml:5:16: a place in degrees in a mission whose origin is not known",
        );
    }
}
