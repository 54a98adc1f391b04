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
    spacing_m: Spanned<f64>,
    /// Of the lines, clockwise from north.
    heading_deg: Option<Spanned<f64>>,
}

impl SurveyEntry {
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
        match Survey::new(corners, *entry.spacing_m.as_ref(), heading_deg) {
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
                    InvalidSurvey::Spacing(_) => (entry.spacing_m.span(), String::new()),
                    InvalidSurvey::Heading(_) => {
                        (entry.heading_deg.as_ref().map_or(span, Spanned::span), "north is 0, east is 90".to_owned())
                    }
                    InvalidSurvey::TooManyLines { lines } => {
                        let spacing_m = (*entry.spacing_m.as_ref() * lines as f64 / MOST_LINES as f64).ceil();
                        let help =
                            format!("split it into several objectives, or set `spacing_m` to {spacing_m} or more");
                        (entry.spacing_m.span(), help)
                    }
                };
                self.say(Some(at), format!("{what}: {invalid}"), &help);
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
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
