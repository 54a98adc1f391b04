//! The feeds of a mission file: `[[feed]]`, which `feed = "NAME"` in `[[area]]` refers to.

use serde::Deserialize;
use toml::Spanned;

use super::{AreaEntry, Checker, MissionFile};
use crate::area::Area;
use crate::feed::{Feed, TOWER};
use crate::file::{Mistakes, Source, did_you_mean};
use crate::geodesy::Origin;

/// The most feeds of a mission: a country has a handful.
pub const MOST_FEEDS: usize = 32;

/// The areas of a mission file and the data sets that they came from, without a mission.
#[derive(Debug, Clone, PartialEq)]
pub struct Airspace {
    /// Where the areas' places count from.
    pub origin: Option<Origin>,
    /// Areas with distinct names.
    pub areas: Vec<Area>,
    /// The feeds, with distinct names.
    pub feeds: Vec<Feed>,
}

impl Airspace {
    /// Parses and checks the areas and feeds of a mission file, as `Mission::read` does; objectives and sites are ignored.
    ///
    /// # Errors
    /// The mistakes, each with its place.
    pub fn read(source: &Source) -> Result<Airspace, Mistakes> {
        let file: MissionFile = source.parse()?;
        let mut check =
            Checker { source, mistakes: Mistakes::default(), frame: None, camera: None, skills: None, ready: None };
        check.bounds(&file);
        if !check.mistakes.0.is_empty() {
            return Err(check.mistakes);
        }
        let origin = file.origin.as_ref().and_then(|it| check.origin(it));
        let areas = file.area.iter().map(|it| check.area(it)).collect();
        check.distinct("area", file.area.iter().map(|it| &it.name));
        let feeds = check.feeds(&file.feed, &file.area);
        check.mistakes.or(Airspace { origin, areas, feeds })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FeedEntry {
    pub(super) name: Spanned<String>,
    pub(super) provider: Option<Spanned<String>>,
    issued_utc: Option<Spanned<String>>,
    valid_from_utc: Option<Spanned<String>>,
    valid_until_utc: Option<Spanned<String>>,
}

impl Checker<'_> {
    /// The feeds, each with the areas that name it.
    pub(super) fn feeds(&mut self, entries: &[FeedEntry], areas: &[AreaEntry]) -> Vec<Feed> {
        self.distinct("feed", entries.iter().map(|it| &it.name));
        if let Some(entry) = entries.iter().find(|it| *it.name.as_ref() == TOWER) {
            let help = "give it the name of its file; what the tower has closed stays without a feed of this name";
            self.say(Some(entry.name.span()), format!("no data set has the name `{TOWER}`"), help);
        }
        let mut feeds: Vec<Feed> = entries.iter().map(|it| self.feed(it)).collect();
        for area in areas {
            let Some(named) = &area.feed else { continue };
            match feeds.iter_mut().find(|it| it.name == *named.as_ref()) {
                Some(feed) => feed.areas.push(area.name.as_ref().clone()),
                None => {
                    let known: Vec<&str> = entries.iter().map(|it| it.name.as_ref().as_str()).collect();
                    let help = match known.as_slice() {
                        [] => "add a [[feed]] of this name, or leave `feed` out: the area is then the mission's own"
                            .into(),
                        known => did_you_mean(named.as_ref(), known),
                    };
                    let message = format!("area `{}` names feed `{}`", area.name.as_ref(), named.as_ref());
                    self.say(Some(named.span()), format!("{message}, which the mission does not have"), &help);
                }
            }
        }
        feeds
    }

    fn feed(&mut self, it: &FeedEntry) -> Feed {
        let mut moment = |text: &Option<Spanned<String>>| text.as_ref().and_then(|it| self.moment(it));
        let (issued_utc_ms, valid_from_utc_ms, valid_until_utc_ms) =
            (moment(&it.issued_utc), moment(&it.valid_from_utc), moment(&it.valid_until_utc));
        if let (Some(from), Some(until)) = (valid_from_utc_ms, valid_until_utc_ms)
            && until <= from
        {
            let message = format!("feed `{}` ends before it begins", it.name.as_ref());
            self.say(it.valid_until_utc.as_ref().map(Spanned::span), message, "");
        }
        let provider = it.provider.as_ref().map(|it| it.as_ref().clone());
        let name = it.name.as_ref().clone();
        Feed { name, provider, issued_utc_ms, valid_from_utc_ms, valid_until_utc_ms, areas: Vec::new() }
    }

    /// Refuses too many feeds, and texts that are too long.
    pub(super) fn bounds_of_feeds(&mut self, entries: &[FeedEntry]) {
        self.count("feeds", entries.len(), MOST_FEEDS, entries.get(MOST_FEEDS).map(|it| &it.name));
        for it in entries {
            self.name("a feed", it.name.as_ref(), Some(&it.name));
            if let Some(provider) = &it.provider {
                self.name("a provider", provider.as_ref(), Some(provider));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use crate::feed::Feed;
    use crate::file::{Mistakes, Source};
    use crate::mission::Mission;
    use crate::testing::check_mistake;

    const GOOD: &str = r#"
name = "there"
[[objective]]
name = "look"
north_m = 0.0
east_m = 500.0
height_m = 20.0
flying = true
[[feed]]
name = "zones.json"
provider = "FOCA"
issued_utc = "1970-01-01T00:00:01Z"
valid_from_utc = "1970-01-01T00:00:02Z"
valid_until_utc = "1970-01-01T00:00:03Z"
[[feed]]
name = "notam.json"
[[area]]
name = "A"
kind = "keep-out"
feed = "zones.json"
corners_m = [[-90.0, 110.0], [90.0, 110.0], [90.0, 290.0], [-90.0, 290.0]]
[[area]]
name = "own"
kind = "permission"
corners_m = [[-90.0, 310.0], [90.0, 310.0], [90.0, 390.0], [-90.0, 390.0]]
"#;

    fn read(text: &str) -> Result<Mission, Mistakes> {
        Mission::read(&Source { path: "m.toml".into(), text: text.into() })
    }

    #[test]
    fn an_area_knows_the_edition_it_came_from() {
        let mission = read(GOOD).unwrap_or_else(|it| panic!("{it}"));
        let zones = Feed {
            name: "zones.json".into(),
            provider: Some("FOCA".into()),
            issued_utc_ms: Some(1_000),
            valid_from_utc_ms: Some(2_000),
            valid_until_utc_ms: Some(3_000),
            areas: vec!["A".into()],
        };
        assert_eq!(mission.feeds, [zones.clone(), Feed { name: "notam.json".into(), ..Feed::default() }]);
        assert_eq!((mission.feed_of("A"), mission.feed_of("own")), (Some(&zones), None));
        let told = mission.out_of_date_feeds(3_000);
        assert!(told.len() == 1 && told[0].starts_with("feed `zones.json` is OUT OF DATE"), "{told:?}");
        // The edition is part of what the mission is.
        let other = read(&GOOD.replace("00:00:01Z", "00:00:00Z")).unwrap_or_else(|it| panic!("{it}"));
        assert_ne!(mission.identity(), other.identity());
    }

    #[test]
    fn wrong_feeds_are_reported_with_their_place() {
        #[track_caller]
        fn check(find: &str, replace: &str, expected: &str) {
            check_mistake(GOOD, find, replace, read, expected);
        }
        check("feed = \"zones.json\"", "feed = \"zone.json\"", "m.toml:20:8: area `A` names feed `zone.json`, which");
        check("\"notam.json\"", "\"zones.json\"", "m.toml:16:8: two feeds with the name `zones.json`");
        check("1970-01-01T00:00:01Z", "yesterday", "m.toml:12:14: found `yesterday`, expected a UTC date and time");
        check("00:00:03Z", "00:00:02Z", "m.toml:14:19: feed `zones.json` ends before it begins");
        check("\"FOCA\"", "\"\\u001b[2J\"", "m.toml:11:12: the name of a provider has the control character U+001B");
        check("\"notam.json\"", "\"control tower\"", "m.toml:16:8: no data set has the name `control tower`");
        check("\"notam.json\"", "\"\"", "m.toml:16:8: the name of a feed is empty");
        check("provider", "publisher", "m.toml:11:1: unknown field `publisher`");
        let mut many = String::new();
        (0..31).for_each(|it| writeln!(many, "[[feed]]\nname = \"f{it}\"").unwrap());
        check("[[area]]", &format!("{many}[[area]]"), "m.toml:78:8: the mission has 33 feeds, at most 32 are allowed");
    }
}
