//! How long the texts may be that are published, so that each line fits into a part of a ledger.

use domain::mission::bounds::LONGEST_NAME;

/// Of the name of an area: as long as one in a mission may be, in characters of four bytes.
pub(crate) const MAX_AREA_BYTES: usize = 4 * LONGEST_NAME;
/// Why an area is denied or revoked: some sentences.
pub(crate) const MAX_REASON_BYTES: usize = 256;
/// Of a request: longer than any id that the mission manager makes.
pub(crate) const MAX_REQUEST_ID_BYTES: usize = 64;
/// Of a flight: longer than any that the mission manager names.
pub(crate) const MAX_FLIGHT_BYTES: usize = 64;
/// What is wrong with the memory, of which the tower's log has the whole: a sentence and a path.
pub(crate) const MAX_TROUBLE_BYTES: usize = 512;

const CUT: &str = "…";

/// A text that nobody can be asked to shorten any more. One that is too long ends with `…`.
pub(crate) fn shortened(text: &str, most_bytes: usize) -> String {
    if text.len() <= most_bytes {
        return text.to_owned();
    }
    let end = text.floor_char_boundary(most_bytes - CUT.len());
    text[..end].to_owned() + CUT
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_text_that_is_too_long_is_cut_and_that_is_seen() {
        #[track_caller]
        fn check(text: &str, expected: &str) {
            assert_eq!(shortened(text, 8), expected);
        }
        check("", "");
        check("12345678", "12345678");
        check("123456789", "12345…");
        check("1234äöüß", "1234…");
    }
}
