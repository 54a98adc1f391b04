//! What a zone of ED-269 or ED-318 says to humans: its name, why it is there and who answers for it. It has no counterpart in
//! an area and becomes remarks beside it.

use serde_json::Value;

use crate::json::Node;

/// Metres in an international foot (1959).
pub(crate) const FEET: f64 = 0.3048;

const FIELDS: [(&str, &str); 13] = [
    ("name", "Name"),
    ("country", "Country"),
    ("variant", "Variant"),
    ("type", "Type"),
    ("restriction", "Restriction"),
    ("restrictionConditions", "Conditions"),
    ("reason", "Reason"),
    ("reasons", "Reasons"),
    ("otherReasonInfo", "Other reason"),
    ("uSpaceClass", "U-space class"),
    ("message", "Message"),
    ("region", "Region"),
    ("regulationExemption", "Exempt from regulation"),
];
const AUTHORITY: [&str; 8] =
    ["name", "service", "contactName", "phone", "email", "siteURL", "purpose", "intervalBefore"];

/// The remarks of a zone.
pub(crate) fn remarks(zone: &Node<'_>) -> Vec<String> {
    let field = |(key, title): &(&str, &str)| {
        let words = in_words(zone.get(key)?.value);
        (!words.is_empty()).then(|| format!("{title}: {words}"))
    };
    let authorities =
        zone.value.get("zoneAuthority").and_then(Value::as_array).into_iter().flatten().map(|authority| {
            let parts = AUTHORITY.iter().filter_map(|key| authority.get(key)).map(in_words);
            format!("Authority: {}", parts.filter(|it| !it.is_empty()).collect::<Vec<_>>().join(", "))
        });
    FIELDS.iter().filter_map(field).chain(authorities).collect()
}

/// Texts as they are, lists separated by commas, and of a text in a language (`{"text": .., "lang": ..}`) the text.
pub(crate) fn in_words(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        Value::Array(items) => items.iter().map(in_words).collect::<Vec<_>>().join(", "),
        Value::Object(members) => members.get("text").map_or_else(|| value.to_string(), in_words),
        Value::Bool(_) | Value::Number(_) => value.to_string(),
    }
}
