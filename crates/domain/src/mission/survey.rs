//! A survey as a mission file has it: in place of a position an objective has a polygon, which is flown over line by line.

use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use super::{Checker, ObjectiveEntry};
use crate::geometry::Ned;
use crate::survey::{InvalidSurvey, MOST_LINES, Survey};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SurveyEntry {
    /// `[north, east]` each.
    pub(super) corners_m: Option<Spanned<Vec<[f64; 2]>>>,
    /// `[latitude, longitude]` each, instead.
    pub(super) corners_deg: Option<Spanned<Vec<[f64; 2]>>>,
    /// Between the lines.
    spacing_m: Option<Spanned<f64>>,
    /// In place of that, the share of a picture that the next line shows, too.
    side_overlap: Option<Spanned<f64>>,
    /// Along a line from one picture to the next.
    picture_distance_m: Option<Spanned<f64>>,
    /// In place of that, the share of a picture that the next one shows, too.
    forward_overlap: Option<Spanned<f64>>,
    /// Of the lines, clockwise from north.
    heading_deg: Option<Spanned<f64>>,
}

/// More than this leaves so little for each picture that it is a typing mistake.
const MOST_OVERLAP: f64 = 0.95;

/// A distance over the ground as a survey has it: a key with metres, or a key with an overlap of pictures.
struct Distance<'a> {
    metres: (&'static str, &'a Option<Spanned<f64>>),
    overlap: (&'static str, &'a Option<Spanned<f64>>),
}

impl Distance<'_> {
    /// Where it stands in the file.
    fn span(&self) -> Option<Range<usize>> {
        self.metres.1.as_ref().or(self.overlap.1.as_ref()).map(Spanned::span)
    }
}

impl SurveyEntry {
    fn spacing(&self) -> Distance<'_> {
        Distance { metres: ("spacing_m", &self.spacing_m), overlap: ("side_overlap", &self.side_overlap) }
    }

    fn picture_distance(&self) -> Distance<'_> {
        let metres = ("picture_distance_m", &self.picture_distance_m);
        Distance { metres, overlap: ("forward_overlap", &self.forward_overlap) }
    }

    fn corners_span(&self, otherwise: Range<usize>) -> Range<usize> {
        self.corners_m.as_ref().or(self.corners_deg.as_ref()).map_or(otherwise, Spanned::span)
    }
}

impl ObjectiveEntry {
    /// The corners of its survey, if it is one.
    pub(super) fn survey_span(&self) -> Option<Range<usize>> {
        self.survey.as_ref().map(|it| it.as_ref().corners_span(it.span()))
    }
}

impl Checker<'_> {
    /// The survey of an objective, and where it ends, at height 0; `None` if it is not a survey, or after a mistake.
    pub(super) fn survey(&mut self, it: &ObjectiveEntry) -> Option<(Survey, Ned)> {
        let (entry, name) = (it.survey.as_ref()?, it.name.as_ref());
        let (span, entry) = (entry.span(), entry.as_ref());
        let places = [&it.north_m, &it.east_m, &it.latitude_deg, &it.longitude_deg];
        if let Some(place) = places.into_iter().flatten().next() {
            let message = format!("objective `{name}` has a place and a survey");
            self.say(Some(place.span()), message, "take one of them out: a survey ends at the end of its last line");
        }
        if !it.flying {
            let message = format!("objective `{name}` is a survey on the ground");
            self.say(Some(span.clone()), message, "set `flying = true`, and land with an objective of its own");
        }
        let what = format!("the survey of objective `{name}`");
        let corners = self.corners(&entry.corners_m, &entry.corners_deg, &what, entry.corners_span(span.clone()))?;
        let heading_deg = entry.heading_deg.as_ref().map(|it| *it.as_ref());
        let footprint_m = self.camera.map(|camera| camera.footprint_m(*it.height_m.as_ref()));
        let (spacing, picture_distance) = (entry.spacing(), entry.picture_distance());
        let Some(spacing_span) = spacing.span() else {
            let help = "give `spacing_m`, or `side_overlap` and the mission a [camera]";
            self.say(Some(span), format!("{what} has no spacing"), help);
            return None;
        };
        let spacing_m = self.distance(&spacing, &what, footprint_m.map(|it| it[0]));
        let picture_distance_m = self.distance(&picture_distance, &what, footprint_m.map(|it| it[1]));
        let spacing_m = spacing_m?;
        let shows = || {
            footprint_m.map(|[across, along]| format!("a picture shows {across:.0} by {along:.0} m from that height"))
        };
        match Survey::new(corners, spacing_m, heading_deg).and_then(|it| it.with_pictures(picture_distance_m)) {
            Ok(survey) => {
                let end = survey.turns().last()?.at;
                Some((survey, end))
            }
            Err(invalid) => {
                let (at, help) = match invalid {
                    InvalidSurvey::Shape => {
                        (entry.corners_span(span), "list at least three corners in order round the area".to_owned())
                    }
                    InvalidSurvey::TooFar | InvalidSurvey::TooManyCorners(_) => {
                        (entry.corners_span(span), String::new())
                    }
                    InvalidSurvey::Spacing(_) => (spacing_span, shows().unwrap_or_default()),
                    InvalidSurvey::PictureDistance(_) => {
                        (picture_distance.span().unwrap_or(span), shows().unwrap_or_default())
                    }
                    InvalidSurvey::Heading(_) => {
                        (entry.heading_deg.as_ref().map_or(span, Spanned::span), "north is 0, east is 90".to_owned())
                    }
                    InvalidSurvey::TooManyLines { lines } => {
                        let least_m = (spacing_m * lines as f64 / MOST_LINES as f64).ceil();
                        let help =
                            format!("split it into several objectives, or leave {least_m} m or more between lines");
                        (spacing_span, help)
                    }
                };
                self.say(Some(at), format!("{what}: {invalid}"), &help);
                None
            }
        }
    }

    /// In metres, to the centimetre where it follows from an overlap of pictures that show `footprint_m`; `None` without one, or
    /// after a mistake.
    fn distance(&mut self, it: &Distance<'_>, what: &str, footprint_m: Option<f64>) -> Option<f64> {
        let (key, _) = it.overlap;
        let (overlap, span) = match (it.metres.1, it.overlap.1) {
            (metres, None) => return metres.as_ref().map(|it| *it.as_ref()),
            (None, Some(overlap)) => (*overlap.as_ref(), overlap.span()),
            (Some(_), Some(overlap)) => {
                let message = format!("{what} has `{}` and `{key}`", it.metres.0);
                self.say(Some(overlap.span()), message, "take one of them out");
                return None;
            }
        };
        if !(0.0..=MOST_OVERLAP).contains(&overlap) {
            let message = format!("{what}: its `{key}` is {overlap}, expected 0 to {MOST_OVERLAP}");
            self.say(Some(span), message, "0.7 is 70 % of a picture");
            return None;
        }
        let Some(footprint_m) = footprint_m else {
            let help = format!(
                "add [camera] with `sensor_width_mm`, `sensor_height_mm` and `focal_length_mm`, or give `{}`",
                it.metres.0
            );
            self.say(Some(span), format!("{what} has `{key}`, and the mission has no camera"), &help);
            return None;
        };
        Some((footprint_m * (1.0 - overlap) * 100.0).round() / 100.0)
    }
}

#[cfg(test)]
mod tests {
    use crate::declared_skill::{DeclaredSkill, DeclaredSkills};
    use crate::file::{Mistakes, Source};
    use crate::geometry::Ned;
    use crate::mission::Mission;
    use crate::testing::check_mistake;

    const GOOD: &str = r#"
name = "field"
[[objective]]
name = "look"
survey = { corners_m = [[100, 0], [100, 90], [300, 90], [300, 0]], spacing_m = 30 }
height_m = 40.0
flying = true
[[objective]]
name = "home"
north_m = 0.0
east_m = 0.0
height_m = 0.0
flying = false
"#;

    fn read(text: &str) -> Result<Mission, Mistakes> {
        Mission::read(&Source { path: "m.toml".into(), text: text.into() })
    }

    #[test]
    fn a_survey_is_an_objective_that_ends_at_its_last_turn() {
        let mission = read(GOOD).unwrap();
        let places: Vec<_> = mission.objectives[0].places().iter().map(ToString::to_string).collect();
        // Three lines along the longer side, the nearest end first.
        let expected =
            ["(100, 15, 40)", "(300, 15, 40)", "(300, 45, 40)", "(100, 45, 40)", "(100, 75, 40)", "(300, 75, 40)"];
        assert_eq!(places, expected);
        assert_eq!(mission.objectives[0].position.to_string(), "(300, 75, 40)");
        assert_eq!(mission.objectives[1].places(), [Ned::default()]);
        let other = read(&GOOD.replace("spacing_m = 30", "spacing_m = 31")).unwrap();
        assert_ne!(other.identity(), mission.identity());
    }

    #[test]
    fn corners_may_be_degrees() {
        let degrees = "corners_deg = [[54.001, 6.6], [54.001, 6.602], [54.003, 6.602], [54.003, 6.6]]";
        let text = GOOD.replace("corners_m = [[100, 0], [100, 90], [300, 90], [300, 0]]", degrees);
        let origin = "name = \"field\"\n[origin]\nlatitude_deg = 54.0\nlongitude_deg = 6.6\n";
        let mission = read(&text.replace("name = \"field\"\n", origin)).unwrap();
        let first = mission.objectives[0].places()[0];
        assert!(first.horizontal_distance_m(Ned::new(111.3, 13.1, 0.0)) < 10.0, "{first}");
    }

    #[test]
    fn every_mistake_about_a_survey_is_told_with_its_place() {
        #[track_caller]
        fn check(find: &str, replace: &str, expected: &str) {
            check_mistake(GOOD, find, replace, read, expected);
        }
        check(
            "height_m = 40.0",
            "north_m = 1.0\nheight_m = 40.0",
            "m.toml:6:11: objective `look` has a place and a survey",
        );
        check("flying = true", "flying = false", "m.toml:5:10: objective `look` is a survey on the ground");
        check(
            "spacing_m = 30",
            "spacing_m = 3",
            "m.toml:5:80: the survey of objective `look`: its spacing is 3 m, expected 5 to",
        );
        check("spacing_m = 30", "spacing_m = nan", "m.toml:5:80: the survey of objective `look`: its spacing is NaN m");
        check(
            "30 }",
            "30, heading_deg = 400 }",
            "m.toml:5:98: the survey of objective `look`: its heading is 400, expected degrees from -360 to 360",
        );
        check(
            "[100, 90], [300, 90], [300, 0]",
            "[100, 9000], [9000, 9000], [9000, 100]",
            "m.toml:5:88: the survey of objective `look`: it has 29",
        );
        check(
            "[300, 90]",
            "[3e9, 90]",
            "m.toml:5:24: the survey of objective `look`: it has a corner more than 100 km",
        );
        check(
            "[100, 90], [300, 90]",
            "[300, 90], [100, 90]",
            "m.toml:5:24: the survey of objective `look`: it crosses itself",
        );
        check(
            "[100, 90], [300, 90], ",
            "",
            "m.toml:5:24: the survey of objective `look`: it crosses itself, has fewer than three",
        );
        check(
            "corners_m = [[100, 0], [100, 90], [300, 90], [300, 0]], ",
            "",
            "m.toml:5:10: the survey of objective `look` has no corners",
        );
        check(
            "spacing_m = 30",
            "spacing_m = 30, corners_deg = []",
            "m.toml:5:24: the survey of objective `look` has its corners twice",
        );
        check("spacing_m", "distance_m", "m.toml:5:68: unknown field `distance_m`, expected one of");
        check("40.0", "400.0", "m.toml:6:12: objective `look` is at height 400 m, expected at most 120 m");
        check(", spacing_m = 30", "", "m.toml:5:10: the survey of objective `look` has no spacing");
        check(
            "30 }",
            "30, picture_distance_m = 0 }",
            "m.toml:5:105: the survey of objective `look`: its pictures are 0 m apart, expected 0.1 to",
        );
        check(
            "spacing_m = 30",
            "side_overlap = 0.7",
            "m.toml:5:83: the survey of objective `look` has `side_overlap`, and the mission has no camera",
        );
    }

    const CAMERA: &str = "\n[camera]\nsensor_width_mm = 13.2\nsensor_height_mm = 8.8\nfocal_length_mm = 8.8\n";

    #[test]
    fn an_overlap_of_pictures_is_a_distance_by_the_figures_of_the_camera() {
        let text = GOOD.replace("spacing_m = 30", "side_overlap = 0.5, forward_overlap = 0.8") + CAMERA;
        let mission = read(&text).unwrap();
        let survey = mission.objectives[0].survey.as_ref().unwrap();
        // 60 m across by 40 m along from 40 m.
        assert_eq!((survey.spacing_m(), survey.picture_distance_m()), (30.0, Some(8.0)));
        let in_metres = "spacing_m = 30, picture_distance_m = 8";
        let same = read(&GOOD.replace("spacing_m = 30", in_metres)).unwrap();
        assert_eq!(mission.identity(), same.identity());
        assert_ne!(mission.identity(), read(GOOD).unwrap().identity());
    }

    #[test]
    fn a_task_along_the_lines_that_leaves_out_its_distance_gets_that_of_the_pictures() {
        let text = "version = 1\nsummary = \"Takes pictures\"\nvehicle = \"flies\"\noutcome = { done = \"success\" }
            [input.every_m]\nleast = 1.0\nmost = 500.0\n[mavlink]\ncommand = \"DO_SET_CAM_TRIGG_DIST\"\nparams = [\"every_m\"]\n";
        let skill = DeclaredSkill::read(&Source { path: "photo.toml".into(), text: text.into() }).unwrap();
        let skills = DeclaredSkills::of(vec![skill]);
        let read = |survey: &str, along: &str| {
            let keys = format!("along = [{{ skill = \"photo\"{along} }}]\nflying = true");
            let text = GOOD.replacen("flying = true", &keys, 1).replace("spacing_m = 30", survey);
            let mission = Mission::read_with(&Source { path: "m.toml".into(), text }, &skills, None)?;
            Ok::<_, Mistakes>(mission.objectives[0].terms.along[0].inputs.clone())
        };
        let every_m = |metres| Ok(vec![("every_m".to_owned(), crate::task::Value::Number(metres))]);
        assert_eq!(read("spacing_m = 30, picture_distance_m = 8", ""), every_m(8.0));
        assert_eq!(read("spacing_m = 30, picture_distance_m = 8", ", every_m = 12"), every_m(12.0));
        let missing = read("spacing_m = 30", "").unwrap_err().to_string();
        assert!(missing.starts_with("m.toml:7:10: skill `photo` needs `every_m`"), "{missing}");
    }

    #[test]
    fn every_mistake_about_an_overlap_is_told_with_its_place() {
        #[track_caller]
        fn check(find: &str, replace: &str, expected: &str) {
            let good = GOOD.replace("spacing_m = 30", "side_overlap = 0.5, forward_overlap = 0.8") + CAMERA;
            check_mistake(&good, find, replace, read, expected);
        }
        check(
            "side_overlap = 0.5",
            "spacing_m = 30, side_overlap = 0.5",
            "m.toml:5:99: the survey of objective `look` has `spacing_m` and `side_overlap`",
        );
        check(
            "forward_overlap = 0.8",
            "picture_distance_m = 8, forward_overlap = 0.8",
            "m.toml:5:130: the survey of objective `look` has `picture_distance_m` and `forward_overlap`",
        );
        check("0.5", "1.0", "m.toml:5:83: the survey of objective `look`: its `side_overlap` is 1, expected 0 to 0.95");
        check(
            "0.8",
            "80",
            "m.toml:5:106: the survey of objective `look`: its `forward_overlap` is 80, expected 0 to 0.95",
        );
        check("40.0", "6.0", "m.toml:5:83: the survey of objective `look`: its spacing is 4.5 m, expected 5 to");
        check("40.0", "0.0", "m.toml:6:12: objective `look` is inside the ground: it flies at height 0 m");
        check("= 13.2", "= 0.0", "m.toml:16:19: found 0, expected a number between");
        check("sensor_height_mm = 8.8", "", "m.toml:15:1: missing field `sensor_height_mm`");
    }

    #[test]
    fn each_turn_keeps_its_distance_from_the_borders() {
        let area =
            "[[area]]\nname = \"A\"\nkind = \"keep-out\"\ncorners_m = [[290, 82], [310, 82], [310, 200], [290, 200]]\n";
        let told = read(&format!("{GOOD}{area}")).unwrap_err().to_string();
        let expected = "m.toml:5:24: objective `look` at (300, 75, 40) lies 7.0 m from the border of area `A`";
        assert!(told.starts_with(expected), "{told}");
    }
}
