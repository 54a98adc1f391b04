//! Data sets that areas come from: who publishes one, which edition it is, and how long it is to be used.
//!
//! A feed changes no rule: its areas bar what they bar also after its validity is over. It says where they come from.

use crate::time::utc_text;

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
