//! Values of the gateway's documents as a human reads them.

use serde_json::Value;

use crate::output::visible;

/// `FLIGHT_MODE_OFFBOARD` as `offboard`, given the prefix; a dash for what is unknown.
pub fn word(value: &Value, prefix: &str) -> String {
    match value.as_str().map(|it| it.strip_prefix(prefix).unwrap_or(it)) {
        None | Some("" | "UNSPECIFIED") => "-".to_owned(),
        Some(it) => it.to_lowercase().replace('_', " "),
    }
}

/// A number with its decimals; a dash for what is unknown.
pub fn number(value: &Value, decimals: usize) -> String {
    // Adding zero turns a negative zero into a positive one.
    let rounded = |number: f64| (number * 10f64.powi(decimals as i32)).round() / 10f64.powi(decimals as i32) + 0.0;
    value.as_f64().map_or_else(|| "-".to_owned(), |number| format!("{:.decimals$}", rounded(number)))
}

/// Text; a dash for what is unknown or empty.
pub fn text(value: &Value) -> &str {
    value.as_str().filter(|it| !it.is_empty()).unwrap_or("-")
}

/// The document with every text on one line, so that no name in it looks like a line of this program.
pub fn on_one_line(document: &Value) -> Value {
    match document {
        Value::String(it) => Value::String(visible::one_line(it).into_owned()),
        Value::Array(list) => list.iter().map(on_one_line).collect(),
        Value::Object(members) => members.iter().map(|(name, it)| (name.clone(), on_one_line(it))).collect(),
        Value::Null | Value::Bool(_) | Value::Number(_) => document.clone(),
    }
}

/// The elements of a list; none if the value is not a list.
pub fn each(list: &Value) -> impl Iterator<Item = &Value> {
    list.as_array().into_iter().flatten()
}

/// The texts of a list, separated by commas.
pub fn row(list: &Value) -> String {
    each(list).filter_map(Value::as_str).collect::<Vec<_>>().join(", ")
}

/// A place as north, east and height, in metres.
pub fn place(at: &Value) -> String {
    let height = at["downM"].as_f64().map_or(Value::Null, |it| Value::from(-it));
    format!("({}, {}, {})", number(&at["northM"], 0), number(&at["eastM"], 0), number(&height, 0))
}

/// Lines of columns as wide as their widest entry; the first line is the heading.
pub fn table(lines: Vec<Vec<String>>) -> String {
    let count = lines.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| lines.iter().filter_map(|it| it.get(column)).map(|it| it.chars().count()).max();
    let widths: Vec<usize> = (0..count).map(|it| width(it).unwrap_or(0)).collect();
    let line = |cells: &Vec<String>| {
        let cells: Vec<String> = cells.iter().zip(&widths).map(|(cell, &width)| format!("{cell:width$}")).collect();
        cells.join("  ").trim_end().to_owned()
    };
    lines.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// A table's heading.
pub fn heading<const N: usize>(names: [&str; N]) -> Vec<Vec<String>> {
    vec![names.map(str::to_owned).to_vec()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn enumerations_and_numbers_are_legible() {
        assert_eq!(word(&json!("FLIGHT_MODE_OFFBOARD"), "FLIGHT_MODE_"), "offboard");
        assert_eq!(word(&json!("PERMISSION_STATE_UNSPECIFIED"), "PERMISSION_STATE_"), "-");
        assert_eq!(word(&Value::Null, "X_"), "-");
        assert_eq!([number(&json!(-0.04), 1), number(&json!(2.25), 1), number(&json!("NaN"), 1)], ["0.0", "2.3", "-"]);
    }

    #[test]
    fn a_name_is_on_one_line_wherever_it_is_in_the_document() {
        let found = on_one_line(&json!({ "a": [{ "name": "r\nFORGED" }, 1.5, null], "b": "\u{1b}[2J" }));
        assert_eq!(found, json!({ "a": [{ "name": "r\\nFORGED" }, 1.5, null], "b": "\\u001b[2J" }));
    }

    #[test]
    fn columns_are_as_wide_as_their_widest_cell() {
        let mut lines = heading(["AREA", "STATE"]);
        lines.push(vec!["harbour".into(), "-".into()]);
        assert_eq!(table(lines), "AREA     STATE\nharbour  -");
    }
}
