//! Finds text of a client that would be a command to a reader's terminal.

use domain::control_character::is_control;
use serde_json::Value;

/// The JSON pointer of the first member that has a control character in its name or text.
pub(crate) fn member(body: &Value) -> Option<String> {
    let has_one = |text: &str| text.contains(is_control);
    match body {
        Value::String(text) => has_one(text).then(String::new),
        Value::Array(list) => {
            let mut members = list.iter().enumerate();
            members.find_map(|(index, it)| Some(format!("/{index}{}", member(it)?)))
        }
        // A name with one cannot be told as it is: the object is named.
        Value::Object(members) if members.keys().any(|it| has_one(it)) => Some(String::new()),
        Value::Object(members) => members.iter().find_map(|(name, it)| Some(format!("/{name}{}", member(it)?))),
        Value::Null | Value::Bool(_) | Value::Number(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_text_with_a_control_character_is_found() {
        #[track_caller]
        fn check(body: Value, expected: Option<&str>) {
            assert_eq!(member(&body).as_deref(), expected, "{body}");
        }
        check(json!({ "to": "bän", "n": 1, "list": ["a", null] }), None);
        check(json!({ "to": "\u{1b}[2J" }), Some("/to"));
        check(json!({ "flag": { "reasons": ["fog", "A\rB"] } }), Some("/flag/reasons/1"));
        check(json!({ "to": ["\u{202e}anna"] }), Some("/to/0"));
        check(json!({ "arguments": { "a\nb": 1 } }), Some("/arguments"));
    }
}
