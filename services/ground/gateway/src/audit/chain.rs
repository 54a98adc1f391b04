//! The lines of the audit trail's files: JSON, each with the number of its record and the hash of the line before, so that
//! a line that was changed, removed or inserted is found.
//!
//! The hash covers the bytes of a line without its line feed. Somebody who can write the files can make the whole chain again;
//! only a hash that is noted elsewhere shows that.

use kittiwake_proto::json::to_json;
use kittiwake_proto::v1::{AuditRecord, AuditStage};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use crate::access::{from_hex, to_hex};

/// A SHA-256 hash.
pub(crate) type Hash = [u8; 32];

/// The member with the hash of the line before.
const PREVIOUS: &str = "previous";

/// The end of a chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Tip {
    /// The number of the newest record; 0 before the first.
    pub(crate) number: u64,
    /// The hash of the newest line; zeros before the first.
    pub(crate) hash: Hash,
}

/// What a line says about its place in the chain.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Link {
    pub(crate) number: u64,
    pub(crate) previous: Hash,
    /// Whether it says that the line before was cut off.
    pub(crate) after_torn: bool,
}

/// The line of a record that has its number, after a line with the hash `previous`.
pub(crate) fn line(record: &AuditRecord, previous: &Hash) -> String {
    let mut line = to_json(record);
    line[PREVIOUS] = json!(to_hex(previous));
    line.to_string()
}

/// The place of a line; `None` if it is not a whole line of the audit trail.
pub(crate) fn link(line: &[u8]) -> Option<Link> {
    let line: Value = serde_json::from_slice(line).ok()?;
    let number = line["number"].as_str()?.parse().ok()?;
    let previous = from_hex(line[PREVIOUS].as_str()?)?;
    let after_torn = line["stage"] == AuditStage::Torn.as_str_name();
    Some(Link { number, previous, after_torn })
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
        let record = AuditRecord { number: 7, stage: AuditStage::Torn.into(), ..Default::default() };
        let text = line(&record, &[9; 32]);
        assert!(!text.contains('\n'));
        assert_eq!(link(text.as_bytes()), Some(Link { number: 7, previous: [9; 32], after_torn: true }));
        for end in 0..text.len() {
            assert_eq!(link(&text.as_bytes()[..end]), None, "{}", &text[..end]);
        }
        for other in ["{}", "[]", "null", "7", r#"{"number":"1","previous":"00"}"#] {
            assert_eq!(link(other.as_bytes()), None, "{other}");
        }
    }
}
