//! How long a record may be. Some of its texts are a client's, or a service's, or of the file of the tokens: none of them is trusted to be short,
//! for a thousand records are in memory, and `verify` takes no line that is longer than [`MAX_LINE`].

use kittiwake_proto::v1::AuditRecord;
use prost::Message as _;

use super::refusals::cut;

/// Bytes of a line that no record reaches.
pub(super) const MAX_LINE: u64 = 1 << 20;
/// Characters of a text.
const MAX_TEXT: usize = 500;
/// The most roles: far more than there are.
const MAX_ROLES: usize = 16;
/// Bytes of the arguments on the wire, whose text has at most six for each of them. The maker of a record ensures that
/// they have less (`http::record`); from one that does not, they are left out.
const MAX_ARGUMENTS: usize = 16 * 1024;

/// The record with each of its texts cut.
pub(super) fn bounded(record: AuditRecord) -> AuditRecord {
    let short = |text: String| cut(&text, MAX_TEXT);
    AuditRecord {
        who: record.who.map(short),
        roles: record.roles.into_iter().take(MAX_ROLES).map(short).collect(),
        vehicle: short(record.vehicle),
        what: short(record.what),
        request_id: short(record.request_id),
        arguments: record.arguments.filter(|it| it.encoded_len() <= MAX_ARGUMENTS),
        outcome: short(record.outcome),
        address: short(record.address),
        ..record
    }
}

#[cfg(test)]
mod tests {
    use kittiwake_proto::json::any;
    use serde_json::{Value, json};

    use super::super::chain::{Begun, line};
    use super::*;

    /// Whether a record with these arguments keeps them, if all its texts are as long as nothing should be.
    #[track_caller]
    fn check(arguments: &Value, are_kept: bool) {
        // Escaped, it has six bytes.
        let long = || "\u{1}".repeat(100_000);
        let record = bounded(AuditRecord {
            utc: super::super::utc(),
            who: Some(long()),
            roles: vec![long(); MAX_ROLES],
            vehicle: long(),
            what: long(),
            request_id: long(),
            arguments: any(arguments),
            status: u32::MAX,
            outcome: long(),
            number: u64::MAX,
            stage: 2,
            asked: Some(u64::MAX),
            address: long(),
        });
        assert_eq!((record.outcome.chars().count(), record.arguments.is_some()), (MAX_TEXT + 1, are_kept));
        let line = line(&record, &[9; 32], Some(Begun::Lost));
        assert!((line.len() as u64) < MAX_LINE / 2, "{} bytes", line.len());
    }

    #[test]
    fn no_record_has_a_line_that_verify_refuses_whatever_is_in_it() {
        check(&json!({ "reason": "fog" }), true);
        for (element, most) in [(json!(null), 4), (json!(false), 4), (json!(-f64::MIN_POSITIVE), 11)] {
            check(&Value::Array(vec![element.clone(); MAX_ARGUMENTS / most - 9]), true);
            check(&Value::Array(vec![element; MAX_ARGUMENTS]), false);
        }
        check(&json!("\u{1}".repeat(MAX_ARGUMENTS - 9)), true);
        check(&json!("\u{1}".repeat(MAX_ARGUMENTS)), false);
    }
}
