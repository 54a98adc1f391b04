//! The largest mission that is flown. Beyond it a file is refused before its areas are looked at, so that neither the time nor
//! the memory of a check, of a plan or of a message on the bus grows without an end.

use toml::Spanned;

use super::{AreaEntry, Checker, MissionFile, ObjectiveEntry};
use crate::control_character::is_control;
use crate::site::MOST_SITES;

/// The most objectives of a mission.
pub const MOST_OBJECTIVES: usize = 500;
/// The most areas: those of a harbour are hundreds.
pub const MOST_AREAS: usize = 2_000;
/// The most corners of all areas together. With these the planner's status has less than 4 MiB, see `docs/planning.md`.
pub const MOST_CORNERS: usize = 100_000;
/// The most corners of one area, its holes included: whether it crosses itself is found by comparing each side with each.
pub const MOST_CORNERS_OF_AREA: usize = 4_000;
/// The most actions of all objectives together.
pub const MOST_ACTIONS: usize = 2_000;
/// The longest action, in characters: a name and seven numbers.
pub const LONGEST_ACTION: usize = 200;
/// The longest name of a mission, an objective, an area, a site, a feed or a provider, in characters.
pub const LONGEST_NAME: usize = 100;

const CUT: &str = "cut the mission to what one flight needs";

impl AreaEntry {
    /// Those of all rings.
    fn corner_count(&self) -> usize {
        let outline = self.corners_m.as_ref().or(self.corners_deg.as_ref()).map_or(0, |it| it.as_ref().len());
        outline + self.holes().iter().map(|it| it.as_ref().len()).sum::<usize>()
    }
}

/// The first character that has no place in a name, which is shown on terminals.
pub(super) fn control_character(name: &str) -> Option<char> {
    name.chars().find(|it| is_control(*it))
}

impl Checker<'_> {
    /// What of the file is beyond the bounds.
    pub(super) fn bounds(&mut self, file: &MissionFile) {
        let first_beyond = file.objective.get(MOST_OBJECTIVES).map(|it| &it.name);
        self.count("objectives", file.objective.len(), MOST_OBJECTIVES, first_beyond);
        self.count("areas", file.area.len(), MOST_AREAS, file.area.get(MOST_AREAS).map(|it| &it.name));
        // A volume becomes two areas.
        let of_volume = file.volume.as_ref().map_or(0, |it| it.as_ref().corner_count());
        let (mut corners, mut first_beyond) = (2 * of_volume, None);
        if MOST_CORNERS_OF_AREA < of_volume {
            let message = format!("the volume has {of_volume} corners, at most {MOST_CORNERS_OF_AREA} are allowed");
            self.say(file.volume.as_ref().map(Spanned::span), message, "simplify its outline");
        }
        for area in &file.area {
            let count = area.corner_count();
            corners += count;
            if MOST_CORNERS < corners && first_beyond.is_none() {
                first_beyond = Some(&area.name);
            }
            if MOST_CORNERS_OF_AREA < count {
                let message = format!(
                    "area `{}` has {count} corners, at most {MOST_CORNERS_OF_AREA} are allowed",
                    area.name.as_ref()
                );
                self.say(Some(area.name.span()), message, "simplify its outline and its holes");
            }
        }
        self.count("corners of areas", corners, MOST_CORNERS, first_beyond);
        let mut actions = file.objective.iter().flat_map(|it| &it.actions);
        self.count("actions", actions.clone().count(), MOST_ACTIONS, actions.nth(MOST_ACTIONS));
        self.counts_of_after(&file.objective);
        if let Some(first) = file.site.get(MOST_SITES) {
            let message = format!("{} sites, expected at most {MOST_SITES}", file.site.len());
            let help = "take some out: a vehicle needs those that it can reach from its way";
            self.say(Some(first.name.span()), message, help);
        }
        let objectives = file.objective.iter().map(|it| ("an objective", &it.name));
        let areas = file.area.iter().map(|it| ("an area", &it.name));
        let sites = file.site.iter().map(|it| ("a site", &it.name));
        for (what, name) in objectives.chain(areas).chain(sites) {
            self.name(what, name.as_ref(), Some(name));
        }
        self.name("a mission", &file.name, None);
        self.bounds_of_feeds(&file.feed);
    }

    /// Whether no objective names more in `after` than there are.
    fn counts_of_after(&mut self, objectives: &[ObjectiveEntry]) {
        let most = objectives.len();
        for it in objectives {
            if let Some(first_beyond) = it.after.get(most) {
                let (name, count) = (it.name.as_ref(), it.after.len());
                let message =
                    format!("objective `{name}` has {count} names in `after`, and the mission {most} objectives");
                self.say(Some(first_beyond.span()), message, "name each that comes before it once");
            }
        }
    }

    pub(super) fn count(&mut self, what: &str, count: usize, most: usize, first_beyond: Option<&Spanned<String>>) {
        if most < count {
            let message = format!("the mission has {count} {what}, at most {most} are allowed");
            self.say(first_beyond.map(Spanned::span), message, CUT);
        }
    }

    pub(super) fn name(&mut self, what: &str, name: &str, entry: Option<&Spanned<String>>) {
        let count = name.chars().count();
        if name.trim().is_empty() {
            self.say(entry.map(Spanned::span), format!("the name of {what} is empty"), "give it one");
        }
        if LONGEST_NAME < count {
            let message = format!("the name of {what} has {count} characters, at most {LONGEST_NAME} are allowed");
            self.say(entry.map(Spanned::span), message, "choose a shorter one");
        }
        if let Some(found) = control_character(name) {
            let message = format!("the name of {what} has the control character U+{:04X}", u32::from(found));
            self.say(entry.map(Spanned::span), message, "write it on one line, without control characters");
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use super::*;
    use crate::file::{Mistakes, Source};
    use crate::mission::Mission;

    fn read(text: &str) -> Result<Mission, Mistakes> {
        Mission::read(&Source { path: "m.toml".into(), text: text.to_owned() })
    }

    /// A mission of that many objectives, and of areas with these numbers of corners, side by side far away.
    fn mission(objectives: usize, areas: &[usize]) -> String {
        let mut text = "name = \"m\"\n".to_owned();
        for number in 0..objectives {
            let _ = writeln!(
                text,
                "[[objective]]\nname = \"o{number}\"\nnorth_m = 0\neast_m = 0\nheight_m = 20\nflying = true"
            );
        }
        for (number, &corners) in areas.iter().enumerate() {
            // Along the northern side of a rectangle, and its two southern corners.
            let west_m = 1_000.0 + 20.0 * number as f64;
            let north =
                (2..corners).map(|it| format!("[5010.0, {}]", west_m + 10.0 * (it - 2) as f64 / corners as f64));
            let south = [format!("[5000.0, {}]", west_m + 10.0), format!("[5000.0, {west_m}]")];
            let corners = north.chain(south).collect::<Vec<_>>().join(", ");
            let _ = writeln!(text, "[[area]]\nname = \"a{number}\"\nkind = \"keep-out\"\ncorners_m = [{corners}]");
        }
        text
    }

    #[test]
    fn a_mission_beyond_the_bounds_is_refused_with_the_figures() {
        #[track_caller]
        fn check(text: &str, expected: &str) {
            let told = read(text).unwrap_err().to_string();
            assert!(told.starts_with(expected), "expected `{expected}`, got `{told:.300}`");
        }
        // Six lines an objective, four an area.
        check(
            &mission(501, &[]),
            "m.toml:3003:8: the mission has 501 objectives, at most 500 are allowed\n     |\n3003 | name = \"o500\"",
        );
        check(&mission(1, &[4; 2_001]), "m.toml:8009:8: the mission has 2001 areas, at most 2000 are allowed");
        check(&mission(1, &[4_001]), "m.toml:9:8: area `a0` has 4001 corners, at most 4000 are allowed");
        check(
            &mission(1, &[3_500; 30]),
            "m.toml:121:8: the mission has 105000 corners of areas, at most 100000 are allowed",
        );
        check(
            &mission(1, &[]).replace("true\n", &format!("true\nactions = [{}]\n", "\"A\", ".repeat(2_001))),
            "m.toml:8:10012: the mission has 2001 actions, at most 2000 are allowed",
        );
        let long = "x".repeat(101);
        check(
            &mission(1, &[4]).replace("\"o0\"", &format!("\"{long}\"")),
            "m.toml:3:8: the name of an objective has 101 characters, at most 100 are allowed",
        );
        check(
            &mission(1, &[4]).replace("\"a0\"", &format!("\"{long}\"")),
            "m.toml:9:8: the name of an area has 101 characters, at most 100 are allowed",
        );
        check(
            &mission(1, &[4]).replace("\"m\"", &format!("\"{long}\"")),
            "m.toml: the name of a mission has 101 characters, at most 100 are allowed",
        );
    }

    #[test]
    fn an_objective_names_no_more_in_after_than_there_are() {
        #[track_caller]
        fn check(after: &str, expected: &str) {
            let text = mission(2, &[]).replacen("flying = true", &format!("flying = true\nafter = {after}"), 1);
            let told = read(&text).unwrap_err().to_string();
            assert!(told.starts_with(expected), "expected `{expected}`, got `{told}`");
        }
        check(r#"["", ""]"#, "m.toml:8:10: there is no objective ``");
        let many = "m.toml:8:18: objective `o0` has 3 names in `after`, and the mission 2 objectives";
        check(r#"["", "", ""]"#, many);
        check(r#"["o1", "o1", "o1"]"#, &many.replace("8:18", "8:22"));
    }

    #[test]
    fn a_name_with_a_control_character_is_refused_with_its_place() {
        #[track_caller]
        fn check(name: &str, written: &str, expected: &str) {
            let told = read(&mission(1, &[4]).replace(&format!("\"{name}\""), &format!("\"{written}\""))).unwrap_err();
            assert!(told.to_string().starts_with(expected), "expected `{expected}`, got `{told}`");
        }
        check("o0", r"d\nmission over", "m.toml:3:8: the name of an objective has the control character U+000A");
        check("a0", r"A\r\u001b[2KX", "m.toml:9:8: the name of an area has the control character U+000D");
        check("m", r"\u009b2J", "m.toml: the name of a mission has the control character U+009B");
        check("a0", r"\u202etnarg", "m.toml:9:8: the name of an area has the control character U+202E");
        check("m", r"a\u200b", "m.toml: the name of a mission has the control character U+200B");
    }

    #[test]
    fn a_name_is_not_empty() {
        #[track_caller]
        fn check(name: &str, expected: &str) {
            let told = read(&mission(1, &[4]).replace(&format!("\"{name}\""), "\" \"")).unwrap_err().to_string();
            assert!(told.starts_with(expected), "expected `{expected}`, got `{told}`");
        }
        check("o0", "m.toml:3:8: the name of an objective is empty");
        check("a0", "m.toml:9:8: the name of an area is empty");
        check("m", "m.toml: the name of a mission is empty");
    }

    #[test]
    fn a_mission_at_the_bounds_is_read() {
        let mission = read(&mission(500, &[4; 2_000])).unwrap_or_else(|it| panic!("{it:.300}"));
        assert_eq!((mission.objectives.len(), mission.areas.len()), (500, 2_000));
        let corners = read(&self::mission(1, &[1_000])).unwrap_or_else(|it| panic!("{it:.300}"));
        assert_eq!(corners.areas[0].corners.len(), 1_000);
        // Characters, not bytes.
        assert!(read(&self::mission(1, &[]).replace("\"o0\"", &format!("\"{}\"", "ä".repeat(100)))).is_ok());
    }

    /// The largest names, and the most areas with the most corners that they can have together.
    #[test]
    fn the_largest_mission_fits_a_message_on_the_bus() {
        use prost::Message as _;
        let corner = crate::geometry::Ned::new(123.456, -7890.123, -1.5);
        // A third of the corners in holes, as many holes as that makes.
        let (outline, hole) = (vec![corner; MOST_CORNERS / MOST_AREAS - 15], vec![corner; 3]);
        let area = crate::area::Area {
            name: "ä".repeat(LONGEST_NAME),
            kind: crate::area::AreaKind::KeepOut,
            corners: outline,
            holes: vec![hole; 5],
            floor_m: Some(1.5),
            ceiling_m: Some(99.5),
            from_utc_ms: Some(i64::MAX),
            until_utc_ms: Some(i64::MAX),
            hours: Some(crate::hours::WeeklyHours::parse(&["Mon-Fri 08:00-18:00", "Sat 22:00-02:00"]).unwrap()),
            ground: Default::default(),
        };
        let areas = vec![kittiwake_proto::v1::Area::from(&area); MOST_AREAS];
        let feed = kittiwake_proto::v1::Feed { areas: (0..MOST_AREAS as u32).collect(), ..Default::default() };
        let status = kittiwake_proto::v1::MissionStatus { areas, feeds: vec![feed], ..Default::default() };
        assert!(status.encoded_len() < 4 << 20, "{} bytes", status.encoded_len());
    }
}
