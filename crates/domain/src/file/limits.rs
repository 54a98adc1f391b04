//! Limits on what is reported of the mistakes in a file. A file may come over a link, and the report goes back over it: a small file must not make
//! a large answer, whatever is in it.

/// The most mistakes that are reported of one file: who has more mends those first.
pub const MOST_MISTAKES: usize = 20;
/// The longest message and the longest help, in characters: a list of all flags, which is the longest that we make, fits in.
const LONGEST_TEXT: usize = 2_000;
/// The most characters that are shown of a line, and of them before the place of the mistake.
const LONGEST_LINE: usize = 200;
const BEFORE: usize = 120;
/// Stands where something is left out.
const LEFT_OUT: char = '…';

/// A message or a help, cut to the longest that is shown.
pub(super) fn told(text: String) -> String {
    if text.len() <= LONGEST_TEXT { text } else { shortened(&text, LONGEST_TEXT) }
}

/// `text`, or its beginning and its end if it has more than `most` characters: what was expected stands at the end.
pub(super) fn shortened(text: &str, most: usize) -> String {
    let count = text.chars().count();
    if count <= most {
        return text.to_owned();
    }
    let beginning = text.chars().take(most / 2);
    let end = text.chars().skip(count - most / 2);
    beginning.chain([LEFT_OUT]).chain(end).collect()
}

/// The part of `line` around its character at the byte `at`.
pub(super) fn excerpt(line: &str, at: usize) -> String {
    let (before, after) = line.split_at(at.min(line.len()));
    let count = before.chars().count();
    let missing = count.saturating_sub(BEFORE);
    let room = LONGEST_LINE - (count - missing);
    let is_cut = after.chars().nth(room).is_some();
    let cut_before = (0 < missing).then_some(LEFT_OUT);
    let cut_after = is_cut.then_some(LEFT_OUT);
    let shown = before.chars().skip(missing).chain(after.chars().take(room));
    cut_before.into_iter().chain(shown).chain(cut_after).collect()
}

/// How many characters of `shown` stand before a character of which `before` stand before it in its line: `shown` is that line, or its
/// [`excerpt`].
pub(super) fn before_in_excerpt(shown: &str, before: usize) -> usize {
    if shown.starts_with(LEFT_OUT) { before.min(BEFORE + 1) } else { before }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_long_line_the_part_around_the_mistake_is_shown_with_the_mark_below_it() {
        /// A line with an `X` after `before` characters and before `after` others.
        #[track_caller]
        fn check(fill: &str, before: usize, after: usize, is_cut: [bool; 2]) {
            let line = format!("{}X{}", fill.repeat(before), fill.repeat(after));
            let shown = excerpt(&line, fill.len() * before);
            let mark = before_in_excerpt(&shown, before);
            assert_eq!(shown.chars().nth(mark), Some('X'), "{shown}");
            assert!(shown.chars().count() <= LONGEST_LINE + 2, "{shown}");
            assert_eq!([shown.starts_with(LEFT_OUT), shown.ends_with(LEFT_OUT)], is_cut, "{shown}");
            assert!(is_cut != [false; 2] || shown == line, "{shown}");
        }
        for fill in ["a", "ä", "\t"] {
            check(fill, 0, 0, [false, false]);
            check(fill, 0, 199, [false, false]);
            check(fill, 0, 200, [false, true]);
            check(fill, 120, 79, [false, false]);
            check(fill, 120, 80, [false, true]);
            check(fill, 121, 0, [true, false]);
            check(fill, 121, 79, [true, false]);
            check(fill, 9_000, 9_000, [true, true]);
        }
        // At the end of the line, and beyond it.
        assert_eq!((excerpt("ab", 2).as_str(), excerpt("ab", 3).as_str()), ("ab", "ab"));
        // A line may begin with the mark of what is left out.
        assert_eq!(before_in_excerpt(&excerpt("…bX", 4), 2), 2);
    }

    #[test]
    fn of_a_long_text_the_beginning_and_the_end_are_told() {
        #[track_caller]
        fn check(text: &str, most: usize, expected: &str) {
            assert_eq!(shortened(text, most), expected);
        }
        check("", 4, "");
        check("abcd", 4, "abcd");
        check("abcdefgh", 4, "ab…gh");
        check("äöüß€", 4, "äö…ß€");
        let message = format!("invalid type: string \"{}\", expected a number", "x".repeat(60_000));
        let told = told(message);
        assert!(told.starts_with("invalid type: string \"xx") && told.ends_with("xx\", expected a number"), "{told}");
        assert_eq!(told.chars().count(), LONGEST_TEXT + 1);
    }
}
