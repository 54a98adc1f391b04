//! Data sets that areas come from: who publishes one, which edition it is, and how long it is to be used.
//!
//! A feed changes no rule: its areas bar what they bar also after its validity is over. It says where they come from.

use crate::time::utc_text;

/// The name of the feed of the areas that stay in a mission because the control tower has closed them. No data set has it.
pub const TOWER: &str = "control tower";

/// An edition of a data set. All but the name may be unknown.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Feed {
    /// Unique within a mission: the name of the file.
    pub name: String,
    /// Who publishes it.
    pub provider: Option<String>,
    /// When it was published, milliseconds since the Unix epoch, UTC.
    pub issued_utc_ms: Option<i64>,
    /// It is to be used from then on.
    pub valid_from_utc_ms: Option<i64>,
    /// It is to be used until then.
    pub valid_until_utc_ms: Option<i64>,
    /// The names of the areas that came from it.
    pub areas: Vec<String>,
}

impl Feed {
    /// Whether it is a data set, not what the tower has closed.
    pub fn is_data_set(&self) -> bool {
        self.name != TOWER
    }

    /// Its name and its edition, such as "feed zones.json of FOCA, issued 2026-05-01T00:00:00Z".
    pub fn in_words(&self) -> String {
        let mut text = format!("feed `{}`", self.name);
        if let Some(provider) = &self.provider {
            text += &format!(" of {provider}");
        }
        let moment = |words: &str, utc_ms: Option<i64>| utc_ms.map(|it| format!(", {words} {}", utc_text(it)));
        let moments = [
            moment("issued", self.issued_utc_ms),
            moment("valid from", self.valid_from_utc_ms),
            moment("valid until", self.valid_until_utc_ms),
        ];
        text + &moments.into_iter().flatten().collect::<String>()
    }

    /// Whether it is a later edition than `other`, and one to be used at this moment of UTC.
    pub fn renews(&self, other: &Feed, utc_ms: i64) -> bool {
        let is_later = |mine: Option<i64>, its: Option<i64>| Some(its? < mine?);
        let by_issue = is_later(self.issued_utc_ms, other.issued_utc_ms);
        let is_later = by_issue.or_else(|| is_later(self.valid_from_utc_ms, other.valid_from_utc_ms));
        self.name == other.name && is_later == Some(true) && self.out_of_date(utc_ms).is_none()
    }

    /// Why it is not to be used at this moment of UTC, as a sentence; `None` if it is, or nobody knows.
    pub fn out_of_date(&self, utc_ms: i64) -> Option<String> {
        let name = &self.name;
        match (self.valid_from_utc_ms, self.valid_until_utc_ms) {
            (_, Some(until)) if until <= utc_ms => {
                let until = utc_text(until);
                Some(format!("feed `{name}` is OUT OF DATE: it was valid until {until}; get the present edition"))
            }
            (Some(from), _) if utc_ms < from => {
                let from = utc_text(from);
                Some(format!("feed `{name}` is NOT VALID YET: it is valid from {from}; get the present edition"))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_feed_is_used_within_its_validity() {
        #[track_caller]
        fn check(from: Option<i64>, until: Option<i64>, expected: &str) {
            let feed = Feed { name: "z".into(), valid_from_utc_ms: from, valid_until_utc_ms: until, ..Feed::default() };
            let told = feed.out_of_date(5_000).unwrap_or_default();
            assert!(told.starts_with(expected) && told.is_empty() == expected.is_empty(), "{told}");
        }
        check(None, None, "");
        check(Some(5_000), Some(5_001), "");
        check(None, Some(5_000), "feed `z` is OUT OF DATE: it was valid until 1970-01-01T00:00:05Z");
        check(Some(6_000), None, "feed `z` is NOT VALID YET: it is valid from 1970-01-01T00:00:06Z");
        check(Some(1), Some(2), "feed `z` is OUT OF DATE");
    }

    #[test]
    fn a_later_edition_that_is_in_use_renews_an_earlier_one() {
        #[track_caller]
        fn check(issued: [Option<i64>; 2], valid_from: [Option<i64>; 2], expected: bool) {
            let of = |at: usize| Feed {
                name: "z".into(),
                issued_utc_ms: issued[at],
                valid_from_utc_ms: valid_from[at],
                ..Feed::default()
            };
            assert_eq!(of(1).renews(&of(0), 5_000), expected, "{issued:?} {valid_from:?}");
            assert!(!Feed { name: "y".into(), ..of(1) }.renews(&of(0), 5_000));
        }
        check([Some(1), Some(2)], [None, None], true);
        check([Some(2), Some(2)], [Some(1), Some(2)], false);
        check([None, Some(2)], [Some(1), Some(2)], true);
        check([Some(1), Some(2)], [None, Some(6_000)], false);
        check([None, Some(2)], [None, None], false);
    }

    #[test]
    fn what_is_known_of_an_edition_is_told() {
        let feed = Feed { name: "z.json".into(), ..Feed::default() };
        assert_eq!(feed.in_words(), "feed `z.json`");
        let known = Feed {
            provider: Some("FOCA".into()),
            issued_utc_ms: Some(0),
            valid_from_utc_ms: Some(1_000),
            valid_until_utc_ms: Some(2_000),
            ..feed
        };
        let expected = "feed `z.json` of FOCA, issued 1970-01-01T00:00:00Z, valid from 1970-01-01T00:00:01Z, \
                        valid until 1970-01-01T00:00:02Z";
        assert_eq!(known.in_words(), expected);
    }
}
