//! What a name that is not known was to be.

use super::limits::shortened;

/// A name that differs in no more characters, and not in all, is taken for a misspelt one.
const MOST_DIFFERENT: usize = 3;
/// The longest name that is compared or shown, in characters: the time to compare two grows with the product of their lengths.
const LONGEST: usize = 100;
/// The most names that are listed.
const MOST_LISTED: usize = 10;

/// The entry of `known` that is closest to `found`, as a help text; the first of them if none is close.
pub fn did_you_mean(found: &str, known: &[&str]) -> String {
    nearest(found, known).map_or_else(|| listed(known), |it| format!("did you mean `{it}`?"))
}

/// Help for a parser's message such as "unknown field `spee`, expected `speed` or `count`"; `None` if no expected name is close.
pub(super) fn misspelt(message: &str) -> Option<String> {
    let names: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    let (found, known) = names.split_first().filter(|_| message.starts_with("unknown "))?;
    nearest(found, known).map(|it| format!("did you mean `{it}`?"))
}

fn nearest<'k>(found: &str, known: &[&'k str]) -> Option<&'k str> {
    let length = found.chars().count();
    let is_comparable = |it: &&&str| {
        let other = it.chars().count();
        // Two texts differ at least by their lengths.
        length <= LONGEST && other <= LONGEST && length.abs_diff(other) <= MOST_DIFFERENT
    };
    let compared = known.iter().filter(is_comparable).map(|it| (strsim::levenshtein(found, it), *it));
    compared
        .min_by_key(|(different, _)| *different)
        .filter(|(different, it)| *different <= MOST_DIFFERENT && *different < it.chars().count().max(length))
        .map(|it| it.1)
}

fn listed(known: &[&str]) -> String {
    let names: Vec<_> = known.iter().take(MOST_LISTED).map(|it| shortened(it, LONGEST)).collect();
    let more = match known.len().saturating_sub(MOST_LISTED) {
        0 => String::new(),
        more => format!(", and {more} more"),
    };
    format!("known: {}{more}", names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(found: &str, known: &[&str], expected: &str) {
        assert_eq!(did_you_mean(found, known), expected);
    }

    #[test]
    fn the_nearest_name_is_offered() {
        check("lnad", &["land", "stop"], "did you mean `land`?");
        check("fly", &["return_home", "takeoff"], "known: return_home, takeoff");
        check("stpo", &["step", "stop", "stow"], "did you mean `step`?");
        check("fly", &[], "known: ");
    }

    #[test]
    fn a_misspelt_name_in_a_parsers_message_is_recognized() {
        #[track_caller]
        fn check(message: &str, expected: Option<&str>) {
            assert_eq!(misspelt(message).as_deref(), expected, "{message}");
        }
        check("unknown field `spee`, expected `speed` or `count`", Some("did you mean `speed`?"));
        check("unknown variant `qiuck`, expected one of `slow`, `quick`, `idle`", Some("did you mean `quick`?"));
        check("unknown field `fly`, expected `do`", None);
        check("unknown field `spee`", None);
        check("missing field `spee`, not `speed`", None);
    }

    #[test]
    fn of_many_names_the_first_ten_are_listed() {
        let names: Vec<String> = (10..30).map(|number| format!("objective {number}")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let ten = "known: objective 10, objective 11, objective 12, objective 13, objective 14, objective 15, objective 16, \
             objective 17, objective 18, objective 19";
        check("x", &names[..10], ten);
        check("x", &names, &format!("{ten}, and 10 more"));
    }

    #[test]
    fn a_long_text_is_neither_compared_nor_repeated() {
        let (hundred, longer) = ("x".repeat(100), "x".repeat(101));
        check(&hundred[1..], &[&hundred], &format!("did you mean `{hundred}`?"));
        check(&longer, &[&hundred], &format!("known: {hundred}"));
        check(&hundred, &[&longer], &format!("known: {}…{}", &hundred[..50], &hundred[..50]));
    }
}
