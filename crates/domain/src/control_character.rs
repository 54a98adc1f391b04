//! Which characters have no place in a name or a text that is shown: they begin a line, move a cursor, turn the order of others
//! round, or are not seen, so that a text looks like another or like words of this program.

use std::ops::RangeInclusive;

/// The format characters (general category Cf) and the separators of lines and paragraphs (Zl, Zp) of Unicode 16, from its
/// DerivedGeneralCategory.txt. The joiners U+200C and U+200D belong into some Persian and Indic words and into emoji; they are among
/// these all the same, since two names that differ only by them look the same.
const FORMAT: [RangeInclusive<char>; 21] = [
    '\u{ad}'..='\u{ad}',
    '\u{600}'..='\u{605}',
    '\u{61c}'..='\u{61c}',
    '\u{6dd}'..='\u{6dd}',
    '\u{70f}'..='\u{70f}',
    '\u{890}'..='\u{891}',
    '\u{8e2}'..='\u{8e2}',
    '\u{180e}'..='\u{180e}',
    '\u{200b}'..='\u{200f}',
    '\u{2028}'..='\u{202e}',
    '\u{2060}'..='\u{2064}',
    '\u{2066}'..='\u{206f}',
    '\u{feff}'..='\u{feff}',
    '\u{fff9}'..='\u{fffb}',
    '\u{110bd}'..='\u{110bd}',
    '\u{110cd}'..='\u{110cd}',
    '\u{13430}'..='\u{1343f}',
    '\u{1bca0}'..='\u{1bca3}',
    '\u{1d173}'..='\u{1d17a}',
    '\u{e0001}'..='\u{e0001}',
    '\u{e0020}'..='\u{e007f}',
];

/// Whether it is a control character (Cc), or one of those above.
pub fn is_control(character: char) -> bool {
    // Most text is ASCII.
    character.is_control() || (!character.is_ascii() && FORMAT.iter().any(|it| it.contains(&character)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_directs_how_a_line_is_shown_or_is_not_seen_is_found() {
        #[track_caller]
        fn check(text: &str, expected: bool) {
            for it in text.chars() {
                assert_eq!(is_control(it), expected, "U+{:04X}", u32::from(it));
            }
        }
        check("\0\t\n\r\u{1b}\u{7f}\u{9b}", true);
        // Directions, isolates and marks.
        check("\u{202a}\u{202b}\u{202c}\u{202d}\u{202e}\u{2066}\u{2067}\u{2068}\u{2069}\u{200e}\u{200f}\u{61c}", true);
        // Without a width.
        check("\u{200b}\u{200c}\u{200d}\u{2060}\u{feff}\u{ad}\u{e0041}", true);
        check("\u{2028}\u{2029}", true);
        check("Hafen 2 `Ä` é \u{301} 港 بندر नदी 🛬 \u{a0}\u{2013}\u{202f}\u{2065}\u{fe0f}", false);
    }

    #[test]
    fn the_ranges_are_in_order() {
        assert!(FORMAT.iter().all(|it| it.start() <= it.end()));
        assert!(FORMAT.is_sorted_by(|a, b| a.end() < b.start()));
    }
}
