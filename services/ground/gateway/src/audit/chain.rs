//! The lines of the audit trail's files: JSON, each with the number of its record, the hash of the line before and its own
//! hash, so that a line that was changed, removed or inserted is found. The first record of a file says that it is that, so
//! that a file whose beginning was removed is found.
//!
//! The hash of a line covers its bytes without its line feed. Somebody who can write the files can make the whole chain again;
//! only a hash that is noted elsewhere shows that.

use kittiwake_proto::v1::{AuditRecord, AuditStage};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use super::day_files::DAY;
use super::json_of;
use crate::access::{from_hex, to_hex};

/// A SHA-256 hash.
pub(crate) type Hash = [u8; 32];

/// The member with the hash of the line before.
const PREVIOUS: &str = "previous";
/// The member that only the first record of a file has: why the file was begun.
const BEGUN: &str = "begun";
/// The last member: the hash of the line without it. A last line has no other that would tell that it was changed.
const OWN: &str = ",\"sha256\":\"";
/// Bytes of that member, with the end of the line.
const OWN_BYTES: usize = OWN.len() + 64 + "\"}".len();

/// Why a file was begun.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Begun {
    /// It is the first of its day.
    Day,
    /// The file before had been removed, renamed or replaced while it was written to.
    Lost,
}

impl Begun {
    const ALL: [(Begun, &str); 2] = [(Begun::Day, "day"), (Begun::Lost, "lost")];

    fn name(self) -> &'static str {
        match self {
            Begun::Day => "day",
            Begun::Lost => "lost",
        }
    }
}

/// The end of a chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Tip {
    /// The number of the newest record; 0 before the first.
    pub(crate) number: u64,
    /// The hash of the newest line; zeros before the first.
    pub(crate) hash: Hash,
}

/// What a line is.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Line {
    /// A whole record.
    Record(Link),
    /// The beginning of one, or its remains after a power loss.
    Part,
    /// Something that no gateway writes, not even in part.
    Foreign,
}

/// What a record says about its place in the chain.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Link {
    pub(crate) number: u64,
    pub(crate) previous: Hash,
    /// Whether it says that the line before was cut off.
    pub(crate) after_torn: bool,
    /// It has the number of a record that was lost.
    pub(crate) in_place_of_lost: bool,
    /// Only in the first record of a file.
    pub(crate) begun: Option<Begun>,
    /// The UTC day of the record.
    pub(crate) day: String,
    /// Whether the line has the hash that it carries.
    pub(crate) is_unchanged: bool,
}

/// The line of a record that has its number, after a line with the hash `previous`.
pub(crate) fn line(record: &AuditRecord, previous: &Hash, begun: Option<Begun>) -> String {
    let mut line = json_of(record);
    line[PREVIOUS] = json!(to_hex(previous));
    if let Some(begun) = begun {
        line[BEGUN] = json!(begun.name());
    }
    let text = line.to_string();
    let own = to_hex(&hash(text.as_bytes()));
    format!("{}{OWN}{own}\"}}", text.strip_suffix('}').unwrap_or(&text))
}

/// What a line without its line feed is.
pub(crate) fn read(line: &[u8]) -> Line {
    let Ok(document) = serde_json::from_slice::<Value>(line) else { return Line::Part };
    link(line, &document).map_or(Line::Foreign, Line::Record)
}

/// Whether an invalid line is the beginning of a record, written until the gateway was killed.
pub(crate) fn is_beginning(line: &[u8]) -> bool {
    line.starts_with(b"{") && serde_json::from_slice::<Value>(line).is_err_and(|it| it.is_eof())
}

fn link(line: &[u8], document: &Value) -> Option<Link> {
    let number = document["number"].as_str()?.parse().ok()?;
    let previous = from_hex(document[PREVIOUS].as_str()?)?;
    let after_torn = document["stage"] == AuditStage::Torn.as_str_name();
    let in_place_of_lost = after_torn && document["asked"] == document["number"];
    let begun = Begun::ALL.into_iter().find(|(_, name)| document[BEGUN] == *name).map(|(begun, _)| begun);
    let day = document["utc"].as_str().and_then(|it| it.get(..DAY)).unwrap_or_default().to_owned();
    Some(Link { number, previous, after_torn, in_place_of_lost, begun, day, is_unchanged: is_unchanged(line) })
}

fn is_unchanged(line: &[u8]) -> bool {
    let (text, own) = line.split_at(line.len().saturating_sub(OWN_BYTES));
    let own = str::from_utf8(own).ok().and_then(|it| it.strip_prefix(OWN)?.strip_suffix("\"}"));
    own.and_then(from_hex) == Some(hash(&[text, b"}"].concat()))
}

/// The hash that the next line carries.
pub(crate) fn hash(line: &[u8]) -> Hash {
    Sha256::digest(line).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_where_it_belongs_and_a_part_of_it_says_nothing() {
        let (utc, what) = ("2026-01-31T12:00:00.000Z".into(), "naïve".into());
        let record = AuditRecord { number: 7, utc, what, stage: AuditStage::Torn.into(), ..Default::default() };
        for begun in [None, Some(Begun::Day), Some(Begun::Lost)] {
            let text = line(&record, &[9; 32], begun);
            assert!(!text.contains('\n'));
            let day = "2026-01-31".to_owned();
            let (previous, after_torn, in_place_of_lost) = ([9; 32], true, false);
            let link = Link { number: 7, previous, after_torn, in_place_of_lost, begun, day, is_unchanged: true };
            assert_eq!(read(text.as_bytes()), Line::Record(link));
            for end in 0..text.len() {
                let part = &text.as_bytes()[..end];
                assert_eq!((read(part), is_beginning(part)), (Line::Part, 0 < end), "{end}");
                assert!(!is_beginning(&[part, b"\0"].concat()), "{end}");
            }
        }
        for other in ["{}", "[]", "null", "7", r#"{"number":"1","previous":"00"}"#] {
            assert_eq!(read(other.as_bytes()), Line::Foreign, "{other}");
        }
        assert_eq!((read(&[0; 4096]), is_beginning(&[0; 4096])), (Line::Part, false));
    }

    #[test]
    fn a_line_shows_each_byte_of_it_that_was_changed() {
        let record = AuditRecord { number: 7, what: "pause".into(), ..Default::default() };
        let whole = line(&record, &[9; 32], None).into_bytes();
        for at in 0..whole.len() {
            let mut changed = whole.clone();
            changed[at] ^= 1;
            let is_taken = matches!(read(&changed), Line::Record(Link { is_unchanged: true, .. }));
            assert!(!is_taken, "{}", String::from_utf8_lossy(&changed));
        }
    }
}
