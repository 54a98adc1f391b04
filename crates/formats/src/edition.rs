//! What a data set says of itself: who publishes it, which edition it is, and how long it is to be used.
//!
//! ED-318 has `metadata` for that, ED-269 `title` and `createdAt`, other publishers mix them.

use serde_json::Value;

use crate::applicability::{Side, bound_of};
use crate::content::{Edition, Window};
use crate::findings::{Findings, Wrong};
use crate::json::Node;
use crate::zone_text::in_words;

const HEAD: [&str; 15] = [
    "type",
    "features",
    "UASZoneList",
    "metadata",
    "title",
    "name",
    "description",
    "formatVersion",
    "createdAt",
    "bbox",
    "crs",
    "geometry",
    "properties",
    "id",
    "timeStamp",
];
const METADATA: [&str; 14] = [
    "provider",
    "issued",
    "validFrom",
    "validTo",
    "description",
    "technicalLimitations",
    "otherGeoid",
    "title",
    "creationDateTime",
    "updateDateTime",
    "createdAt",
    "authority",
    "version",
    "responsibleOrganization",
];

/// That of a document.
pub(crate) fn read(document: &Node<'_>, findings: &mut Findings) -> Edition {
    document.note_unknown(&HEAD, findings);
    let metadata = document.get("metadata");
    if let Some(metadata) = &metadata {
        metadata.note_unknown(&METADATA, findings);
    }
    let any = |keys: &[&str]| metadata.as_ref().and_then(|it| it.any_of(keys)).or_else(|| document.any_of(keys));
    let mut moment = |keys: &[&str], side| {
        let field = any(keys)?;
        let text = field.text().and_then(|text| {
            bound_of(text, side).map_err(|why| Wrong::at(&field.place, why, "write it like 2026-05-01T08:00:00Z"))
        });
        text.map_err(|wrong| findings.note(&wrong.place, format!("{}: not read", wrong.message))).ok()
    };
    let issued_utc_ms = moment(&["issued", "updateDateTime", "creationDateTime", "createdAt", "timeStamp"], Side::From);
    let valid =
        Window { from_utc_ms: moment(&["validFrom"], Side::From), until_utc_ms: moment(&["validTo"], Side::Until) };
    let provider = any(&["provider", "authority", "responsibleOrganization", "title", "name"]);
    let provider = provider.map(|it| match it.value {
        Value::Object(members) => members.get("name").map_or_else(|| in_words(it.value), in_words),
        other => in_words(other),
    });
    Edition { provider, issued_utc_ms, valid }
}
