//! The hours of an area in a mission file: `hours_utc = ["Mon-Fri 08:00-18:00", "Sat 22:00-02:00"]`.

use toml::Spanned;

use super::Checker;
use crate::hours::{WeeklyHours, text};

/// A list of texts, each with its place.
pub(super) type HoursEntry = Spanned<Vec<Spanned<String>>>;

impl Checker<'_> {
    /// The hours; `None` after a mistake.
    pub(super) fn hours(&mut self, entry: &HoursEntry) -> Option<WeeklyHours> {
        let list: &Vec<Spanned<String>> = entry.as_ref();
        let texts: Vec<&String> = list.iter().map(|it| it.as_ref()).collect();
        WeeklyHours::parse(&texts)
            .map_err(|(index, invalid)| {
                let span = list.get(index).map_or_else(|| entry.span(), Spanned::span);
                self.say(Some(span), format!("`hours_utc`: {invalid}"), text::HELP);
            })
            .ok()
    }
}

#[cfg(test)]
mod tests {
    use crate::file::{Mistakes, Source};
    use crate::mission::Mission;
    use crate::testing::check_mistake;

    const GOOD: &str = r#"
name = "there"
[[objective]]
name = "deliver"
north_m = 0.0
east_m = 500.0
height_m = 0.0
flying = false
[[area]]
name = "A"
kind = "keep-out"
corners_m = [[-90.0, 110.0], [90.0, 110.0], [90.0, 290.0], [-90.0, 290.0]]
hours_utc = ["Mon-Fri 08:00-18:00", "Sat 22:00-02:00"]
"#;

    fn read(text: &str) -> Result<Mission, Mistakes> {
        Mission::read(&Source { path: "m.toml".into(), text: text.into() })
    }

    #[test]
    fn an_area_has_the_hours_of_its_file() {
        let mission = read(GOOD).unwrap_or_else(|it| panic!("{it}"));
        let hours = mission.areas[0].hours.as_ref().expect("hours");
        assert_eq!(hours.to_texts(), ["Mon-Fri 08:00-18:00", "Sat 22:00-02:00"]);
        // They are part of what the mission is.
        let other = read(&GOOD.replace("18:00", "18:01")).unwrap_or_else(|it| panic!("{it}"));
        assert_ne!(mission.identity(), other.identity());
    }

    #[test]
    fn wrong_hours_are_reported_with_their_place() {
        #[track_caller]
        fn check(find: &str, replace: &str, expected: &str) {
            check_mistake(GOOD, find, replace, read, expected);
        }
        check("08:00-18:00", "08:00", "m.toml:13:14: `hours_utc`: found `Mon-Fri 08:00`, expected days and hours\n");
        check("Sat 22", "Day 22", "m.toml:13:37: `hours_utc`: found `Day`, expected a day: Mon, Tue");
        check("02:00", "2:00", "m.toml:13:37: `hours_utc`: found `2:00`, expected a time of day from 00:00 to 24:00");
        check("\"Mon-Fri 08:00-18:00\", \"Sat 22:00-02:00\"", "", "m.toml:13:13: `hours_utc`: no hours, so that it");
        check("[\"Mon-Fri 08:00-18:00\", \"Sat 22:00-02:00\"]", "7", "m.toml:13:13: invalid type: integer `7`");
    }

    /// The planner knows when the place is used; an area with hours for all of the week always applies.
    #[test]
    fn a_place_in_an_area_with_hours_is_left_to_the_planner() {
        let inside = GOOD.replace("east_m = 500.0", "east_m = 200.0");
        assert!(read(&inside).is_ok());
        let always = inside.replace("Sat 22:00-02:00", "Mon-Sun 00:00-24:00");
        let told = read(&always).unwrap_err().to_string();
        assert!(told.contains("objective `deliver` lies in keep-out area `A`, which always applies"), "{told}");
    }
}
