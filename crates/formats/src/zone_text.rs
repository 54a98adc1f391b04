//! What a zone of ED-269 or ED-318 says to humans: its name, why it is there and who answers for it. It has no counterpart in
//! an area and becomes remarks beside it.

use serde_json::Value;

use crate::json::Node;

/// Metres in an international foot (1959).
pub(crate) const FEET: f64 = 0.3048;

const ED_269: [(&str, &str); 9] = [
    ("name", "Name"),
    ("country", "Country"),
    ("type", "Type"),
    ("restriction", "Restriction"),
    ("restrictionConditions", "Conditions"),
    ("reason", "Reason"),
    ("otherReasonInfo", "Other reason"),
    ("uSpaceClass", "U-space class"),
    ("message", "Message"),
];
const ED_318: [(&str, &str); 8] = [
    ("name", "Name"),
    ("country", "Country"),
    ("variant", "Variant"),
    ("type", "Restriction"),
    ("restrictionConditions", "Conditions"),
    ("reason", "Reason"),
    ("otherReasonInfo", "Other reason"),
    ("message", "Message"),
];
const SHARED: [(&str, &str); 2] = [("region", "Region"), ("regulationExemption", "Exempt from regulation")];
const AUTHORITY: [&str; 8] =
    ["name", "service", "contactName", "phone", "email", "siteURL", "purpose", "intervalBefore"];

/// The remarks of a zone of ED-269.
pub(crate) fn of_ed269(zone: &Node<'_>) -> Vec<String> {
    remarks(zone, &ED_269)
}

/// The remarks of the properties of a zone of ED-318.
pub(crate) fn of_ed318(properties: &Node<'_>) -> Vec<String> {
    remarks(properties, &ED_318)
}

fn remarks(zone: &Node<'_>, fields: &[(&str, &str)]) -> Vec<String> {
    let field = |(key, title): &(&str, &str)| {
        let words = in_words(zone.get(key)?.value);
        (!words.is_empty()).then(|| format!("{title}: {words}"))
    };
    let authorities =
        zone.value.get("zoneAuthority").and_then(Value::as_array).into_iter().flatten().map(|authority| {
            let parts = AUTHORITY.iter().filter_map(|key| authority.get(key)).map(in_words);
            format!("Authority: {}", parts.filter(|it| !it.is_empty()).collect::<Vec<_>>().join(", "))
        });
    fields.iter().chain(&SHARED).filter_map(field).chain(authorities).collect()
}

/// Texts as they are, lists separated by commas, and of a text in a language (`{"text": .., "lang": ..}`) the text.
fn in_words(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        Value::Array(items) => items.iter().map(in_words).collect::<Vec<_>>().join(", "),
        Value::Object(members) => members.get("text").map_or_else(|| value.to_string(), in_words),
        Value::Bool(_) | Value::Number(_) => value.to_string(),
    }
}
